//! A planner that flies each candidate in its head: the shortest transition that succeeds, then the best priority per
//! second.

use super::super::decision::{Decision, DecisionContext, Planner, PlannerError, wait_for_a_window};
use super::experience::{Allowance, Experience};
use super::search::Search;
use crate::requests::catalogue::Candidate;

/// Lookahead planner.
///
/// Transitions are not guessed: the closed loop is flown from the present state, for the candidates in the order of what
/// they could pay at best, until none that is left could pay more than the best one found.
#[derive(Clone, Debug, Default)]
pub struct Lookahead {
    experience: Experience,
}

impl Lookahead {
    /// A planner with a margin that it does not adapt [ticks].
    #[must_use]
    pub fn with_margin(ticks: u32) -> Self {
        Self { experience: Experience::fixed(ticks) }
    }
}

impl Planner for Lookahead {
    fn name(&self) -> String {
        self.experience.margin().map_or_else(|| "lookahead".to_owned(), |ticks| format!("lookahead:{ticks}"))
    }

    fn fork(&self) -> Option<Box<dyn Planner + Send>> {
        Some(Box::new(self.clone()))
    }

    fn forget(&mut self) {
        self.experience.forget();
    }

    fn minds_wheels(&self) -> bool {
        true
    }

    fn decide(&mut self, context: &DecisionContext<'_>) -> Result<Decision, PlannerError> {
        let allowance = self.experience.learn(context);
        let decision = best(context, &allowance);
        self.experience.remember(context, decision);
        Ok(decision)
    }
}

/// The candidate with the best priority per second, after the shortest transition that succeeds.
fn best(context: &DecisionContext<'_>, allowance: &Allowance) -> Decision {
    let mut search = Search::new(context.model, context.situation, allowance);
    let from = search.begin;
    let mut order: Vec<_> = context
        .candidates
        .iter()
        .enumerate()
        .filter_map(|(i, candidate)| {
            let (earliest, _) = search.starts(from.now, candidate)?;
            Some((ratio(candidate, earliest), i))
        })
        .collect();
    order.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut best: Option<(f64, usize, u32)> = None;
    for (bound, i) in order {
        let floor = best.map_or(0.0, |(paid, ..)| paid);
        if best.is_some() && bound <= floor {
            break;
        }
        let candidate = &context.candidates[i];
        // A longer transition would pay less than what is already found.
        let affordable = if floor > 0.0 { (candidate.strip.priority / floor) as u32 } else { u32::MAX };
        if let Some(found) = search.shortest(&from, candidate, affordable.saturating_sub(candidate.t_acq)) {
            let paid = ratio(candidate, found.t_pre);
            if best.is_none() || paid > floor {
                best = Some((paid, i, found.t_pre));
            }
        }
    }
    match best {
        Some((_, candidate, t_pre)) => Decision::Image { candidate, t_pre },
        None => wait_for_a_window(context),
    }
}

/// Priority per tick.
fn ratio(candidate: &Candidate, t_pre: u32) -> f64 {
    candidate.strip.priority / f64::from(candidate.t_acq + t_pre)
}
