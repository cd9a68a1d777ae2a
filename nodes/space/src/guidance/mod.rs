//! The guidance node: it flies the active task.

pub mod logic;
mod messages;
pub mod wiring;
