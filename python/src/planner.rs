//! Planners: those of `sim` by name, and any Python object that decides.

use std::sync::Arc;

use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use swath_sim::planner::{Decision, DecisionContext, Planner, PlannerError, PlannerSpec};
use swath_sim::vehicle::model::Model;

use crate::context::{Context, Image, Serve, Wait};
use crate::errors::refused;

/// A planner that is asked for.
pub enum Asked {
    /// One of `sim`.
    Named(PlannerSpec),
    /// An object of Python's: called, or its `decide` is.
    Object(Py<PyAny>),
}

impl Asked {
    /// What a value asks for: a text names a planner, anything else decides itself.
    ///
    /// # Errors
    /// A name that is no planner's or that needs a policy; an object that cannot be called.
    pub fn of(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        if let Ok(name) = value.extract::<String>() {
            let spec: PlannerSpec = name.parse().map_err(|error| refused(&error))?;
            if spec.hand_written(0).is_none() {
                let text = format!(
                    "`{name}` is a trained policy, which this package does not know: expected lookahead[:TICKS], \
                     beam[:WIDTHxDEPTH], frugal, beam+handmade:SHARE, repair[:TICKS] or aspen, each also with -annealing or -squeaky, \
                     heuristic:SECONDS, random, or an object that decides"
                );
                return Err(PyValueError::new_err(text));
            }
            return Ok(Self::Named(spec));
        }
        let decide = if value.hasattr("decide")? { value.getattr("decide")? } else { value.clone() };
        if !decide.is_callable() {
            let kind = value.get_type().name()?;
            return Err(PyTypeError::new_err(format!(
                "a {kind} is no planner: it has no `decide` and cannot be called"
            )));
        }
        Ok(Self::Object(decide.unbind()))
    }

    /// Whether it is Python that decides.
    pub fn is_python(&self) -> bool {
        matches!(self, Self::Object(_))
    }

    /// The planner for a mission of this seed.
    ///
    /// # Errors
    /// A planner that `sim` does not have.
    pub fn make(&self, seed: u64, model: &Arc<Model>) -> Result<Pilot, PlannerError> {
        match self {
            Self::Named(spec) => {
                let planner = spec.hand_written(seed);
                planner.map(Pilot::Own).ok_or_else(|| PlannerError::Policy(format!("`{spec}` is a trained policy")))
            }
            Self::Object(decide) => {
                let decide = Python::attach(|py| decide.clone_ref(py));
                Ok(Pilot::Python(PythonPlanner { decide, model: model.clone(), raised: None }))
            }
        }
    }
}

/// A planner that flies a mission.
pub enum Pilot {
    /// One of `sim`.
    Own(Box<dyn Planner + Send>),
    /// Python's.
    Python(PythonPlanner),
}

impl Pilot {
    /// The planner.
    pub fn planner(&mut self) -> &mut dyn Planner {
        match self {
            Self::Own(planner) => planner.as_mut(),
            Self::Python(planner) => planner,
        }
    }

    /// What Python raised, if that is why it decided nothing; else the planner's error.
    pub fn exception(self, error: &PlannerError) -> PyErr {
        let raised = match self {
            Self::Python(planner) => planner.raised,
            Self::Own(_) => None,
        };
        raised.unwrap_or_else(|| refused(error))
    }
}

/// A planner that asks Python.
pub struct PythonPlanner {
    decide: Py<PyAny>,
    model: Arc<Model>,
    raised: Option<PyErr>,
}

impl Planner for PythonPlanner {
    fn name(&self) -> String {
        "python".to_owned()
    }

    fn decide(&mut self, context: &DecisionContext<'_>) -> Result<Decision, PlannerError> {
        let seen = Context::new(context, self.model.clone());
        let decided = Python::attach(|py| {
            let decided = self.decide.call1(py, (seen,))?;
            decision(decided.bind(py), &self.model)
        });
        decided.map_err(|error| {
            let text = error.to_string();
            self.raised = Some(error);
            PlannerError::Policy(text)
        })
    }
}

/// Longest time that may be waited at once [s].
const WAIT_MAX_S: f64 = 86_400.0;

fn decision(decided: &Bound<'_, PyAny>, model: &Model) -> PyResult<Decision> {
    let period = model.period;
    if let Ok(image) = decided.cast::<Image>() {
        let (candidate, t_pre_s) = image.get().parts();
        let max_s = model.config.planning.t_pre_max_s;
        check("t_pre_s", t_pre_s, 0.0, max_s)?;
        return Ok(Decision::Image { candidate, t_pre: period.ticks_ceil(t_pre_s).min(model.t_pre_max()) });
    }
    if let Ok(wait) = decided.cast::<Wait>() {
        let seconds = wait.get().seconds();
        check("duration_s", seconds, period.seconds(), WAIT_MAX_S)?;
        return Ok(Decision::Wait { ticks: period.ticks_ceil(seconds) });
    }
    if let Ok(serve) = decided.cast::<Serve>() {
        let (duty, seconds) = serve.get().parts()?;
        check("duration_s", seconds, period.seconds(), WAIT_MAX_S)?;
        return Ok(Decision::Serve { duty, ticks: period.ticks_ceil(seconds) });
    }
    let kind = decided.get_type().name()?;
    Err(PyTypeError::new_err(format!("the planner decided a {kind}, not swath.Image, swath.Wait or swath.Serve")))
}

fn check(name: &str, value: f64, least: f64, most: f64) -> PyResult<()> {
    if (least..=most).contains(&value) {
        return Ok(());
    }
    Err(PyValueError::new_err(format!("{name} is {value}, outside {least} to {most}")))
}
