//! What a decision rests on, and what can be decided.

use std::sync::Arc;

use numpy::{PyArray1, PyArray2, PyArrayMethods, ToPyArray};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use swath_sim::learn::observation::{ObservationSet, observe};
use swath_sim::planner::DecisionContext;
use swath_sim::requests::catalogue::Candidate;
use swath_sim::task::{Duty, TaskRecord};
use swath_sim::time::Tick;
use swath_sim::vehicle::flight::Situation;
use swath_sim::vehicle::model::Model;
use swath_sim::world::frames::{earth_to_inertial, latitude_longitude_deg};
use swath_sim::world::orbit::Orbit;

use crate::errors::refused;
use crate::records::{resource_row, task_row};

/// Decides to image a strip.
#[pyclass(frozen, eq, get_all, module = "swath._swath", skip_from_py_object)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Image {
    /// Index into the candidates.
    candidate: usize,
    /// Transition time T_pre [s], rounded up to whole ticks.
    t_pre_s: f64,
}

#[pymethods]
impl Image {
    #[new]
    fn new(candidate: usize, t_pre_s: f64) -> Self {
        Self { candidate, t_pre_s }
    }

    fn __repr__(&self) -> String {
        format!("Image(candidate={}, t_pre_s={:?})", self.candidate, self.t_pre_s)
    }
}

impl Image {
    /// Index into the candidates, and transition time [s].
    pub fn parts(&self) -> (usize, f64) {
        (self.candidate, self.t_pre_s)
    }
}

/// Decides to hold the attitude.
#[pyclass(frozen, eq, get_all, module = "swath._swath", skip_from_py_object)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wait {
    /// For how long [s], rounded up to whole ticks.
    duration_s: f64,
}

#[pymethods]
impl Wait {
    #[new]
    fn new(duration_s: f64) -> Self {
        Self { duration_s }
    }

    fn __repr__(&self) -> String {
        format!("Wait(duration_s={:?})", self.duration_s)
    }
}

/// Decides to see to power, data or momentum, where those have bounds.
#[pyclass(frozen, eq, get_all, module = "swath._swath", skip_from_py_object)]
#[derive(Clone, Debug, PartialEq)]
pub struct Serve {
    /// `charge`, `downlink` or `desaturate`.
    duty: String,
    /// For how long [s], rounded up to whole ticks.
    duration_s: f64,
}

#[pymethods]
impl Serve {
    #[new]
    fn new(duty: String, duration_s: f64) -> PyResult<Self> {
        duty_of(&duty)?;
        Ok(Self { duty, duration_s })
    }

    fn __repr__(&self) -> String {
        format!("Serve(duty='{}', duration_s={:?})", self.duty, self.duration_s)
    }
}

impl Serve {
    /// What is done, and for how long [s].
    ///
    /// # Errors
    /// A word that is no duty.
    pub fn parts(&self) -> PyResult<(Duty, f64)> {
        Ok((duty_of(&self.duty)?, self.duration_s))
    }
}

fn duty_of(name: &str) -> PyResult<Duty> {
    toml::Value::String(name.to_owned()).try_into().map_err(|error: toml::de::Error| refused(&error))
}

impl Wait {
    /// For how long [s].
    pub fn seconds(&self) -> f64 {
        self.duration_s
    }
}

/// Features of N strips, and which of the N there are.
type Seen<'py> = (Bound<'py, PyArray2<f32>>, Bound<'py, PyArray1<bool>>);

/// What a decision rests on, as it stood when it was asked for.
#[pyclass(frozen, module = "swath._swath")]
pub struct Context {
    task: u64,
    situation: Situation,
    candidates: Vec<Candidate>,
    previous: Option<TaskRecord>,
    model: Arc<Model>,
}

impl Context {
    /// A copy of a context.
    pub fn new(context: &DecisionContext<'_>, model: Arc<Model>) -> Self {
        Self {
            task: context.task,
            situation: *context.situation,
            candidates: context.candidates.to_vec(),
            previous: context.previous.cloned(),
            model,
        }
    }

    fn column<'py>(&self, py: Python<'py>, of: impl Fn(&Candidate) -> f64) -> Bound<'py, PyArray1<f64>> {
        self.candidates.iter().map(of).collect::<Vec<_>>().to_pyarray(py)
    }

    fn time_s(&self, tick: Tick) -> f64 {
        self.model.period.time_s(tick)
    }
}

#[pymethods]
impl Context {
    /// Number of the task to decide, from 0.
    #[getter]
    fn task(&self) -> u64 {
        self.task
    }

    /// Simulated time since the epoch [s].
    #[getter]
    fn now_s(&self) -> f64 {
        self.time_s(self.situation.now)
    }

    /// Longest transition [s].
    #[getter]
    fn t_pre_max_s(&self) -> f64 {
        self.model.config.planning.t_pre_max_s
    }

    /// Number of candidates: the next strips by closing time of their windows.
    fn __len__(&self) -> usize {
        self.candidates.len()
    }

    /// Identity of each candidate in the mission.
    #[getter]
    fn strip<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u64>> {
        self.candidates.iter().map(|it| it.id.0).collect::<Vec<_>>().to_pyarray(py)
    }

    /// Priority of each candidate, 0 to 1.
    #[getter]
    fn priority<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.column(py, |it| it.strip.priority)
    }

    /// Time that imaging each candidate takes [s].
    #[getter]
    fn t_acq_s<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.column(py, |it| self.model.period.duration_s(it.t_acq))
    }

    /// Simulated time at which imaging each candidate may begin at the earliest [s].
    #[getter]
    fn window_open_s<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.column(py, |it| self.time_s(it.window.open))
    }

    /// Simulated time at which imaging each candidate may begin at the latest [s].
    #[getter]
    fn window_close_s<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.column(py, |it| self.time_s(it.window.close))
    }

    /// Position of the satellite in the inertial frame [m].
    #[getter]
    fn r_BN_N(&self) -> [f64; 3] {
        self.situation.r_BN_N.into()
    }

    /// Velocity of the satellite in the inertial frame [m/s].
    #[getter]
    fn v_BN_N(&self) -> [f64; 3] {
        self.situation.v_BN_N.into()
    }

    /// Attitude as modified Rodrigues parameters.
    #[getter]
    fn sigma_BN(&self) -> [f64; 3] {
        self.situation.body.sigma_BN.into()
    }

    /// Body rate in the body frame [rad/s].
    #[getter]
    fn omega_BN_B(&self) -> [f64; 3] {
        self.situation.body.omega_BN_B.into()
    }

    /// Speed of each wheel [rad/s].
    #[getter]
    fn wheel_speed_rad_s(&self) -> [f64; 3] {
        self.situation.body.wheel_speed.into()
    }

    /// How power and data stand; nothing where they have no bounds.
    #[getter]
    fn resources<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        self.situation.resources.map(|state| resource_row(py, &state, self.model.period)).transpose()
    }

    /// How the task went that ended here; none at the first decision.
    #[getter]
    fn previous<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        self.previous.as_ref().map(|record| task_row(py, record, self.model.period)).transpose()
    }

    /// What a learned policy sees: features of N strips, and which of the N there are.
    #[pyo3(signature = (observation="table1"))]
    fn observe<'py>(&self, py: Python<'py>, observation: &str) -> PyResult<Seen<'py>> {
        let set: ObservationSet =
            toml::Value::String(observation.to_owned()).try_into().map_err(|error: toml::de::Error| refused(&error))?;
        let slots = self.model.config.planning.candidates;
        let features = PyArray2::<f32>::zeros(py, [slots, set.features()], false);
        let mut mask = vec![false; slots];
        let context = DecisionContext {
            task: self.task,
            situation: &self.situation,
            candidates: &self.candidates,
            previous: self.previous.as_ref(),
            model: &self.model,
        };
        observe(&context, set, features.readwrite().as_slice_mut()?, &mut mask);
        Ok((features, mask.to_pyarray(py)))
    }

    /// Points below the satellite as rows of latitude and longitude [deg], at times relative to now [s].
    fn ground_track<'py>(&self, py: Python<'py>, times_s: Vec<f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (situation, model) = (&self.situation, &self.model);
        let mut orbit = Orbit::through(&situation.r_BN_N, &situation.v_BN_N, situation.now, model.period);
        let mut earth = model.earth.clone();
        let points = PyArray2::<f64>::zeros(py, [times_s.len(), 2], false);
        let mut rows = points.readwrite();
        for (row, time_s) in rows.as_slice_mut()?.chunks_exact_mut(2).zip(times_s) {
            let ticks = time_s / model.period.seconds() + situation.now.0 as f64;
            // Times before the epoch are those at the epoch.
            let tick = Tick(ticks.max(0.0).round() as u64);
            let (c, s) = earth.cos_sin(tick);
            let r_BE_E = earth_to_inertial((c, -s), &orbit.position(tick));
            (row[0], row[1]) = latitude_longitude_deg(&r_BE_E);
        }
        drop(rows);
        Ok(points)
    }
}
