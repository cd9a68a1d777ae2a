//! Who decides in the place of a planner that is away.

use super::decision::{Decision, DecisionContext, Planner, PlannerError};

/// Holds the attitude.
#[derive(Clone, Copy, Debug)]
pub struct Nobody {
    /// For how long [ticks].
    pub ticks: u32,
}

impl Planner for Nobody {
    fn name(&self) -> String {
        "nobody".to_owned()
    }

    fn decide(&mut self, _: &DecisionContext<'_>) -> Result<Decision, PlannerError> {
        Ok(Decision::Wait { ticks: self.ticks })
    }
}
