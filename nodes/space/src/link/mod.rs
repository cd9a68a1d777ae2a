//! The radio between ground and satellite.

pub mod logic;
#[cfg(test)]
mod logic_tests;
pub mod messages;
pub mod wiring;
