//! The native part of the Python package `swath`: strip imaging for Gymnasium, planners, missions, strips in GeoJSON.
//!
//! Everything here turns Python's values into those of `swath-sim` and back; the simulation itself is that crate's.
#![expect(non_snake_case, reason = "frame letters")]

mod bounds;
mod context;
mod episodes;
mod errors;
mod flight;
mod lane;
mod planner;
mod records;
mod requests;
mod settings;
mod strips;

/// The module `swath._swath`.
#[pyo3::pymodule]
mod _swath {
    #[pymodule_export]
    use super::context::{Context, Image, Serve, Wait};
    #[pymodule_export]
    use super::episodes::Episodes;
    #[pymodule_export]
    use super::flight::{evaluate, fly};
    #[pymodule_export]
    use super::settings::Settings;
    #[pymodule_export]
    use super::strips::{feature_collection, random_strips, read_strips};
}
