//! Bags of ROS 2 messages: records, plays and inspects topic + time + CDR bytes over MCAP.
//!
//! A bag is a directory that rosbag2 understands: MCAP files of profile `ros2` and a
//! `metadata.yaml`. This crate knows message types only by their schema texts.

pub mod cli;
mod error;
mod file;
mod losses;
pub mod metadata;
pub mod ops;
pub mod play;
mod preset;
pub mod qos;
mod reader;
pub mod record;
mod ros_qos;
pub mod schema;
pub mod tap;
mod topic;
mod writer;

pub use error::{BagError, Result, chain};
pub use file::attachment::Attachment;
pub use file::chunk::Compression;
pub use file::source::ReadOptions;
pub use losses::{Losses, RECORDING};
pub use reader::{Bag, BagFile, BagTopic, Filter, Message, Messages, TopicPattern};
pub use topic::{Definition, Topic};
pub use writer::{BagOptions, BagSummary, BagWriter, Counter, TopicId};
