//! Nodes that meet over DDS: topics, services, parameters, names, and others that do not behave.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

mod common;
mod guests;
mod hostile;
mod nodes;
mod rosout;
mod stopped;
#[allow(dead_code, reason = "others use more of it")]
mod stranger;
