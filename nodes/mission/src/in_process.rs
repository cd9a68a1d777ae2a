//! A mission in one process, without DDS: the same tasks, results and rewards as over DDS in lockstep.

use std::sync::Arc;

use swath_sim::mission::{Mission as Loop, RequestKeeper};
use swath_sim::model::Model;
use swath_sim::planner::{Planner, PlannerError};
use swath_sim::requests::catalogue::Candidate;
use swath_sim::task::{SettledTask, TaskRecord};
use swath_sim::vehicle::flight::{Flight, Situation};
use thiserror::Error;

use crate::file::{Mission, MissionError};
use crate::outcome::TaskLine;
use crate::requests::logic::RequestLogic;

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

impl RequestKeeper for RequestLogic {
    fn offer(&mut self, task: u64, situation: &Situation, candidates: &mut Vec<Candidate>) {
        self.set_situation(*situation);
        *candidates = self.on_decision_point(task, situation.now, &[]).candidates;
        // Nobody keeps a journal here.
        self.take_journal();
    }

    fn settle(&mut self, record: &TaskRecord) -> f64 {
        self.on_result(record)
    }
}

/// A mission ready to be flown in this process: the loop of the simulation around the request manager of the nodes.
pub struct InProcessMission {
    mission: Loop<RequestLogic>,
    requested: usize,
}

impl InProcessMission {
    /// Prepares a mission: its satellite at the epoch, and the strips known from the start.
    ///
    /// # Errors
    /// When a setting is out of range or a file of requests cannot be used.
    pub fn new(mission: &Mission) -> Result<Self, InProcessError> {
        let model = Arc::new(mission.model()?);
        let horizon = mission.horizon(&model);
        let mut requests = RequestLogic::new((*model).clone(), &mission.initial(), horizon, mission.rules());
        let initial = mission.initial_requests()?;
        let requested = initial.len();
        for named in initial {
            // Why one is refused is in the request manager's counts.
            _ = requests.submit(named);
        }
        let flight = Flight::new(&model, mission.spacecraft(&model)?);
        let delay = model.period.ticks_ceil(mission.plant.planning_delay_s);
        let mut mission = Loop::new(model, flight, requests, horizon);
        mission.set_planning_delay(delay);
        Ok(Self { mission, requested })
    }

    /// Does something with the requests at the present decision.
    pub fn change<R>(&mut self, change: impl FnOnce(&mut RequestLogic) -> R) -> R {
        self.mission.change(change)
    }

    /// Constants of the mission.
    #[must_use]
    pub fn model(&self) -> &Arc<Model> {
        self.mission.model()
    }

    /// The request manager.
    #[must_use]
    pub fn requests(&self) -> &RequestLogic {
        self.mission.keeper()
    }

    /// Strips asked for at the start, and strips that were not refused.
    #[must_use]
    pub fn counts(&self) -> (usize, usize) {
        (self.requested, self.requests().len())
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
        while let Some((settled, line)) = self.step(planner)? {
            each(&settled, line);
        }
        Ok(())
    }

    /// Decides and flies one task; nothing at the end of the mission.
    ///
    /// # Errors
    /// When the planner gave no usable decision.
    pub fn step(&mut self, planner: &mut dyn Planner) -> Result<Option<(SettledTask, TaskLine)>, InProcessError> {
        let Some(settled) = self.mission.fly_one(planner)? else { return Ok(None) };
        let request = settled.record.strip.and_then(|id| self.requests().request(id));
        let line = TaskLine::new(&settled, request.map(|request| request.named.name.as_str()));
        Ok(Some((settled, line)))
    }
}
