//! The semi-MDP environment (paper, section III): one step is one task, spent in full.

use std::sync::Arc;

use rand::RngExt;
use serde::{Deserialize, Serialize};

use crate::error::SimError;
use crate::learn::observation::{ObservationSet, observe};
use crate::mission::{horizon, windows_until};
use crate::model::Model;
use crate::planner::{Decision, DecisionContext, Planner, PlannerError};
use crate::requests::catalogue::{Candidate, Catalogue};
use crate::requests::scenario::ScenarioConfig;
use crate::rng;
use crate::task::{Task, TaskRecord};
use crate::time::Tick;
use crate::vehicle::errors::PlantErrors;
use crate::vehicle::flight::{Flight, Situation};
use crate::vehicle::initial::InitialState;
use crate::world::strip::{StripId, StripRequest};

/// An episode: how long, and what is asked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct EpisodeConfig {
    /// Length [orbits].
    pub orbits: f64,
    /// Distribution of the requests.
    pub scenario: ScenarioConfig,
    /// Share of the requests that come in flight, as a Poisson stream over the episode; the others are known at its
    /// start.
    pub arrivals: f64,
}

impl Default for EpisodeConfig {
    fn default() -> Self {
        Self { orbits: 6.0, scenario: ScenarioConfig::default(), arrivals: 0.0 }
    }
}

impl EpisodeConfig {
    /// The paper's evaluation: 24 h, which it counts as 15 orbits, with 2000 to 5000 strips.
    #[must_use]
    pub fn evaluation() -> Self {
        let scenario = ScenarioConfig { count: [2000, 5000], ..ScenarioConfig::default() };
        Self { orbits: 15.0, scenario, ..Self::default() }
    }

    /// Checks the length and the scenario.
    ///
    /// # Errors
    /// The first setting that is out of range.
    pub fn validate(&self) -> Result<(), SimError> {
        crate::config::in_range("orbits", self.orbits, 0.01, 10_000.0)?;
        crate::config::in_range("arrivals", self.arrivals, 0.0, 1.0)?;
        self.scenario.validate()
    }
}

/// What came of a step.
#[derive(Clone, Debug, PartialEq)]
pub struct StepOutcome {
    /// The task.
    pub record: TaskRecord,
    /// Whether the episode's length is reached. The episode does not end there for the learner: bootstrap.
    pub truncated: bool,
}

/// The environment: a satellite, a catalogue and a clock.
#[derive(Clone, Debug)]
pub struct Env {
    model: Arc<Model>,
    flight: Flight,
    catalogue: Catalogue,
    horizon: Tick,
    task: u64,
    situation: Situation,
    previous: Option<TaskRecord>,
    candidates: Vec<Candidate>,
    /// Requests that are still to come, the next one last.
    to_come: Vec<(Tick, StripRequest)>,
    /// Time from a situation to the start of the task decided on it [ticks].
    planning_delay: u32,
}

impl Env {
    /// An environment at the epoch with an empty catalogue, ending at `horizon`.
    #[must_use]
    pub fn new(model: Arc<Model>, initial: &InitialState, horizon: Tick) -> Self {
        let mut flight = Flight::new(&model, &model, initial);
        let catalogue = Catalogue::new(&model, &flight.spacecraft.orbit, windows_until(&model, horizon));
        let situation = flight.situation();
        Self {
            model,
            flight,
            catalogue,
            horizon,
            task: 0,
            situation,
            previous: None,
            candidates: Vec::new(),
            to_come: Vec::new(),
            planning_delay: 0,
        }
    }

    /// An episode drawn from a seed: initial state, number of strips and strips.
    #[must_use]
    pub fn episode(model: Arc<Model>, config: &EpisodeConfig, seed: u64) -> Self {
        let initial = InitialState::draw(&model.config, &mut rng::stream(seed, rng::INITIAL_STATE));
        let mut rng = rng::stream(seed, rng::CATALOGUE);
        let count = config.scenario.draw_count(&mut rng);
        let mut requests = config.scenario.generate(&mut rng, count, model.config.earth.radius_m);
        let horizon = horizon(&model, config.orbits);
        let mut env = Self::new(model, &initial, horizon);
        let known = count - (config.arrivals * count as f64).round() as usize;
        env.to_come = arrivals(requests.split_off(known), horizon, seed);
        env.catalogue.add_all(&env.model, &requests, Tick(0));
        env.refresh();
        env
    }

    /// From now on the satellite differs from its model; `seed` is that of the sensors' noise.
    ///
    /// # Errors
    /// When an error, or what it makes of the configuration, is out of range.
    pub fn differ(&mut self, errors: &PlantErrors, seed: u64) -> Result<(), SimError> {
        self.flight.differ(errors.plant(&self.model)?, errors.sensor(rng::stream(seed, rng::SENSORS)));
        self.planning_delay = self.model.period.ticks_ceil(errors.planning_delay_s);
        self.refresh();
        Ok(())
    }

    /// Adds requests at the present decision. Each one's identity or refusal, in order.
    pub fn submit(&mut self, requests: &[StripRequest]) -> Vec<Result<StripId, crate::error::StripError>> {
        self.submit_since(requests, self.now())
    }

    /// Adds requests that came at an earlier tick: their windows are sought from there.
    pub fn submit_since(
        &mut self,
        requests: &[StripRequest],
        since: Tick,
    ) -> Vec<Result<StripId, crate::error::StripError>> {
        let results = requests.iter().map(|request| self.catalogue.add(&self.model, request, since)).collect();
        self.refresh();
        results
    }

    /// What the next decision rests on.
    #[must_use]
    pub fn context(&self) -> DecisionContext<'_> {
        DecisionContext {
            task: self.task,
            situation: &self.situation,
            candidates: &self.candidates,
            previous: self.previous.as_ref(),
            model: &self.model,
        }
    }

    /// The observation of the next decision; see [`observe`].
    pub fn observe(&self, set: ObservationSet, features: &mut [f32], mask: &mut [bool]) {
        observe(&self.context(), set, features, mask);
    }

    /// Simulated time.
    #[must_use]
    pub fn now(&self) -> Tick {
        self.flight.now()
    }

    /// Tick at which the episode ends.
    #[must_use]
    pub fn horizon(&self) -> Tick {
        self.horizon
    }

    /// Whether the episode's length is reached.
    #[must_use]
    pub fn truncated(&self) -> bool {
        self.now() >= self.horizon
    }

    /// The strips.
    #[must_use]
    pub fn catalogue(&self) -> &Catalogue {
        &self.catalogue
    }

    /// The constants.
    #[must_use]
    pub fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// Flies one task in full, also past the horizon: the step of the learner.
    ///
    /// # Errors
    /// When the decision is not one that the context allows; nothing is flown then.
    pub fn step(&mut self, decision: Decision) -> Result<StepOutcome, PlannerError> {
        self.fly(decision, Tick(u64::MAX))
    }

    /// Flies one task, cut short at the horizon: the step of a mission.
    ///
    /// # Errors
    /// When the decision is not one that the context allows; nothing is flown then.
    pub fn step_to_horizon(&mut self, decision: Decision) -> Result<StepOutcome, PlannerError> {
        self.fly(decision, self.horizon)
    }

    /// Decides and flies until the horizon, handing each task's record to `each`.
    ///
    /// # Errors
    /// The first error of the planner.
    pub fn run(&mut self, planner: &mut dyn Planner, mut each: impl FnMut(&TaskRecord)) -> Result<(), PlannerError> {
        while !self.truncated() {
            let decision = planner.decide(&self.context())?;
            each(&self.step_to_horizon(decision)?.record);
        }
        Ok(())
    }

    fn fly(&mut self, decision: Decision, until: Tick) -> Result<StepOutcome, PlannerError> {
        let context = self.context();
        let task = decision.to_task(&context)?;
        let strip = match decision {
            Decision::Image { candidate, .. } => Some(context.candidates[candidate].id),
            Decision::Wait { .. } => None,
        };
        let (t_pre, t_acq) = match task {
            Task::Image { t_pre, t_acq, .. } => (t_pre, t_acq),
            Task::Wait { .. } => (0, 0),
        };
        if self.planning_delay > 0 {
            self.flight.fly(Task::Wait { ticks: self.planning_delay }, until);
        }
        let start = self.now();
        let outcome = self.flight.fly(task, until);
        let reward = match (strip, outcome.failure) {
            (Some(id), None) => self.catalogue.fulfil(id).unwrap_or(0.0),
            _ => 0.0,
        };
        let record = TaskRecord { task: self.task, start, end: self.now(), strip, t_pre, t_acq, outcome, reward };
        self.task += 1;
        self.previous = Some(record.clone());
        self.refresh();
        Ok(StepOutcome { record, truncated: self.truncated() })
    }

    fn refresh(&mut self) {
        self.situation = self.flight.situation();
        while let Some((since, request)) = self.to_come.pop_if(|(tick, _)| *tick <= self.situation.now) {
            // A request that cannot be flown is left out, as at the start.
            _ = self.catalogue.add(&self.model, &request, since);
        }
        let count = self.model.config.planning.candidates;
        self.catalogue.next(self.situation.now, count, &mut self.candidates);
    }
}

/// When each request comes: given their number, the events of a Poisson stream are uniform over its time.
fn arrivals(requests: Vec<StripRequest>, horizon: Tick, seed: u64) -> Vec<(Tick, StripRequest)> {
    let mut rng = rng::stream(seed, rng::ARRIVALS);
    let mut arrivals: Vec<(Tick, StripRequest)> =
        requests.into_iter().map(|request| (Tick(rng.random_range(0..horizon.0.max(1))), request)).collect();
    arrivals.sort_by_key(|(tick, _)| std::cmp::Reverse(*tick));
    arrivals
}
