//! The request manager: it accepts or refuses strips and offers the upcoming ones.

pub mod logic;
pub mod wiring;
