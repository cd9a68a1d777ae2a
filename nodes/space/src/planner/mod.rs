//! The planner node: which strip next, and how long a transition before it.

pub mod logic;
mod messages;
pub mod wiring;
