//! What people bring, lines and areas on the sphere, becomes strips.

pub mod cover;
pub mod follow;
pub mod sphere;
