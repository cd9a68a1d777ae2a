//! The guidance node: it flies the active task.

pub mod logic;
pub mod wiring;
