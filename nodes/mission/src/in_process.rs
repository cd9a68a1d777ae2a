//! A mission in one process, without DDS: the same tasks, results and rewards as over DDS in lockstep.

use std::sync::Arc;

use swath_sim::model::Model;
use swath_sim::planner::{Decision, DecisionContext, Planner, PlannerError};
use swath_sim::task::{Task, TaskRecord};
use swath_sim::time::Tick;
use swath_sim::vehicle::flight::Flight;
use thiserror::Error;

use crate::file::{Mission, MissionError};
use crate::orders::geojson::NamedRequest;
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

/// A mission ready to be flown in this process: the request manager of the nodes, and the flight of the simulation.
pub struct InProcessMission {
    model: Arc<Model>,
    horizon: Tick,
    flight: Flight,
    requests: RequestLogic,
    requested: usize,
    /// Number of the task to decide.
    task: u64,
    finished: Option<TaskRecord>,
}

impl InProcessMission {
    /// Prepares a mission: its satellite at the epoch, and the strips known from the start.
    ///
    /// # Errors
    /// When a setting is out of range or a file of requests cannot be used.
    pub fn new(mission: &Mission) -> Result<Self, InProcessError> {
        let model = Arc::new(mission.model()?);
        let horizon = mission.horizon(&model);
        let initial = mission.initial();
        let mut prepared = Self {
            flight: Flight::new(&model, &model, &initial),
            requests: RequestLogic::new((*model).clone(), &initial, horizon, mission.rules()),
            model,
            horizon,
            requested: 0,
            task: 0,
            finished: None,
        };
        prepared.submit(&mission.initial_requests()?);
        Ok(prepared)
    }

    /// Adds requests at the present decision.
    pub fn submit(&mut self, requests: &[NamedRequest]) {
        self.submit_since(requests, self.flight.now());
    }

    /// Adds requests that came at an earlier tick.
    pub fn submit_since(&mut self, requests: &[NamedRequest], since: Tick) {
        self.requested += requests.len();
        for named in requests {
            // Why one is refused is in the request manager's counts.
            let _ = self.requests.submit_since(named.clone(), since);
        }
    }

    /// Constants of the mission.
    #[must_use]
    pub fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// The request manager.
    #[must_use]
    pub fn requests(&self) -> &RequestLogic {
        &self.requests
    }

    /// Strips asked for, and strips that were not refused.
    #[must_use]
    pub fn counts(&self) -> (usize, usize) {
        (self.requested, self.requests.len())
    }

    /// Decides and flies to the end, handing each task's record and line to `each`.
    ///
    /// # Errors
    /// The first error of the planner.
    pub fn run(
        &mut self,
        planner: &mut dyn Planner,
        mut each: impl FnMut(&TaskRecord, TaskLine),
    ) -> Result<(), InProcessError> {
        while let Some((record, line)) = self.step(planner)? {
            each(&record, line);
        }
        Ok(())
    }

    /// Decides and flies one task; nothing at the end of the mission.
    ///
    /// # Errors
    /// When the planner gave no usable decision.
    pub fn step(&mut self, planner: &mut dyn Planner) -> Result<Option<(TaskRecord, TaskLine)>, InProcessError> {
        let situation = self.flight.situation();
        let (now, task) = (situation.now, self.task);
        let offer = self.requests.on_decision_point(task, now, self.finished.as_slice());
        // Nobody keeps a journal here.
        self.requests.take_journal();
        if now >= self.horizon {
            return Ok(None);
        }
        let candidates = &offer.candidates;
        let previous = self.finished.as_ref();
        let context = DecisionContext { task, situation: &situation, candidates, previous, model: &self.model };
        let decision = planner.decide(&context)?;
        let kind = decision.to_task(&context)?;
        let (strip, t_pre, t_acq, priority) = match (decision, kind) {
            (Decision::Image { candidate, .. }, Task::Image { strip, t_pre, t_acq }) => {
                (candidates.get(candidate).map(|candidate| candidate.id), t_pre, t_acq, strip.priority)
            }
            _ => (None, 0, 0, 0.0),
        };
        let outcome = self.flight.fly(kind, self.horizon);
        let reward = if strip.is_some() && outcome.failure.is_none() { priority } else { 0.0 };
        let record = TaskRecord { task, start: now, end: self.flight.now(), strip, t_pre, t_acq, outcome, reward };
        let name = strip.and_then(|id| self.requests.request(id)).map(|request| request.named.name.as_str());
        let line = TaskLine::new(&record, name);
        self.task += 1;
        self.finished = Some(record.clone());
        Ok(Some((record, line)))
    }
}
