//! What people bring, lines and areas on the sphere, becomes strips.

pub mod cover_area;
pub mod cut_line;
pub mod sphere;
