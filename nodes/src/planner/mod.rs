//! The planner node: which strip next, and how long a transition before it.

pub mod logic;
pub mod wiring;
