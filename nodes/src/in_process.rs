//! A mission in one process, without DDS: the same tasks, results and rewards as over DDS in lockstep.

use std::sync::Arc;

use swath_sim::env::{Env, TaskRecord};
use swath_sim::model::Model;
use swath_sim::planner::{Planner, PlannerError};
use swath_sim::time::Tick;
use thiserror::Error;

use crate::mission::{Mission, MissionError};
use crate::record::TaskLine;
use crate::requests_file::NamedRequest;

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

/// A mission ready to be flown in this process.
pub struct InProcessMission {
    env: Env,
    names: Vec<String>,
    accepted: usize,
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
        let env = Env::new(model, &mission.initial(), horizon);
        let mut flight = Self { env, names: Vec::new(), accepted: 0, requested: 0 };
        flight.submit(&mission.initial_requests()?);
        Ok(flight)
    }

    /// Adds requests at the present decision.
    pub fn submit(&mut self, requests: &[NamedRequest]) {
        self.submit_since(requests, self.env.now());
    }

    /// Adds requests that came at an earlier tick.
    pub fn submit_since(&mut self, requests: &[NamedRequest], since: Tick) {
        self.requested += requests.len();
        for named in requests {
            let results = self.env.submit_since(std::slice::from_ref(&named.request), since);
            self.accepted += results.iter().filter(|result| result.is_ok()).count();
            // A bidirectional request adds a twin of the same name.
            self.names.resize(self.env.catalogue().len(), named.name.clone());
        }
    }

    /// Constants of the mission.
    #[must_use]
    pub fn model(&self) -> &Arc<Model> {
        self.env.model()
    }

    /// Strips asked for, and strips in the catalogue.
    #[must_use]
    pub fn counts(&self) -> (usize, usize) {
        (self.requested, self.env.catalogue().len())
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
        if self.env.truncated() {
            return Ok(None);
        }
        let decision = planner.decide(&self.env.context())?;
        let record = self.env.step_to_horizon(decision)?.record;
        let name = record.strip.and_then(|id| self.names.get(id.0 as usize - 1)).map(String::as_str);
        let line = TaskLine::new(&record, name);
        Ok(Some((record, line)))
    }
}
