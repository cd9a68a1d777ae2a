//! ROS 2 conventions on top of RustDDS: nodes, names, parameters, quality of service, the node graph, topics and services.
//!
//! A process is one [`Node`]. Its endpoints come from the table in [`graph`]; a thread of its own
//! takes from its subscriptions until they have nothing and then waits:
//!
//! ```no_run
//! use std::time::Duration;
//! use swath_ros::{Node, RosArgs, Shutdown, graph};
//!
//! fn main() -> Result<(), swath_ros::RosError> {
//!     let (_own_words, args) = RosArgs::split(std::env::args())?;
//!     let node = Node::start(graph::GUIDANCE, &args)?;
//!     let shutdown = Shutdown::on_signals(node.signal())?;
//!     let states = node.subscription(&graph::SPACECRAFT_STATE)?;
//!     let torques = node.publisher(&graph::WHEEL_TORQUE)?;
//!     node.parameters().check_given()?;
//!     node.wait_for_peers(&[graph::SPACECRAFT], Duration::from_secs(10))?;
//!     while !shutdown.asked() {
//!         while let Some(state) = states.take()? {
//!             torques.publish(&swath_msgs::swath_msgs::WheelTorque {
//!                 tick: state.tick,
//!                 ..Default::default()
//!             })?;
//!         }
//!         node.wait(Duration::from_millis(100))?;
//!     }
//!     Ok(())
//! }
//! ```
//!
//! RustDDS is used directly where `ros2-client` has no way: endpoints of raw CDR bytes that show
//! in the ROS graph, parameter services with the mapping of rmw_cyclonedds, and waiting without
//! an asynchronous executor.

mod background;
mod bpf;
mod cdr;
mod cli;
mod clock;
mod dds;
mod discovered;
mod drops;
mod endpoint;
mod entities;
mod environment;
mod error;
pub mod graph;
mod guests;
mod health;
pub mod lifecycle;
mod logging;
mod managed;
mod members;
mod memory;
mod message;
mod minder;
mod names;
mod node;
mod node_services;
mod notices;
mod params;
mod pulse;
pub mod qos;
mod replies;
mod roster;
mod rtps;
mod screen;
pub mod segment;
mod service;
mod shutdown;
mod signal;
mod slot;
mod topic;
mod type_description;
mod value;

pub use cdr::{Cdr, HEADER_LENGTH};
pub use cli::RosArgs;
pub use clock::{SimClock, stamp};
pub use discovered::RemoteWriter;
pub use drops::Dropping;
pub use endpoint::{Input, RawPublisher, RawSample, RawSubscription, SampleInfo};
pub use environment::{Environment, Mapping};
pub use error::RosError;
pub use managed::Managed;
pub use message::{decode, encode};
pub use names::Names;
pub use node::Node;
pub use notices::{Notice, Trouble};
pub use params::{Parameters, Spec};
pub use pulse::{SIGN_EVERY, Sign};
pub use ros2_client::Gid;
pub use service::{Client, RequestId, Server};
pub use shutdown::Shutdown;
pub use signal::Signal;
pub use topic::{Publisher, Sample, Subscription};
pub use value::{Typed, Value};
