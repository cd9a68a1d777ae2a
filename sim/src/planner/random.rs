//! The paper's random policy: a uniform strip and a uniform transition time.

use rand::RngExt;

use super::decision::{Decision, DecisionContext, Planner, PlannerError, wait};
use crate::rng;

/// Random policy (section V.A).
///
/// Each task draws from a stream of its own, so that the planner has no state to lose when it is restarted.
#[derive(Clone, Debug)]
pub struct Random {
    /// Seed of the mission.
    pub seed: u64,
}

impl Planner for Random {
    fn name(&self) -> String {
        "random".to_owned()
    }

    fn fork(&self) -> Option<Box<dyn Planner + Send>> {
        Some(Box::new(self.clone()))
    }

    fn decide(&mut self, context: &DecisionContext<'_>) -> Result<Decision, PlannerError> {
        if context.candidates.is_empty() {
            return Ok(wait(context, std::iter::empty()));
        }
        let mut rng = rng::planner(self.seed, context.task);
        Ok(Decision::Image {
            candidate: rng.random_range(0..context.candidates.len()),
            t_pre: rng.random_range(0..=context.model.t_pre_max()),
        })
    }
}
