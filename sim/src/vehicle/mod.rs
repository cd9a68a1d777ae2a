//! The satellite: its body and wheels, its control and guidance, its errors, its power, data and momentum, and the closed
//! loop.

pub mod control;
pub mod dynamics;
pub mod errors;
pub mod executive;
pub mod faults;
pub mod flight;
pub mod guidance;
pub mod health;
pub mod initial;
pub mod model;
pub mod mrp;
pub mod resources;
pub mod spacecraft;
pub mod wheels;
