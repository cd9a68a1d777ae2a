//! Strips from and to GeoJSON, and random ones.

use std::path::PathBuf;

use pyo3::prelude::*;
use pythonize::pythonize;
use serde_json::json;
use swath_mission::orders::geojson::{Lengths, NamedRequest, feature_of, read};
use swath_sim::rng;
use swath_sim::world::strip::StripRequest;

use crate::errors::refused;
use crate::requests;
use crate::settings::Settings;

/// Reads strips from a GeoJSON file; lines that are too long for one strip become several.
#[pyfunction]
pub fn read_strips<'py>(py: Python<'py>, path: PathBuf, settings: &Settings) -> PyResult<Bound<'py, PyAny>> {
    let named = read(&path, Lengths::of(&settings.model.config)).map_err(|error| refused(&error))?;
    let strips: Vec<StripRequest> = named.into_iter().map(|it| it.request).collect();
    pythonize(py, &strips).map_err(|error| refused(&error))
}

/// Strips as a GeoJSON text that [`read_strips`] gives back as they are.
#[pyfunction]
pub fn feature_collection(strips: &Bound<'_, PyAny>, settings: &Settings) -> PyResult<String> {
    let strips = requests::read(strips, &settings.model.config)?;
    let features = strips.into_iter().enumerate().map(|(index, request)| {
        let name = format!("strip-{}", index + 1);
        feature_of(&NamedRequest::new(name.clone(), name, request))
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
