//! What lies outside the satellite: orbit, Earth and its frames, Sun and shadow, magnetic field, strips and when they can
//! be seen, stations and contacts.

pub mod contacts;
pub mod frames;
pub mod magnetic;
pub mod orbit;
pub mod stations;
pub mod strip;
pub mod sun;
pub mod turn;
pub mod windows;
