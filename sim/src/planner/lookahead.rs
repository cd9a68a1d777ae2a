//! A planner that flies each candidate in its head: the shortest transition that succeeds, then the best priority per
//! second.

use super::{Decision, DecisionContext, Planner, PlannerError, wait};
use crate::catalogue::Candidate;
use crate::flight::{Flight, Situation};
use crate::guidance::Task;
use crate::model::Model;
use crate::time::Tick;

/// Lookahead planner.
///
/// Transitions are not guessed: the closed loop is flown from the present state, for the candidates in the order of what
/// they could pay at best, until none that is left could pay more than the best one found.
#[derive(Clone, Debug, Default)]
pub struct Lookahead {
    /// Added to each transition found, against errors of the model [ticks].
    pub margin: u32,
}

/// The transition is settled once the attitude error is below this share of its limit.
const SETTLED_SHARE: f64 = 0.8;
/// Flights that a search for one transition may take.
const TRIALS: u32 = 6;
/// Where the search for a transition begins [s].
const FIRST_GUESS_S: f64 = 40.0;

impl Planner for Lookahead {
    fn name(&self) -> String {
        if self.margin == 0 { "lookahead".to_owned() } else { format!("lookahead:{}", self.margin) }
    }

    fn decide(&mut self, context: &DecisionContext<'_>) -> Result<Decision, PlannerError> {
        let mut search = Search::new(context, self.margin);
        let mut order: Vec<_> = context
            .candidates
            .iter()
            .enumerate()
            .filter_map(|(i, candidate)| {
                let (earliest, _) = search.starts(candidate)?;
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
            if let Some(t_pre) = search.shortest(candidate, floor) {
                let paid = ratio(candidate, t_pre);
                if best.is_none() || paid > floor {
                    best = Some((paid, i, t_pre));
                }
            }
        }
        Ok(match best {
            Some((_, candidate, t_pre)) => Decision::Image { candidate, t_pre },
            None => {
                let now = context.situation.now;
                let latest = now.after(context.model.t_pre_max());
                wait(context, context.candidates.iter().map(|c| c.window.open.since(latest).max(1)))
            }
        })
    }
}

/// Priority per tick.
fn ratio(candidate: &Candidate, t_pre: u32) -> f64 {
    candidate.strip.priority / f64::from(candidate.t_acq + t_pre)
}

/// Flights in the planner's head from one situation.
struct Search<'a> {
    situation: &'a Situation,
    model: &'a Model,
    flight: Flight,
    margin: u32,
    sigma_max: f64,
}

impl<'a> Search<'a> {
    fn new(context: &DecisionContext<'a>, margin: u32) -> Self {
        Self {
            situation: context.situation,
            model: context.model,
            flight: Flight::predicted(context.model, context.situation),
            margin,
            sigma_max: context.model.config.imaging.sigma_max,
        }
    }

    /// Shortest and longest transition after which the candidate's window is open [ticks].
    fn starts(&self, candidate: &Candidate) -> Option<(u32, u32)> {
        let now = self.situation.now;
        let earliest = candidate.window.open.since(now).max(0);
        let latest = candidate.window.close.since(now).min(i64::from(self.model.t_pre_max()));
        (earliest <= latest).then_some((earliest as u32, latest as u32))
    }

    /// The shortest transition found with which the strip is imaged, if it pays more than `floor` per tick.
    ///
    /// A flight with transition T tells when its attitude error is settled. That hardly depends on T, so it is the next
    /// T to try.
    fn shortest(&mut self, candidate: &Candidate, floor: f64) -> Option<u32> {
        let (earliest, latest) = self.starts(candidate)?;
        // A longer transition would pay less than what is already found.
        let affordable = if floor > 0.0 { (candidate.strip.priority / floor) as u32 } else { u32::MAX };
        let latest = latest.min(affordable.saturating_sub(candidate.t_acq));
        if latest < earliest {
            return None;
        }
        let mut guess = self.model.period.ticks_ceil(FIRST_GUESS_S).clamp(earliest, latest);
        let mut too_short: Option<u32> = None;
        let mut found = None;
        for _ in 0..TRIALS {
            let settled = self.settling(candidate, guess, latest);
            let next = match settled {
                Some(settled) if settled + self.margin <= guess => {
                    found = Some(guess);
                    (settled + self.margin).max(earliest).max(too_short.map_or(0, |short| short + 1))
                }
                Some(settled) => {
                    too_short = Some(guess);
                    (settled + self.margin).max(guess + 1)
                }
                None => {
                    too_short = Some(guess);
                    // It does not settle in time from here: try the longest transition before giving up.
                    latest
                }
            };
            let done = match found {
                Some(found) => next >= found,
                None => next > latest || too_short == Some(latest),
            };
            if done {
                break;
            }
            guess = next;
        }
        found.filter(|&t_pre| self.succeeds(candidate, t_pre))
    }

    /// Ticks after which the attitude error stays within its limit, in a flight with this transition; `None` when it is
    /// not settled `latest` ticks from now.
    fn settling(&mut self, candidate: &Candidate, t_pre: u32, latest: u32) -> Option<u32> {
        self.begin(candidate, t_pre);
        let limit = self.sigma_max * self.sigma_max;
        let well_within = limit * SETTLED_SHARE * SETTLED_SHARE;
        let mut settled = 0;
        for tick in 0..=latest {
            let error = self.flight.tick().error.sigma_BR.norm_squared();
            if error >= limit {
                settled = tick + 1;
            } else if error < well_within && tick >= t_pre {
                break;
            }
        }
        (settled <= latest).then_some(settled)
    }

    /// Whether the whole task succeeds.
    fn succeeds(&mut self, candidate: &Candidate, t_pre: u32) -> bool {
        self.flight.rewind(self.situation);
        let task = Task::Image { strip: candidate.strip, t_pre, t_acq: candidate.t_acq };
        self.flight.fly(task, Tick(u64::MAX)).failure.is_none()
    }

    fn begin(&mut self, candidate: &Candidate, t_pre: u32) {
        self.flight.rewind(self.situation);
        let task = Task::Image { strip: candidate.strip, t_pre, t_acq: candidate.t_acq };
        self.flight.guidance.start(task, self.situation.now, &self.situation.body);
    }
}
