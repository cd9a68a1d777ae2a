//! The semi-MDP environment (paper, section III): one step is one task, spent in full.

use std::sync::Arc;

use rand::RngExt;
use serde::{Deserialize, Serialize};

use crate::config::resources::RewardKind;
use crate::error::{SimError, StripError};
use crate::learn::observation::{ObservationSet, observe};
use crate::mission::{Mission, RequestKeeper, horizon, windows_until};
use crate::planner::{Decision, PlannerError};
use crate::requests::catalogue::{Candidate, Catalogue};
use crate::requests::scenario::ScenarioConfig;
use crate::rng;
use crate::task::{SettledTask, TaskRecord};
use crate::time::Tick;
use crate::vehicle::errors::PlantErrors;
use crate::vehicle::faults::TimedFault;
use crate::vehicle::flight::{Flight, Situation};
use crate::vehicle::health::Health;
use crate::vehicle::initial::InitialState;
use crate::vehicle::model::Model;
use crate::vehicle::spacecraft::Spacecraft;
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

/// The requests of an episode: those known, and those that are still to come.
#[derive(Clone, Debug)]
pub struct EpisodeRequests {
    model: Arc<Model>,
    catalogue: Catalogue,
    /// Requests that are still to come, the next one last.
    to_come: Vec<(Tick, StripRequest)>,
}

impl RequestKeeper for EpisodeRequests {
    fn offer(&mut self, _task: u64, situation: &Situation, candidates: &mut Vec<Candidate>) {
        while let Some((since, request)) = self.to_come.pop_if(|(tick, _)| *tick <= situation.now) {
            // A request that cannot be flown is left out, as at the start.
            _ = self.catalogue.add(&self.model, &request, since);
        }
        self.catalogue.next(situation.now, self.model.config.planning.candidates, candidates);
    }

    fn settle(&mut self, record: &TaskRecord) -> f64 {
        let imaged = record.strip.filter(|_| record.success());
        imaged.and_then(|id| self.catalogue.fulfil(id)).unwrap_or(0.0)
    }
}

/// What came of a step.
#[derive(Clone, Debug, PartialEq)]
pub struct StepOutcome {
    /// The task.
    pub record: TaskRecord,
    /// The strip's priority when this fulfilled it, or what came to the ground meanwhile where that counts; less the
    /// penalty where the battery is empty or a wheel fails.
    pub reward: f64,
    /// Whether the satellite failed: the episode ends there for the learner.
    pub terminated: bool,
    /// Whether the episode's length is reached. The episode does not end there for the learner: bootstrap.
    pub truncated: bool,
}

/// The environment: a mission whose requests are an episode's.
pub type Env = Mission<EpisodeRequests>;

impl Mission<EpisodeRequests> {
    /// An environment at the epoch with an empty catalogue, ending at `horizon`.
    #[must_use]
    pub fn empty(model: Arc<Model>, initial: &InitialState, horizon: Tick) -> Self {
        Self::with_requests(model, initial, horizon, &[], Vec::new())
    }

    fn with_requests(
        model: Arc<Model>,
        initial: &InitialState,
        horizon: Tick,
        known: &[StripRequest],
        to_come: Vec<(Tick, StripRequest)>,
    ) -> Self {
        let spacecraft = Spacecraft::new(&model, initial);
        let mut catalogue = Catalogue::new(&model, &spacecraft.orbit, windows_until(&model, horizon));
        catalogue.add_all(&model, known, Tick(0));
        let requests = EpisodeRequests { model: model.clone(), catalogue, to_come };
        let flight = Flight::new(&model, spacecraft);
        Self::new(model, flight, requests, horizon)
    }

    /// An episode drawn from a seed: initial state, number of strips and strips.
    #[must_use]
    pub fn episode(model: Arc<Model>, config: &EpisodeConfig, seed: u64) -> Self {
        let initial = InitialState::draw(&model.config, &mut rng::stream(seed, rng::INITIAL_STATE));
        let mut rng = rng::stream(seed, rng::CATALOGUE);
        let count = config.scenario.draw_count(&mut rng);
        let mut requests = config.scenario.generate(&mut rng, count, model.config.earth.radius_m);
        let horizon = horizon(&model, config.orbits);
        let known = count - (config.arrivals * count as f64).round() as usize;
        let to_come = arrivals(requests.split_off(known), horizon, seed);
        Self::with_requests(model, &initial, horizon, &requests, to_come)
    }

    /// The episode of a seed with requests of one's own, all known at its start; `orbits` is its length.
    #[must_use]
    pub fn with_strips(model: Arc<Model>, orbits: f64, requests: &[StripRequest], seed: u64) -> Self {
        let initial = InitialState::draw(&model.config, &mut rng::stream(seed, rng::INITIAL_STATE));
        let horizon = horizon(&model, orbits);
        Self::with_requests(model, &initial, horizon, requests, Vec::new())
    }

    /// From now on the satellite differs from its model; `seed` is that of the sensors' noise.
    ///
    /// # Errors
    /// When an error, or what it makes of the configuration, is out of range.
    pub fn differ(&mut self, errors: &PlantErrors, seed: u64) -> Result<(), SimError> {
        self.refit(|flight, model| flight.spacecraft.differ(model, errors, seed))?;
        self.set_planning_delay(self.model().period.ticks_ceil(errors.planning_delay_s));
        Ok(())
    }

    /// From now on faults befall the satellite at their ticks, and its executive watches wheels and sensors; `noisy` is
    /// whether the sensors are known to be. What else differs must be said before.
    pub fn suffer(&mut self, faults: &[TimedFault], noisy: bool) {
        self.refit(|flight, model| {
            flight.watch(model, noisy);
            flight.spacecraft.suffer(faults.iter().copied());
        });
    }

    /// What is known of wheels and sensors.
    #[must_use]
    pub fn health(&self) -> Health {
        self.flight().health()
    }

    /// Adds requests at the present decision. Each one's identity or refusal, in order.
    pub fn submit(&mut self, requests: &[StripRequest]) -> Vec<Result<StripId, StripError>> {
        let now = self.now();
        self.change(|keeper| requests.iter().map(|it| keeper.catalogue.add(&keeper.model, it, now)).collect())
    }

    /// The observation of the next decision; see [`observe`].
    pub fn observe(&self, set: ObservationSet, features: &mut [f32], mask: &mut [bool]) {
        observe(&self.context(), set, features, mask);
    }

    /// Whether the episode's length is reached.
    #[must_use]
    pub fn truncated(&self) -> bool {
        self.over()
    }

    /// The strips.
    #[must_use]
    pub fn catalogue(&self) -> &Catalogue {
        &self.keeper().catalogue
    }

    /// Flies one task in full, also past the horizon: the step of the learner.
    ///
    /// # Errors
    /// When the decision is not one that the context allows; nothing is flown then.
    pub fn step(&mut self, decision: Decision) -> Result<StepOutcome, PlannerError> {
        let before = *self.delivered();
        let SettledTask { record, mut reward } = self.fly(decision, Tick(u64::MAX))?;
        let terminated = self.delivered().failures > before.failures;
        if let Some(config) = &self.model().config.resources {
            if config.reward == RewardKind::Delivered {
                reward = self.delivered().reward - before.reward;
            }
            if terminated {
                reward -= config.failure_penalty;
            }
        }
        Ok(StepOutcome { record, reward, terminated, truncated: self.truncated() })
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
