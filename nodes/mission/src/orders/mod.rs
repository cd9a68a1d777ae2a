//! What is asked for: orders, the files that they come in, and what else operators ask.

pub mod action;
pub mod feature;
pub mod feature_strips;
pub mod formats;
pub mod found;
pub mod geojson;
pub mod import;
pub mod order;
pub mod rows;
pub mod short_lines;
mod template;
