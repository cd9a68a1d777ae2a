//! The paper's heuristic: a fixed transition time, and the best priority per second among what is feasible.

use super::decision::{Decision, DecisionContext, Planner, PlannerError, wait};

/// Fixed-T heuristic (section V.A).
#[derive(Clone, Debug)]
pub struct Heuristic {
    /// Transition time T [s].
    pub t_pre_s: f64,
}

impl Planner for Heuristic {
    fn name(&self) -> String {
        format!("heuristic:{}", self.t_pre_s)
    }

    fn fork(&self) -> Option<Box<dyn Planner + Send>> {
        Some(Box::new(self.clone()))
    }

    fn decide(&mut self, context: &DecisionContext<'_>) -> Result<Decision, PlannerError> {
        let t_pre = context.model.period.ticks_ceil(self.t_pre_s);
        let start = context.situation.now.after(t_pre);
        let mut best: Option<(f64, usize)> = None;
        for (i, candidate) in context.candidates.iter().enumerate() {
            if candidate.window.contains(start) {
                let ratio = candidate.strip.priority / f64::from(candidate.t_acq + t_pre);
                if best.is_none_or(|(greatest, _)| ratio > greatest) {
                    best = Some((ratio, i));
                }
            }
        }
        Ok(match best {
            Some((_, candidate)) => Decision::Image { candidate, t_pre },
            // Nothing is feasible: wait until the first window is open at now + T.
            None => wait(
                context,
                context.candidates.iter().filter(|c| c.window.close > start).map(|c| c.window.open.since(start)),
            ),
        })
    }
}
