//! A mission: decide, fly, settle; the one loop of episodes, of missions in one process, and of re-flights.

use std::sync::Arc;

use crate::planner::{Decision, DecisionContext, Planner, PlannerError, Shield, decide};
use crate::requests::catalogue::Candidate;
use crate::task::{SettledTask, TaskRecord};
use crate::time::Tick;
use crate::vehicle::executive::Executive;
use crate::vehicle::flight::{Flight, Situation};
use crate::vehicle::health::Health;
use crate::vehicle::model::Model;
use crate::vehicle::resources::{Delivered, Failure, Onboard};

/// Whoever keeps the requests of a mission.
pub trait RequestKeeper {
    /// A task is wanted: puts what may be imaged into `candidates`. It may be asked again for the same task.
    fn offer(&mut self, task: u64, situation: &Situation, candidates: &mut Vec<Candidate>);

    /// A task has ended: says its reward.
    fn settle(&mut self, record: &TaskRecord) -> f64;
}

/// A satellite, whoever keeps its requests, and a clock.
#[derive(Clone, Debug)]
pub struct Mission<K> {
    model: Arc<Model>,
    flight: Flight,
    keeper: K,
    horizon: Tick,
    task: u64,
    situation: Situation,
    previous: Option<TaskRecord>,
    candidates: Vec<Candidate>,
    /// Time from a situation to the start of the task decided on it [ticks].
    planning_delay: u32,
    shield: Option<Shield>,
}

impl<K: RequestKeeper> Mission<K> {
    /// A mission that begins where a flight stands and ends at `horizon`.
    #[must_use]
    pub fn new(model: Arc<Model>, flight: Flight, keeper: K, horizon: Tick) -> Self {
        Self::from_task(0, model, flight, keeper, horizon)
    }

    /// The same from the decision of a task's number on.
    #[must_use]
    pub fn from_task(task: u64, model: Arc<Model>, mut flight: Flight, keeper: K, horizon: Tick) -> Self {
        let situation = flight.situation();
        let (previous, candidates) = (None, Vec::new());
        let shield = Shield::new(&model);
        let mut mission =
            Self { model, flight, keeper, horizon, task, situation, previous, candidates, planning_delay: 0, shield };
        mission.refresh();
        mission
    }

    /// From now on this much time passes between a situation and the start of the task decided on it [ticks].
    pub fn set_planning_delay(&mut self, ticks: u32) {
        self.planning_delay = ticks;
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

    /// Simulated time.
    #[must_use]
    pub fn now(&self) -> Tick {
        self.flight.now()
    }

    /// Tick at which the mission ends.
    #[must_use]
    pub fn horizon(&self) -> Tick {
        self.horizon
    }

    /// Whether the mission's end is reached.
    #[must_use]
    pub fn over(&self) -> bool {
        self.now() >= self.horizon
    }

    /// The constants.
    #[must_use]
    pub fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// The satellite in flight.
    #[must_use]
    pub fn flight(&self) -> &Flight {
        &self.flight
    }

    /// What came to be known of wheels and sensors since the last call, each with its tick.
    pub fn take_changes(&mut self) -> Vec<(Tick, Health)> {
        self.flight.take_changes()
    }

    /// Time from a situation to the start of the task decided on it [ticks].
    #[must_use]
    pub fn planning_delay(&self) -> u32 {
        self.planning_delay
    }

    /// Whoever keeps the requests.
    #[must_use]
    pub fn keeper(&self) -> &K {
        &self.keeper
    }

    /// Whoever keeps the requests, to be told what goes on while a task is flown; [`Self::change`] is for what changes
    /// what may be imaged.
    pub fn keeper_mut(&mut self) -> &mut K {
        &mut self.keeper
    }

    /// What came to the ground so far.
    #[must_use]
    pub fn delivered(&self) -> &Delivered {
        self.onboard().map_or(&Delivered::NONE, |onboard| &onboard.state().delivered)
    }

    /// What failed and is not mended yet: until it is, the satellite only sees to that.
    #[must_use]
    pub fn safe_mode(&self) -> Option<Failure> {
        self.onboard()?.state().safe_mode
    }

    /// Power, data and momentum, where they have bounds.
    #[must_use]
    pub fn onboard(&self) -> Option<&Onboard> {
        self.flight.spacecraft.onboard()
    }

    /// Changes something about the requests, and looks again at what may be imaged.
    pub fn change<R>(&mut self, change: impl FnOnce(&mut K) -> R) -> R {
        let result = change(&mut self.keeper);
        self.refresh();
        result
    }

    /// Changes something about the satellite, and looks again at where it stands.
    pub(crate) fn refit<R>(&mut self, change: impl FnOnce(&mut Flight, &Model) -> R) -> R {
        let result = change(&mut self.flight, &self.model);
        self.refresh();
        result
    }

    /// Flies one task, cut short at `until`.
    ///
    /// # Errors
    /// When the decision is not one that the context allows; nothing is flown then.
    pub fn fly(&mut self, decision: Decision, until: Tick) -> Result<SettledTask, PlannerError> {
        self.fly_after(decision, self.planning_delay, until)
    }

    /// Flies one task that begins after `delay` ticks, cut short at `until`.
    ///
    /// # Errors
    /// When the decision is not one that the context allows; nothing is flown then.
    pub fn fly_after(&mut self, decision: Decision, delay: u32, until: Tick) -> Result<SettledTask, PlannerError> {
        let task = decision.to_task(&self.context())?;
        let record = self.flight.fly_number(self.task, task, delay, until);
        Ok(self.settled(record))
    }

    /// Flies one task, in which guidance is lost at `lost`, which is not after the task's end; see [`Flight::fly_lost`].
    ///
    /// # Errors
    /// When the decision is not one that the context allows; nothing is flown then.
    pub fn fly_lost(
        &mut self,
        decision: Decision,
        delay: u32,
        (lost, back): (Tick, Tick),
        executive: Executive,
    ) -> Result<SettledTask, PlannerError> {
        let task = decision.to_task(&self.context())?;
        let record = self.flight.fly_lost(self.task, task, delay, lost, back, executive);
        Ok(self.settled(record))
    }

    /// Flies without guidance until `back`; `executive` takes over then.
    pub fn without_guidance(&mut self, back: Tick, executive: Executive) {
        self.flight.without_guidance(back, executive);
        self.refresh();
    }

    fn settled(&mut self, record: TaskRecord) -> SettledTask {
        let reward = self.keeper.settle(&record);
        self.task += 1;
        self.previous = Some(record.clone());
        self.refresh();
        SettledTask { record, reward }
    }

    /// Decides and flies one task, cut short at `until` and at the mission's end; nothing once it is over.
    ///
    /// # Errors
    /// When the planner gave no usable decision.
    pub fn fly_one(&mut self, planner: &mut dyn Planner, until: Tick) -> Result<Option<SettledTask>, PlannerError> {
        if self.over() {
            return Ok(None);
        }
        let decision = self.decide(planner)?;
        self.fly(decision, until.min(self.horizon)).map(Some)
    }

    /// What comes next: safe mode decides, or the shield, or the planner within what the shield allows.
    ///
    /// # Errors
    /// When the planner gave no usable decision.
    pub fn decide(&self, planner: &mut dyn Planner) -> Result<Decision, PlannerError> {
        decide(self.shield.as_ref(), &self.context(), planner)
    }

    /// Decides and flies to the mission's end, handing each task to `each`.
    ///
    /// # Errors
    /// The first error of the planner.
    pub fn run(&mut self, planner: &mut dyn Planner, mut each: impl FnMut(&SettledTask)) -> Result<(), PlannerError> {
        while let Some(settled) = self.fly_one(planner, self.horizon)? {
            each(&settled);
        }
        Ok(())
    }

    fn refresh(&mut self) {
        self.situation = self.flight.situation();
        self.keeper.offer(self.task, &self.situation, &mut self.candidates);
    }
}

/// How far past the mission's end windows are sought [orbits], so that its end cannot be seen in the observation.
const WINDOW_MARGIN_ORBITS: f64 = 1.5;

/// Tick at which a mission of a number of orbits ends.
#[must_use]
pub fn horizon(model: &Model, orbits: f64) -> Tick {
    Tick((orbits * model.orbit_period_s() / model.period.seconds()).round() as u64)
}

/// Tick up to which a mission that ends at `horizon` seeks windows.
#[must_use]
pub fn windows_until(model: &Model, horizon: Tick) -> Tick {
    horizon.after(model.period.ticks_ceil(model.orbit_period_s() * WINDOW_MARGIN_ORBITS))
}
