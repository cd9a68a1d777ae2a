//! Planning on the ground: the whole catalogue is known and there are minutes to think.
//!
//! [`plan`] seeks the best open-loop plan that it can find, [`OpenLoop`] flies it blindly, and [`upper_bound`] says what
//! no plan can exceed.

mod bound;
mod passes;
mod plan;
mod search;

pub use bound::upper_bound;
pub use plan::{Plan, PlannedTask};
pub use search::{GroundSettings, plan};

use crate::planner::{Decision, DecisionContext, Planner, PlannerError};

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
