//! Episodes flown side by side on threads, each call one step of all of them.

use std::sync::{Mutex, MutexGuard, PoisonError};

use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1, ToPyArray};
use pyo3::exceptions::{PyIndexError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::context::Context;
use crate::errors::{failed, refused};
use crate::lane::{Flown, Lane, LaneError, Order};
use crate::requests;
use crate::settings::Settings;

/// Most episodes side by side.
const LANES_MAX: usize = 65_536;
/// Most threads.
const THREADS_MAX: usize = 1024;

/// Episodes side by side.
#[pyclass(module = "swath._swath")]
pub struct Episodes {
    settings: Settings,
    count: usize,
    /// Locked by those that look only: whoever steps has the episodes for itself.
    lanes: Mutex<Vec<Lane>>,
    /// None when the caller's own thread does everything.
    pool: Option<ThreadPool>,
}

/// What a lane writes: its part of each array.
struct Part<'a> {
    number: usize,
    lane: &'a mut Lane,
    order: Order,
    features: &'a mut [f32],
    valid: &'a mut [bool],
    flown: &'a mut Flown,
}

#[pymethods]
impl Episodes {
    /// `count` episodes that are still to begin, flown by `threads` threads.
    #[new]
    #[pyo3(signature = (settings, count=1, threads=1))]
    fn new(settings: &Settings, count: usize, threads: usize) -> PyResult<Self> {
        within("num_envs", count, LANES_MAX)?;
        within("threads", threads, THREADS_MAX)?;
        let pool = (threads.min(count) > 1)
            .then(|| ThreadPoolBuilder::new().num_threads(threads.min(count)).build())
            .transpose()
            .map_err(|error| failed(&error))?;
        let lanes = Mutex::new((0..count).map(|_| Lane::new(settings)).collect());
        Ok(Self { settings: settings.clone(), count, lanes, pool })
    }

    /// Carries out an order for each episode: 0 looks, 1 flies `tokens` and `parameters`, 2 begins the episode of
    /// `seeds`. Nothing is flown when one of the actions cannot be.
    ///
    /// Returns new arrays, with one row for each episode: features, action mask, reward, terminated, truncated, duration
    /// [s], success, number of the failure, strip.
    fn advance<'py>(
        &mut self,
        py: Python<'py>,
        orders: PyReadonlyArray1<'py, u8>,
        tokens: PyReadonlyArray1<'py, i64>,
        parameters: PyReadonlyArray1<'py, f64>,
        seeds: PyReadonlyArray1<'py, u64>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let orders = self.orders(orders.as_slice()?, tokens.as_slice()?, parameters.as_slice()?, seeds.as_slice()?)?;
        let count = self.count;
        let (slots, width) = (self.settings.model.config.planning.candidates, self.settings.observation().features());
        let features = PyArray3::<f32>::zeros(py, [count, slots, width], false);
        let mut valid = vec![false; count * slots];
        let mut flown = vec![Flown::default(); count];
        {
            let mut features = features.readwrite();
            let features = features.as_slice_mut()?;
            py.detach(|| self.carry_out(&orders, features, &mut valid, &mut flown)).map_err(|error| refused(&error))?;
        }
        let mask = PyArray2::<i8>::zeros(py, [count, slots], false);
        for (to, from) in mask.readwrite().as_slice_mut()?.iter_mut().zip(&valid) {
            *to = i8::from(*from);
        }
        let column = |of: fn(&Flown) -> f64| flown.iter().map(of).collect::<Vec<_>>().to_pyarray(py);
        let flag = |of: fn(&Flown) -> bool| flown.iter().map(of).collect::<Vec<_>>().to_pyarray(py);
        let number = |of: fn(&Flown) -> i64| flown.iter().map(of).collect::<Vec<_>>().to_pyarray(py);
        let rest = (
            column(|it| it.reward),
            flag(|it| it.terminated),
            flag(|it| it.truncated),
            column(|it| it.duration_s),
            flag(|it| it.success),
            number(|it| it.failure),
            number(|it| it.strip),
        );
        let (reward, terminated, truncated, duration, success, failure, strip) = rest;
        let all = (features, mask, reward, terminated, truncated, duration, success, failure, strip);
        Ok(all.into_pyobject(py)?.into_any())
    }

    /// Simulated time of each episode [s]; NaN of one that is still to begin.
    fn times_s<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let period = self.settings.model.period;
        let lanes = self.lanes();
        let times = lanes.iter().map(|lane| lane.env().map_or(f64::NAN, |env| period.time_s(env.now())));
        times.collect::<Vec<_>>().to_pyarray(py)
    }

    /// What a decision rests on in one of the episodes.
    #[pyo3(signature = (number=0))]
    fn context(&self, number: usize) -> PyResult<Context> {
        let lanes = self.lanes();
        let env = lane(&lanes, number)?.env().map_err(|error| failed(&error))?;
        Ok(Context::new(&env.context(), self.settings.model.clone()))
    }

    /// Every strip of one of the episodes: `start_deg` and `end_deg` as rows of latitude and longitude, `priority`,
    /// `state`, `strip`.
    #[pyo3(signature = (number=0))]
    fn strips<'py>(&self, py: Python<'py>, number: usize) -> PyResult<Bound<'py, PyDict>> {
        let lanes = self.lanes();
        requests::table(py, lane(&lanes, number)?.env().map_err(|error| failed(&error))?.catalogue())
    }

    fn __len__(&self) -> usize {
        self.count
    }
}

impl Episodes {
    fn lanes(&self) -> MutexGuard<'_, Vec<Lane>> {
        self.lanes.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn orders(&self, orders: &[u8], tokens: &[i64], parameters: &[f64], seeds: &[u64]) -> PyResult<Vec<Order>> {
        let count = self.count;
        for (name, given) in [
            ("orders", orders.len()),
            ("strips", tokens.len()),
            ("transitions", parameters.len()),
            ("seeds", seeds.len()),
        ] {
            if given != count {
                return Err(PyValueError::new_err(format!("{given} {name} were given for {count} environments")));
            }
        }
        let order = |number: usize, lane: &Lane| match orders[number] {
            0 => Ok(Order::Look),
            1 => lane.action(tokens[number], parameters[number]).map(Order::Step),
            _ => Ok(Order::Reset(seeds[number])),
        };
        let lanes = self.lanes();
        let each = lanes.iter().enumerate();
        each.map(|(number, lane)| order(number, lane).map_err(|error| refused(&self.located(number, error)))).collect()
    }

    fn carry_out(
        &mut self,
        orders: &[Order],
        features: &mut [f32],
        valid: &mut [bool],
        flown: &mut [Flown],
    ) -> Result<(), LaneError> {
        let count = self.count;
        let lanes = self.lanes.get_mut().unwrap_or_else(PoisonError::into_inner);
        let Some(shape) = lanes.first().map(Lane::shape) else { return Ok(()) };
        let parts = lanes.iter_mut().zip(orders).enumerate();
        let rows = features.chunks_exact_mut(shape.len()).zip(valid.chunks_exact_mut(shape.tokens));
        let mut parts: Vec<Part<'_>> = parts
            .zip(rows.zip(flown))
            .map(|((number, (lane, order)), ((features, valid), flown))| Part {
                number,
                lane,
                order: *order,
                features,
                valid,
                flown,
            })
            .collect();
        let one = |part: &mut Part<'_>| {
            *part.flown = part.lane.carry_out(part.order, part.features, part.valid).map_err(|error| {
                if count > 1 { LaneError::Lane { lane: part.number, source: Box::new(error) } } else { error }
            })?;
            Ok(())
        };
        match &self.pool {
            None => parts.iter_mut().try_for_each(one),
            Some(pool) => pool.install(|| parts.par_iter_mut().with_max_len(1).try_for_each(one)),
        }
    }

    /// Names the lane where there are several.
    fn located(&self, lane: usize, error: LaneError) -> LaneError {
        if self.count > 1 { LaneError::Lane { lane, source: Box::new(error) } } else { error }
    }
}

fn lane(lanes: &[Lane], number: usize) -> PyResult<&Lane> {
    let missing = || PyIndexError::new_err(format!("environment {number} of {}", lanes.len()));
    lanes.get(number).ok_or_else(missing)
}

fn within(name: &str, value: usize, most: usize) -> PyResult<()> {
    if (1..=most).contains(&value) {
        return Ok(());
    }
    Err(PyValueError::new_err(format!("{name} is {value}, outside 1 to {most}")))
}
