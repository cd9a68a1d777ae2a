//! The nodes of Swath: spacecraft, guidance, request manager and planner, the launcher, and missions in one process.
//!
//! A node is two files: `logic.rs`, which knows no ROS, and `wiring.rs`, which knows nothing else.
#![expect(non_snake_case, reason = "frame letters")]

pub mod approval;
pub mod bag;
pub mod from_msg;
pub mod guidance;
pub mod in_process;
pub mod launch;
pub mod mission;
pub mod node;
pub mod operate;
pub mod planner;
pub mod planners;
pub mod record;
pub mod requests;
pub mod requests_file;
pub mod spacecraft;
pub mod time_text;
pub mod to_msg;
