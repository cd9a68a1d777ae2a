//! What episodes are made of: satellite, requests, observation, errors of the plant; from keywords and TOML.

use std::path::PathBuf;
use std::sync::Arc;

use numpy::{PyArray1, ToPyArray};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pythonize::{depythonize, pythonize};
use serde::{Deserialize, Serialize};
use swath_sim::config::SimConfig;
use swath_sim::error::SimError;
use swath_sim::learn::episode::{Env, EpisodeConfig};
use swath_sim::learn::observation::ObservationSet;
use swath_sim::vehicle::errors::PlantErrors;
use swath_sim::vehicle::model::Model;
use swath_sim::world::strip::StripRequest;
use toml::{Table, Value};

use crate::bounds;
use crate::errors::refused;
use crate::requests;

/// The settings by the names that they have in a run of `swath-train`, and errors of the plant.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Keys {
    observation: ObservationSet,
    episode: EpisodeConfig,
    simulation: SimConfig,
    plant: PlantErrors,
}

/// Settings that were checked, with what follows from them.
#[pyclass(frozen, module = "swath._swath", skip_from_py_object)]
#[derive(Clone, Debug)]
pub struct Settings {
    pub(crate) keys: Keys,
    pub(crate) model: Arc<Model>,
    /// Strips of one's own instead of random ones.
    pub(crate) strips: Option<Arc<[StripRequest]>>,
}

#[pymethods]
impl Settings {
    /// Settings of a file, changed by `keys`, with `strips` instead of random requests.
    #[new]
    #[pyo3(signature = (keys=None, file=None, strips=None))]
    fn new(
        keys: Option<&Bound<'_, PyAny>>,
        file: Option<PathBuf>,
        strips: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let mut table = file.map_or_else(|| Ok(Table::new()), read)?;
        if let Some(keys) = keys {
            let keys = depythonize::<Table>(keys).map_err(|error| refused(&error))?;
            merge(&mut table, keys);
        }
        name_plant(&mut table)?;
        let keys: Keys = Value::Table(table).try_into().map_err(|error| refused(&error))?;
        keys.episode.validate().map_err(|error| refused(&error))?;
        let model = Arc::new(Model::new(keys.simulation.clone()).map_err(|error| refused(&error))?);
        keys.plant.plant(&model).map_err(|error| refused(&error))?;
        let strips = strips.map(|list| requests::read(list, &model.config)).transpose()?;
        Ok(Self { keys, model, strips: strips.map(Arc::from) })
    }

    /// All settings, those that were left out with their defaults.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        pythonize(py, &self.keys).map_err(|error| refused(&error))
    }

    /// Number N of strips offered at a decision.
    #[getter]
    fn candidates(&self) -> usize {
        self.model.config.planning.candidates
    }

    /// Features of a strip.
    #[getter]
    fn features(&self) -> usize {
        self.keys.observation.features()
    }

    /// Longest transition [s].
    #[getter]
    fn t_pre_max_s(&self) -> f64 {
        self.model.config.planning.t_pre_max_s
    }

    /// One orbit [s].
    #[getter]
    fn orbit_s(&self) -> f64 {
        self.model.orbit_period_s()
    }

    /// Length of a control tick [s].
    #[getter]
    fn tick_s(&self) -> f64 {
        self.model.period.seconds()
    }

    /// Least and greatest value of each feature of a strip.
    fn bounds<'py>(&self, py: Python<'py>) -> (Bound<'py, PyArray1<f32>>, Bound<'py, PyArray1<f32>>) {
        let (low, high) = bounds::of(&self.model, &self.keys.episode, &self.keys.plant, self.keys.observation);
        (low.to_pyarray(py), high.to_pyarray(py))
    }
}

impl Settings {
    /// Which features a strip has.
    pub fn observation(&self) -> ObservationSet {
        self.keys.observation
    }

    /// Length and requests of an episode.
    pub fn episode(&self) -> &EpisodeConfig {
        &self.keys.episode
    }

    /// The simulation at the beginning of an episode.
    ///
    /// # Errors
    /// Errors of the plant that are out of range.
    pub fn env(&self, seed: u64) -> Result<Env, SimError> {
        let (model, episode) = (self.model.clone(), &self.keys.episode);
        let mut env = match &self.strips {
            Some(strips) => Env::with_strips(model, episode.orbits, strips, seed),
            None => Env::episode(model, episode, seed),
        };
        if self.keys.plant != PlantErrors::default() {
            env.differ(&self.keys.plant, seed)?;
        }
        Ok(env)
    }

    /// Strips that an episode asks for, whether they can be reached or not.
    pub fn asked(&self, seed: u64) -> usize {
        self.strips.as_ref().map_or_else(|| self.keys.episode.scenario.count_of(seed), |strips| strips.len())
    }
}

/// The settings in a TOML file, which may be a run of `swath-train`.
fn read(path: PathBuf) -> PyResult<Table> {
    let wrong = |why: String| PyValueError::new_err(format!("settings {}: {why}", path.display()));
    let text = std::fs::read_to_string(&path).map_err(|error| wrong(error.to_string()))?;
    let mut table: Table = text.parse().map_err(|error: toml::de::Error| wrong(error.to_string()))?;
    let Some(environment) = table.remove("environment") else { return Ok(table) };
    let Value::Table(mut environment) = environment else { return Err(wrong("`environment` is no table".into())) };
    match environment.remove("kind") {
        Some(Value::String(kind)) if kind == "strips" => Ok(environment),
        kind => Err(wrong(format!("the kind of `environment` is {kind:?}, not \"strips\""))),
    }
}

/// Puts what `over` says over what `table` says, key by key.
fn merge(table: &mut Table, over: Table) {
    for (key, value) in over {
        match (table.get_mut(&key), value) {
            (Some(Value::Table(below)), Value::Table(above)) => merge(below, above),
            (_, value) => _ = table.insert(key, value),
        }
    }
}

/// Errors of the plant may be given by name, such as `torque-10%,noise`.
fn name_plant(table: &mut Table) -> PyResult<()> {
    let Some(Value::String(name)) = table.get("plant") else { return Ok(()) };
    let errors: PlantErrors = name.parse().map_err(|error| refused(&error))?;
    let value = Value::try_from(errors).map_err(|error| refused(&error))?;
    table.insert("plant".to_owned(), value);
    Ok(())
}
