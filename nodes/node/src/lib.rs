//! What the nodes of a mission share: how one starts, its stamps, and the messages that several of them read or write.

pub mod error;
pub mod fault_orders;
pub mod health;
pub mod lifecycle;
pub mod messages;
pub mod node;
pub mod orders;
mod orders_heard;
pub mod out;
pub mod patient;
pub mod program;
pub mod stamp;
