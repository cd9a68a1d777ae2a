//! The commands of `swath-train`.

pub mod train;
