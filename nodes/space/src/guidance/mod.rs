//! The guidance node: it flies the active task.

pub mod logic;
#[cfg(test)]
mod logic_tests;
mod messages;
mod radio;
pub mod wiring;
