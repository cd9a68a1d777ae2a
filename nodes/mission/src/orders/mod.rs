//! What is asked for: orders, the files that they come in, and what else operators ask.

pub mod action;
pub mod geojson;
pub mod order;
