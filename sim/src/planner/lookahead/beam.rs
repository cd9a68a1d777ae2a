//! A planner that flies sequences of tasks in its head and begins the one that pays most per second.

use super::super::decision::{Decision, DecisionContext, Planner, PlannerError, wait_for_a_window};
use super::experience::{Allowance, Experience};
use super::meter::Prices;
use super::search::Search;
use crate::requests::catalogue::Candidate;
use crate::vehicle::flight::Situation;

/// Beam search planner.
#[derive(Clone, Debug, Default)]
pub struct Beam {
    search: BeamSearch,
    experience: Experience,
}

/// Beam search over sequences of candidates, each with the shortest transition that succeeds.
///
/// A sequence is worth the sum of its priorities over the time it takes. The search is cut off after a number of ticks
/// flown in the head, not after a time, so that the same situation always gives the same decision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BeamSearch {
    /// Sequences kept at each length.
    pub width: usize,
    /// Tasks of a sequence.
    pub depth: usize,
    /// Closed-loop ticks after which the best sequence found so far must do.
    pub budget: u64,
}

impl Default for BeamSearch {
    fn default() -> Self {
        Self { width: 8, depth: 3, budget: 120_000 }
    }
}

/// Tasks flown in the head, one after the other.
#[derive(Clone, Debug)]
pub struct Sequence {
    /// Indices of the candidates imaged.
    pub imaged: Vec<usize>,
    /// When each was imaged, since the start [ticks].
    pub ends: Vec<u32>,
    /// Transition of the first task [ticks].
    pub first_t_pre: u32,
    /// Sum of the priorities, less what energy and data cost.
    pub reward: f64,
    /// Time that it takes [ticks].
    pub elapsed: u32,
    /// Where it ends.
    pub end: Situation,
}

impl Sequence {
    fn new(begin: Situation) -> Self {
        Self { imaged: Vec::new(), ends: Vec::new(), first_t_pre: 0, reward: 0.0, elapsed: 0, end: begin }
    }

    /// Priority per tick.
    #[must_use]
    pub fn ratio(&self) -> f64 {
        self.reward / f64::from(self.elapsed)
    }

    /// Greatest ratio that imaging one more candidate of some worth could give.
    fn bound(&self, candidate: &Candidate, worth: f64, earliest: u32) -> f64 {
        (self.reward + worth) / f64::from(self.elapsed + earliest + candidate.t_acq)
    }
}

impl Beam {
    /// A planner with no experience yet.
    #[must_use]
    pub fn new(search: BeamSearch) -> Self {
        Self { search, experience: Experience::default() }
    }
}

impl Planner for Beam {
    fn name(&self) -> String {
        "beam".to_owned()
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
        let best = self.search.sequences(context, &allowance).into_iter().next();
        let decision = best.map_or_else(
            || wait_for_a_window(context),
            |best| Decision::Image { candidate: best.imaged[0], t_pre: best.first_t_pre },
        );
        self.experience.remember(context, decision);
        Ok(decision)
    }
}

impl BeamSearch {
    /// The best sequences, best first, of at least one task each; none when nothing can be imaged now.
    #[must_use]
    pub fn sequences(&self, context: &DecisionContext<'_>, allowance: &Allowance) -> Vec<Sequence> {
        let mut search = Search::new(context.model, context.situation, allowance);
        self.priced(&mut search, context.candidates, &Prices::default())
    }

    /// The same where energy and data have a price; `search` measures energy where that is not nothing.
    #[must_use]
    pub fn priced(&self, search: &mut Search<'_>, candidates: &[Candidate], prices: &Prices) -> Vec<Sequence> {
        let mut beam = vec![Sequence::new(search.begin)];
        for _ in 0..self.depth {
            let mut next = Vec::new();
            for sequence in &beam {
                self.extend(search, (candidates, prices), sequence, &mut next);
            }
            if next.is_empty() {
                break;
            }
            beam = next;
        }
        beam.retain(|sequence| !sequence.imaged.is_empty());
        beam
    }

    /// Adds the best continuations of a sequence to `next`, which stays sorted and no longer than the beam is wide.
    fn extend(
        &self,
        search: &mut Search<'_>,
        (candidates, prices): (&[Candidate], &Prices),
        so_far: &Sequence,
        next: &mut Vec<Sequence>,
    ) {
        for (bound, i) in order(search, (candidates, prices), so_far) {
            let out_of_budget = search.ticks >= self.budget && !next.is_empty();
            let floor = next.get(self.width - 1).map_or(0.0, Sequence::ratio);
            if bound <= floor || out_of_budget {
                break;
            }
            let candidate = &candidates[i];
            let reward = so_far.reward + worth(search, candidate, prices);
            // A longer transition would give a lower ratio than that of the last sequence kept.
            let affordable = if floor > 0.0 { (reward / floor) as u32 } else { u32::MAX };
            let longest = affordable.saturating_sub(so_far.elapsed + candidate.t_acq);
            let Some(found) = search.shortest(&so_far.end, candidate, longest) else { continue };
            let mut longer = so_far.clone();
            if longer.imaged.is_empty() {
                longer.first_t_pre = found.t_pre;
            }
            longer.imaged.push(i);
            longer.reward = reward - prices.joule * found.taken_j;
            longer.elapsed += found.t_pre + candidate.t_acq;
            longer.ends.push(longer.elapsed);
            longer.end = found.end;
            let at = next.partition_point(|other| other.ratio() >= longer.ratio());
            next.insert(at, longer);
            next.truncate(self.width);
        }
    }
}

/// Priority of a candidate, less what its data cost.
fn worth(search: &Search<'_>, candidate: &Candidate, prices: &Prices) -> f64 {
    let bits = search.meter().map_or(0.0, |meter| meter.bits(candidate.t_acq));
    if bits > prices.room { 0.0 } else { candidate.strip.priority - prices.bit * bits }
}

/// Candidates that a sequence could go on with, the most promising first, with the greatest ratio that each could give.
fn order(search: &Search<'_>, (candidates, prices): (&[Candidate], &Prices), so_far: &Sequence) -> Vec<(f64, usize)> {
    let is_paid = |i: usize| so_far.imaged.iter().any(|&j| i == j || candidates[i].twin == Some(candidates[j].id));
    let left = candidates.iter().enumerate().filter(|(i, _)| !is_paid(*i));
    let mut order: Vec<(f64, usize)> = left
        .filter_map(|(i, candidate)| {
            let (earliest, _) = search.starts(so_far.end.now, candidate)?;
            Some((so_far.bound(candidate, worth(search, candidate, prices), earliest), i))
        })
        .collect();
    order.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    order
}
