//! Whole missions flown by planners.

use pyo3::prelude::*;
use pyo3::types::PyList;
use pythonize::pythonize;
use rayon::ThreadPoolBuilder;
use rayon::prelude::*;
use swath_sim::error::SimError;
use swath_sim::learn::statistics::Score;
use swath_sim::planner::PlannerError;
use swath_sim::task::{SettledTask, Totals};

use crate::errors::{failed, refused};
use crate::planner::{Asked, Pilot};
use crate::records::task_row;
use crate::settings::Settings;

/// Flies the mission of a seed to its end: its score, and a row for each task.
#[pyfunction]
pub fn fly<'py>(
    py: Python<'py>,
    planner: &Bound<'py, PyAny>,
    settings: &Settings,
    seed: u64,
) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyList>)> {
    let asked = Asked::of(planner)?;
    let mut tasks = Vec::new();
    let score = if asked.is_python() {
        mission(&asked, settings, seed, |task| tasks.push(task.clone()))
    } else {
        py.detach(|| mission(&asked, settings, seed, |task| tasks.push(task.clone())))
    };
    let score = score.map_err(Failed::raise)?;
    let period = settings.model.period;
    let rows = tasks.iter().map(|settled| {
        let row = task_row(py, &settled.record, period)?;
        row.set_item("reward", settled.reward)?;
        Ok(row)
    });
    let rows = rows.collect::<PyResult<Vec<_>>>()?;
    Ok((pythonize(py, &score).map_err(|error| refused(&error))?, PyList::new(py, rows)?))
}

/// Flies the mission of every seed with every planner: scores by planner, then by seed. Planners of Python's fly one
/// mission after the other, all others on `threads` threads.
#[pyfunction]
pub fn evaluate<'py>(
    py: Python<'py>,
    planners: Vec<Bound<'py, PyAny>>,
    settings: &Settings,
    seeds: Vec<u64>,
    threads: usize,
) -> PyResult<Bound<'py, PyAny>> {
    let asked = planners.iter().map(Asked::of).collect::<PyResult<Vec<_>>>()?;
    let pool = ThreadPoolBuilder::new().num_threads(threads.max(1)).build().map_err(|error| failed(&error))?;
    let mut scores = Vec::new();
    for planner in &asked {
        let one = |seed: &u64| mission(planner, settings, *seed, |_| {});
        let own: Result<Vec<Score>, Failed> = if planner.is_python() {
            seeds
                .iter()
                .map(|seed| py.check_signals().map_or_else(|error| Err(Failed::Raised(error)), |()| one(seed)))
                .collect()
        } else {
            py.detach(|| pool.install(|| seeds.par_iter().map(one).collect()))
        };
        scores.push(own.map_err(Failed::raise)?);
    }
    pythonize(py, &scores).map_err(|error| refused(&error))
}

/// Why a mission was not flown to its end.
enum Failed {
    /// Its settings.
    Settings(SimError),
    /// Its planner.
    Planner(Pilot, PlannerError),
    /// No planner.
    NoPlanner(PlannerError),
    /// Something that Python raised.
    Raised(PyErr),
}

impl Failed {
    fn raise(self) -> PyErr {
        match self {
            Self::Settings(error) => refused(&error),
            Self::Planner(pilot, error) => pilot.exception(&error),
            Self::NoPlanner(error) => refused(&error),
            Self::Raised(error) => error,
        }
    }
}

fn mission(asked: &Asked, settings: &Settings, seed: u64, mut each: impl FnMut(&SettledTask)) -> Result<Score, Failed> {
    let mut env = settings.env(seed).map_err(Failed::Settings)?;
    let mut pilot = asked.make(seed, &settings.model).map_err(Failed::NoPlanner)?;
    let mut totals = Totals::default();
    let flown = env.run(pilot.planner(), |task| {
        totals.add(task);
        each(task);
    });
    match flown {
        Ok(()) => Ok(Score::of(&env, &totals, settings.episode().orbits, seed, settings.asked(seed))),
        Err(error) => Err(Failed::Planner(pilot, error)),
    }
}
