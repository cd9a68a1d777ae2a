//! What is asked for: the strips of a mission and where they stand, and random ones.

pub mod catalogue;
pub mod scenario;
