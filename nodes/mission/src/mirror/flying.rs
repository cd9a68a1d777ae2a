//! The mission as it is flown in the head.

use swath_sim::planner::Planner;
use swath_sim::task::TaskRecord;
use swath_sim::time::Tick;
use swath_sim::vehicle::dynamics::BodyState;
use swath_sim::vehicle::errors::PlantErrors;

use crate::faults::FaultPlan;
use crate::file::{Mission, MissionRequests};
use crate::in_process::{InProcessError, InProcessMission};
use crate::link::config::LinkConfig;

/// A mission as the ground has it in its head: a satellite that is as its model says, nothing fails, no frame is lost,
/// and nothing is asked yet.
pub(super) fn nominal(mission: &Mission) -> Mission {
    let link = mission.link.clone().map(|link| LinkConfig { loss: 0.0, ..link });
    let plant = PlantErrors { planning_delay_s: mission.plant.planning_delay_s, ..PlantErrors::default() };
    let requests = MissionRequests { files: Vec::new(), random: None, ..mission.requests.clone() };
    Mission { link, plant, requests, faults: FaultPlan::default(), ..mission.clone() }
}

/// A task as it is flown in the head.
#[derive(Clone, Debug)]
pub(super) struct Imagined {
    /// When it was decided.
    pub decided: Tick,
    /// The satellite then.
    pub body: BodyState,
    /// How it went.
    pub record: TaskRecord,
}

/// The mission in the head, and a planner that goes with it where one can be doubled.
pub(super) struct Flying {
    pub mission: InProcessMission,
    planner: Option<Box<dyn Planner + Send>>,
}

impl Flying {
    pub(super) fn new(mission: InProcessMission, planner: &(dyn Planner + Send)) -> Self {
        Self { mission, planner: planner.fork() }
    }

    /// The same again, to be flown on by itself.
    pub(super) fn fork(&self) -> Self {
        self.resumed(self.mission.clone())
    }

    /// The same with a planner that has come so far, where this one goes on from what is known.
    pub(super) fn resumed(&self, mission: InProcessMission) -> Self {
        let planner = self.planner.as_ref().and_then(|planner| planner.fork());
        Self { mission, planner }
    }

    /// Flies a task, with the planner `shared` where none goes with it; nothing at the mission's end.
    ///
    /// # Errors
    /// When the planner gives no usable decision.
    pub(super) fn step(&mut self, shared: &mut dyn Planner) -> Result<Option<Imagined>, InProcessError> {
        let context = self.mission.context();
        let (decided, body) = (context.situation.now, context.situation.body);
        let planner: &mut dyn Planner = match &mut self.planner {
            Some(planner) => planner.as_mut(),
            None => shared,
        };
        let flown = self.mission.step(planner, Tick(u64::MAX))?;
        Ok(flown.map(|(settled, _)| Imagined { decided, body, record: settled.record }))
    }
}
