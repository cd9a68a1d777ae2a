//! The tests of the interface package: its generator, and what it generates.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

// The generator's own files, which `build.rs` is made of.
#[path = "../../build/describe.rs"]
mod describe;
#[path = "../../build/emit.rs"]
mod emit;
#[path = "../../build/model.rs"]
mod model;
#[path = "../../build/parse.rs"]
mod parse;

mod generator;
mod interfaces;

use swath_msgs::definition;
