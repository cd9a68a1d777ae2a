//! The spacecraft node: dynamics, wheels, orbit and the clock.

pub mod journal;
pub mod logic;
mod telemetry;
pub mod wiring;
