//! What lies outside the satellite: orbit, Earth and its frames, strips, and when they can be seen.

pub mod frames;
pub mod orbit;
pub mod strip;
pub mod turn;
pub mod windows;
