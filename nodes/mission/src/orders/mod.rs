//! Orders: what is asked for, and the files that it comes in.

pub mod action;
pub mod geojson;
