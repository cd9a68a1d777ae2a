//! The on-board catalogue: what was uplinked, what of it may be imaged next, and what became of it.

pub mod logic;
#[cfg(test)]
mod logic_tests;
pub mod messages;
pub mod wiring;
