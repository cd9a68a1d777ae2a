//! Strips from files of all formats that missions read, to GeoJSON, and random ones.

use std::ffi::CString;
use std::path::PathBuf;

use pyo3::exceptions::{PyUserWarning, PyValueError};
use pyo3::prelude::*;
use pythonize::pythonize;
use serde_json::json;
use swath_mission::orders::feature_strips::Cutting;
use swath_mission::orders::geojson::feature_of;
use swath_mission::orders::import::import;
use swath_mission::orders::order::Order;
use swath_sim::rng;
use swath_sim::world::strip::StripRequest;

use crate::errors::refused;
use crate::requests;
use crate::settings::Settings;

/// Reads strips from a file: lines are followed and areas are covered by strips. Conditions of an order that episodes
/// do not know are left out with a warning.
#[pyfunction]
pub fn read_strips<'py>(py: Python<'py>, path: PathBuf, settings: &Settings) -> PyResult<Bound<'py, PyAny>> {
    let config = &settings.model.config;
    let import = import(&path, &Cutting::of(config)).map_err(|error| refused(&error))?;
    let mut faults: Vec<String> = import.refused.iter().map(ToString::to_string).collect();
    for order in &import.orders {
        if let Err(error) = order.request.to_strip(&config.requests, config.earth.radius_m) {
            faults.push(format!("requests {}, {}: {error}", path.display(), order.name));
        }
    }
    if !faults.is_empty() {
        return Err(PyValueError::new_err(faults.join("\n")));
    }
    let conditional = import.orders.iter().filter(|order| has_conditions(order)).count();
    if conditional > 0 {
        let text = format!(
            "requests {}: {conditional} strips have conditions (valid_from, valid_until, hold_for_approval, \
             max_attempts) that episodes do not know",
            path.display()
        );
        PyErr::warn(py, &py.get_type::<PyUserWarning>(), &CString::new(text)?, 1)?;
    }
    let strips: Vec<StripRequest> = import.orders.into_iter().map(|it| it.request).collect();
    pythonize(py, &strips).map_err(|error| refused(&error))
}

fn has_conditions(order: &Order) -> bool {
    order.validity_ns() != (0, u64::MAX) || order.hold_for_approval || order.max_attempts > 0
}

/// Strips as a GeoJSON text that [`read_strips`] gives back as they are.
#[pyfunction]
pub fn feature_collection(strips: &Bound<'_, PyAny>, settings: &Settings) -> PyResult<String> {
    let strips = requests::read(strips, &settings.model.config)?;
    let features = strips.into_iter().enumerate().map(|(index, request)| {
        let name = format!("strip-{}", index + 1);
        feature_of(&Order::new(name.clone(), name, request))
    });
    Ok(json!({ "type": "FeatureCollection", "features": features.collect::<Vec<_>>() }).to_string())
}

/// The random strips of a seed's episode.
#[pyfunction]
pub fn random_strips<'py>(py: Python<'py>, settings: &Settings, seed: u64) -> PyResult<Bound<'py, PyAny>> {
    let scenario = &settings.episode().scenario;
    let mut rng = rng::stream(seed, rng::CATALOGUE);
    let count = scenario.draw_count(&mut rng);
    let strips = scenario.generate(&mut rng, count, settings.model.config.earth.radius_m);
    pythonize(py, &strips).map_err(|error| refused(&error))
}
