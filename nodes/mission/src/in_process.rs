//! A mission in one process, without DDS: the same tasks, results and rewards as over DDS in lockstep.

use std::collections::VecDeque;
use std::sync::Arc;

use swath_sim::mission::{Mission as Loop, RequestKeeper};
use swath_sim::model::Model;
use swath_sim::planner::{Planner, PlannerError};
use swath_sim::requests::catalogue::Candidate;
use swath_sim::task::{SettledTask, TaskRecord};
use swath_sim::time::Tick;
use swath_sim::vehicle::flight::{Flight, Situation};
use thiserror::Error;

use crate::file::{Mission, MissionError};
use crate::orders::action::Action;
use crate::outcome::{ResourcesSummary, TaskLine};
use crate::requests::logic::RequestLogic;
use crate::requests::refusal::Refusal;

/// Why a mission was not flown to its end.
#[derive(Debug, Error)]
pub enum InProcessError {
    /// The mission cannot be flown.
    #[error(transparent)]
    Mission(#[from] MissionError),
    /// The planner gave no usable decision.
    #[error(transparent)]
    Planner(#[from] PlannerError),
}

/// The request manager of a mission in one process, and what is asked of it on the way.
#[derive(Clone, Debug)]
pub struct Desk {
    requests: RequestLogic,
    /// What is still to come, in order.
    to_come: VecDeque<Action>,
    refused: Vec<(Action, Refusal)>,
}

impl Desk {
    fn take_while(&mut self, due: impl Fn(&Action) -> bool) {
        while let Some(action) = self.to_come.pop_front_if(|action| due(action)) {
            if let Err(refusal) = self.requests.take_again(&action) {
                self.refused.push((action, refusal));
            }
        }
    }
}

impl RequestKeeper for Desk {
    fn offer(&mut self, task: u64, situation: &Situation, candidates: &mut Vec<Candidate>) {
        self.requests.set_situation(*situation);
        *candidates = self.requests.on_decision_point(task, situation.now, &[]).candidates;
        for contradiction in self.requests.take_contradictions() {
            tracing::error!("{contradiction}");
        }
        // Nobody keeps a journal here.
        self.requests.take_journal();
    }

    fn settle(&mut self, record: &TaskRecord) -> f64 {
        // What came while the task was flown counts before its result does.
        self.take_while(|action| action.at < record.end);
        self.requests.on_result(record)
    }
}

/// A mission ready to be flown in this process: the loop of the simulation around the request manager of the nodes.
pub struct InProcessMission {
    mission: Loop<Desk>,
    requested: usize,
}

impl InProcessMission {
    /// Prepares a mission: its satellite at the epoch, and the strips known from the start.
    ///
    /// # Errors
    /// When a setting is out of range or a file of requests cannot be used.
    pub fn new(mission: &Mission) -> Result<Self, InProcessError> {
        Self::with_actions(mission, Vec::new())
    }

    /// The same with what is asked of the request manager on the way, in order.
    ///
    /// # Errors
    /// When a setting is out of range or a file of requests cannot be used.
    pub fn with_actions(mission: &Mission, actions: Vec<Action>) -> Result<Self, InProcessError> {
        let model = Arc::new(mission.model()?);
        let horizon = mission.horizon(&model);
        let mut requests = RequestLogic::new((*model).clone(), &mission.initial(), horizon, mission.rules());
        let (initial, faults) = mission.initial_requests()?;
        faults.iter().for_each(|fault| tracing::warn!("{fault}"));
        let requested = initial.len();
        for order in initial {
            // Why one is refused is in the request manager's counts.
            _ = requests.submit(order, Tick(0));
        }
        let mut desk = Desk { requests, to_come: actions.into(), refused: Vec::new() };
        desk.take_while(|action| action.initial);
        let flight = Flight::new(&model, mission.spacecraft(&model)?);
        let delay = model.period.ticks_ceil(mission.plant.planning_delay_s);
        let mut mission = Loop::new(model, flight, desk, horizon);
        mission.set_planning_delay(delay);
        Ok(Self { mission, requested })
    }

    /// Constants of the mission.
    #[must_use]
    pub fn model(&self) -> &Arc<Model> {
        self.mission.model()
    }

    /// The request manager.
    #[must_use]
    pub fn requests(&self) -> &RequestLogic {
        &self.mission.keeper().requests
    }

    /// What was asked for and refused, and why.
    #[must_use]
    pub fn refused(&self) -> &[(Action, Refusal)] {
        &self.mission.keeper().refused
    }

    /// Strips asked for at the start, and strips that were not refused.
    #[must_use]
    pub fn counts(&self) -> (usize, usize) {
        (self.requested, self.requests().len())
    }

    /// What came to the ground so far and how power and data stand, in a mission with resources.
    #[must_use]
    pub fn resources(&self) -> Option<ResourcesSummary> {
        let onboard = self.mission.onboard()?;
        Some(ResourcesSummary {
            delivered: *self.mission.delivered(),
            battery_level: onboard.battery().level(),
            stored_bits: onboard.storage().stored(),
        })
    }

    /// Decides and flies to the end, handing each task and its line to `each`.
    ///
    /// # Errors
    /// The first error of the planner.
    pub fn run(
        &mut self,
        planner: &mut dyn Planner,
        mut each: impl FnMut(&SettledTask, TaskLine),
    ) -> Result<(), InProcessError> {
        while let Some((settled, line)) = self.step(planner, self.mission.horizon())? {
            each(&settled, line);
        }
        Ok(())
    }

    /// Decides and flies one task, cut short at `until`; nothing at the end of the mission.
    ///
    /// # Errors
    /// When the planner gave no usable decision.
    pub fn step(
        &mut self,
        planner: &mut dyn Planner,
        until: Tick,
    ) -> Result<Option<(SettledTask, TaskLine)>, InProcessError> {
        let Some(settled) = self.mission.fly_one(planner, until)? else { return Ok(None) };
        let request = settled.record.strip.and_then(|id| self.requests().request(id));
        let line = TaskLine::new(&settled, request.map(|request| request.order.name.as_str()));
        Ok(Some((settled, line)))
    }
}
