//! Bags of ROS 2 messages: records, plays and inspects topic + time + CDR bytes over MCAP.
//!
//! A bag is a directory that rosbag2 understands: MCAP files of profile `ros2` and a
//! `metadata.yaml`. This crate knows message types only by their schema texts.
//!
//! ```
//! use swath_bags::{Bag, BagOptions, BagWriter, Filter, Topic, TopicPattern, qos::QosProfile};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let folder = tempfile::tempdir()?;
//! # let dir = folder.path().join("bag");
//! let bag = BagWriter::create(&dir, BagOptions::default())?;
//! let qos = vec![QosProfile::reliable(10)];
//! let topic = bag.add_topic(&Topic::new("/n", "std_msgs/msg/UInt64", "uint64 data\n", "", qos)?)?;
//! for n in 0..3u64 {
//!     let time = n * 500_000_000;
//!     let cdr = [&[0, 1, 0, 0][..], &n.to_le_bytes()].concat();
//!     bag.write(topic, time, time, &cdr)?;
//! }
//! assert_eq!(bag.close()?.messages, 3);
//!
//! let bag = Bag::open(&dir)?;
//! let topics = TopicPattern::new(&["/n".to_owned()], None, None)?;
//! let mut messages = bag.messages(&Filter { topics, from: 500_000_000, ..Filter::default() })?;
//! let first = messages.next()?.ok_or("no message")?;
//! assert_eq!((first.log_time, first.data[4]), (500_000_000, 1));
//! # Ok(())
//! # }
//! ```

pub mod cli;
mod error;
mod file;
mod losses;
pub mod metadata;
pub mod ops;
mod out;
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
pub use out::say;
pub use reader::{Bag, BagFile, BagTopic, Filter, Message, Messages, TopicPattern};
pub use topic::{Definition, Topic};
pub use writer::{BagOptions, BagSummary, BagWriter, Counter, TopicId};
