//! The nodes that fly: spacecraft, guidance and planner.
//!
//! A node is `logic.rs`, which knows no ROS, `wiring.rs`, which knows its topics, and `messages.rs` between them.
#![expect(non_snake_case, reason = "frame letters")]

pub mod guidance;
pub mod planner;
pub mod spacecraft;
