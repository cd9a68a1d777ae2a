//! Requests from Python's dictionaries, and a catalogue as columns.

use numpy::{PyArray2, PyArrayMethods, ToPyArray};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use pythonize::depythonize;
use swath_sim::config::SimConfig;
use swath_sim::requests::catalogue::{Catalogue, StripState};
use swath_sim::world::frames::latitude_longitude_deg;
use swath_sim::world::strip::{StripId, StripRequest};

/// Requests from a list of dictionaries, each of them one that the satellite may be asked for.
///
/// # Errors
/// One that is none or that is refused, by its index.
pub fn read(list: &Bound<'_, PyAny>, config: &SimConfig) -> PyResult<Vec<StripRequest>> {
    let mut requests = Vec::new();
    for (index, strip) in list.try_iter()?.enumerate() {
        let wrong = |why: String| PyValueError::new_err(format!("strip {index}: {why}"));
        let request: StripRequest = depythonize(&strip?).map_err(|error| wrong(error.to_string()))?;
        request.to_strip(&config.requests, config.earth.radius_m).map_err(|error| wrong(error.to_string()))?;
        requests.push(request);
    }
    Ok(requests)
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
