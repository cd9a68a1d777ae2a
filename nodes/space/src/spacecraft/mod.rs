//! The spacecraft node: dynamics, wheels, orbit and the clock.

pub mod logic;
mod orders;
mod telemetry;
pub mod wiring;
