//! A plan, and the planner that follows it.

use crate::planner::{Decision, DecisionContext, Planner, PlannerError};
use crate::time::Tick;
use crate::world::strip::StripId;

/// An imaging task with its time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlannedTask {
    /// The strip.
    pub strip: StripId,
    /// Tick at which the transition begins.
    pub begin: Tick,
    /// Transition time T_pre [ticks].
    pub t_pre: u32,
    /// Acquisition time T_acq [ticks].
    pub t_acq: u32,
}

impl PlannedTask {
    /// Tick at which imaging begins.
    #[must_use]
    pub fn imaging(&self) -> Tick {
        self.begin.after(self.t_pre)
    }

    /// Tick at which the task ends.
    #[must_use]
    pub fn end(&self) -> Tick {
        self.imaging().after(self.t_acq)
    }
}

/// Tasks in the order of their times.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plan {
    /// The tasks.
    pub tasks: Vec<PlannedTask>,
    /// Sum of the priorities when every task succeeds.
    pub reward: f64,
    /// Closed-loop ticks that were flown to find it.
    pub ticks: u64,
}

/// Flies a plan as it is, whatever happens: each strip is imaged at its time or not at all.
///
/// Its mission must offer as many candidates as the plan chose from: see [`CANDIDATES`].
#[derive(Clone, Debug)]
pub struct OpenLoop {
    tasks: std::collections::VecDeque<PlannedTask>,
}

/// `planning.candidates` of a mission that flies a plan: more strips than are in reach at any time.
pub const CANDIDATES: usize = 1000;

impl OpenLoop {
    /// A planner that follows a plan.
    #[must_use]
    pub fn new(plan: &Plan) -> Self {
        Self { tasks: plan.tasks.iter().copied().collect() }
    }
}

impl Planner for OpenLoop {
    fn name(&self) -> String {
        "ground-plan".to_owned()
    }

    fn decide(&mut self, context: &DecisionContext<'_>) -> Result<Decision, PlannerError> {
        let now = context.situation.now;
        while let Some(task) = self.tasks.front().copied() {
            let early = task.begin.since(now);
            if early > 0 {
                return Ok(Decision::Wait { ticks: early.min(i64::from(u32::MAX)) as u32 });
            }
            self.tasks.pop_front();
            let candidate = context.candidates.iter().position(|candidate| candidate.id == task.strip);
            // Imaging begins at its time even if the transition begins late.
            let left = task.imaging().since(now);
            if let Some(candidate) = candidate
                && left >= 0
            {
                return Ok(Decision::Image { candidate, t_pre: left as u32 });
            }
        }
        Ok(Decision::Wait { ticks: context.model.t_pre_max() })
    }
}
