//! Strips: dictionaries of Python's, GeoJSON files, and the catalogue as a table.

use std::path::PathBuf;

use numpy::{PyArray2, PyArrayMethods, ToPyArray};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use pythonize::{depythonize, pythonize};
use serde_json::json;
use swath_mission::orders::geojson::{Lengths, NamedRequest, feature_of, read};
use swath_sim::config::SimConfig;
use swath_sim::requests::catalogue::{Catalogue, StripState};
use swath_sim::rng;
use swath_sim::world::frames::latitude_longitude_deg;
use swath_sim::world::strip::{StripId, StripRequest};

use crate::errors::refused;
use crate::settings::Settings;

/// Requests from a list of dictionaries, each of them one that the satellite may be asked for.
///
/// # Errors
/// One that is none or that is refused, by its index.
pub fn requests(list: &Bound<'_, PyAny>, config: &SimConfig) -> PyResult<Vec<StripRequest>> {
    let mut requests = Vec::new();
    for (index, strip) in list.try_iter()?.enumerate() {
        let wrong = |why: String| PyValueError::new_err(format!("strip {index}: {why}"));
        let request: StripRequest = depythonize(&strip?).map_err(|error| wrong(error.to_string()))?;
        request.to_strip(&config.requests, config.earth.radius_m).map_err(|error| wrong(error.to_string()))?;
        requests.push(request);
    }
    Ok(requests)
}

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
    let strips = requests(strips, &settings.model.config)?;
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

/// A catalogue as columns.
pub fn table<'py>(py: Python<'py>, catalogue: &Catalogue) -> PyResult<Bound<'py, PyDict>> {
    let entries: Vec<_> = (1..=catalogue.len() as u64).filter_map(|id| catalogue.get(StripId(id))).collect();
    let (starts, ends) =
        (PyArray2::zeros(py, [entries.len(), 2], false), PyArray2::zeros(py, [entries.len(), 2], false));
    for (array, end) in [(&starts, false), (&ends, true)] {
        let mut rows = array.readwrite();
        for (row, entry) in rows.as_slice_mut()?.chunks_exact_mut(2).zip(&entries) {
            let point_E = if end { entry.strip.end_E() } else { entry.strip.start_E };
            (row[0], row[1]) = latitude_longitude_deg(&point_E);
        }
    }
    let table = PyDict::new(py);
    table.set_item("strip", (1..=entries.len() as u64).collect::<Vec<_>>().to_pyarray(py))?;
    table.set_item("start_deg", starts)?;
    table.set_item("end_deg", ends)?;
    table.set_item("priority", entries.iter().map(|it| it.strip.priority).collect::<Vec<_>>().to_pyarray(py))?;
    table.set_item("state", entries.iter().map(|it| state_name(it.state)).collect::<Vec<_>>())?;
    Ok(table)
}

fn state_name(state: StripState) -> &'static str {
    match state {
        StripState::Pending => "pending",
        StripState::Held => "held",
        StripState::Fulfilled => "fulfilled",
        StripState::FulfilledByLink => "fulfilled_by_link",
        StripState::Removed => "removed",
        StripState::Expired => "expired",
    }
}
