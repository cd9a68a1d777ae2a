//! The nodes that fly: spacecraft, guidance, planner and, in missions with a radio, the on-board catalogue and the radio.
//!
//! A node is `logic.rs`, which knows no ROS, `wiring.rs`, which knows its topics, and `messages.rs` between them.
#![expect(non_snake_case, reason = "frame letters")]

pub mod catalogue;
pub mod guidance;
mod journal;
pub mod link;
pub mod planner;
pub mod spacecraft;
