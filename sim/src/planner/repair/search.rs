//! Searches for a better plan: by iterative repair, by annealing, and by the squeaky wheel.

use rand::RngExt;

use super::schedule::{Problem, Schedule};
use crate::rng::Rng;

/// The earliest conflict is repaired first, but for this share, in which it is any.
const ANY_CONFLICT: f64 = 0.1;
/// Repairs that a disturbed plan may take for each of its activities before it is given up.
const REPAIRS: usize = 4;
/// Share of the disturbances that take an activity out instead of putting a goal in.
const TAKEN_OUT: f64 = 0.15;
/// Share of the worse plans that iterative repair goes on from.
const WORSE_TAKEN: f64 = 0.05;
/// Loss that annealing takes with a probability of 1/e at its beginning; it falls to nothing in a straight line.
const HOT: f64 = 0.2;
/// By how much a squeaky wheel gets louder each time.
const SQUEAK: f64 = 0.25;
/// Share of the disturbances after which the squeaky wheel builds its plan anew.
const ROUND: u32 = 20;

/// How better plans are sought.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// Iterative repair, as ASPEN and CASPER do it: goals are put in, conflicts repaired one after the other.
    #[default]
    Repair,
    /// The same moves, accepted as simulated annealing does.
    Annealing,
    /// Squeaky-wheel optimisation: plans are built greedily, and what was left out comes earlier the next time.
    Squeaky,
}

impl Method {
    /// What it adds to a planner's name.
    #[must_use]
    pub fn ending(self) -> &'static str {
        match self {
            Self::Repair => "",
            Self::Annealing => "-annealing",
            Self::Squeaky => "-squeaky",
        }
    }
}

/// Makes a plan without conflicts better, as long as ticks may be flown and at most `rounds` times; activities before
/// `fixed` stay. The result is without conflicts and no worse than what it began with.
pub(super) fn improve(
    problem: &mut Problem<'_, '_>,
    rng: &mut Rng,
    (method, rounds): (Method, u32),
    begin: Schedule,
    fixed: usize,
) -> Schedule {
    match method {
        Method::Squeaky => squeaky(problem, rounds.div_ceil(ROUND), begin, fixed),
        Method::Repair => local(problem, rng, rounds, begin, fixed, |_, _, rng| rng.random_bool(WORSE_TAKEN)),
        Method::Annealing => local(problem, rng, rounds, begin, fixed, |loss, left, rng| {
            rng.random_range(0.0..1.0) < libm::exp(-loss / (HOT * left).max(1e-9))
        }),
    }
}

/// Stochastic local search. `accept` is asked of a worse plan: its loss, and the share of the rounds that is left.
fn local(
    problem: &mut Problem<'_, '_>,
    rng: &mut Rng,
    rounds: u32,
    begin: Schedule,
    fixed: usize,
    accept: impl Fn(f64, f64, &mut Rng) -> bool,
) -> Schedule {
    let mut current = (begin.score(problem), begin);
    let mut best = current.clone();
    for round in 0..rounds {
        if problem.exhausted() {
            break;
        }
        let mut next = current.1.clone();
        if !disturb(&mut next, problem, rng, fixed) || !resolve(&mut next, problem, rng, fixed) {
            continue;
        }
        next.tighten(problem, fixed);
        let score = next.score(problem);
        let left = f64::from(rounds - round) / f64::from(rounds);
        if score >= current.0 || accept(current.0 - score, left, rng) {
            current = (score, next);
        }
        if current.0 > best.0 && current.1.conflicts(problem).is_empty() {
            best = current.clone();
        }
    }
    best.1
}

/// Puts a goal in or takes an activity out; whether anything was done.
fn disturb(plan: &mut Schedule, problem: &mut Problem<'_, '_>, rng: &mut Rng, fixed: usize) -> bool {
    if plan.0.len() > fixed && rng.random_bool(TAKEN_OUT) {
        let at = rng.random_range(fixed..plan.0.len());
        plan.0.remove(at);
        plan.tighten(problem, at);
        return true;
    }
    let Some(goal) = plan.left_out(problem, rng) else { return false };
    plan.add(problem, goal, fixed)
}

/// Repairs conflicts until there are none; whether that came about.
pub(super) fn resolve(plan: &mut Schedule, problem: &mut Problem<'_, '_>, rng: &mut Rng, fixed: usize) -> bool {
    for _ in 0..=REPAIRS * plan.0.len() {
        let conflicts = plan.conflicts(problem);
        if conflicts.is_empty() {
            return true;
        }
        let which = if rng.random_bool(ANY_CONFLICT) { rng.random_range(0..conflicts.len()) } else { 0 };
        let (at, why) = conflicts[which];
        plan.repair(problem, rng, at, why, fixed);
    }
    false
}

/// Builds plans greedily in an order that learns from what they left out.
fn squeaky(problem: &mut Problem<'_, '_>, rounds: u32, begin: Schedule, fixed: usize) -> Schedule {
    let prefix = Schedule(begin.0[..fixed.min(begin.0.len())].to_vec());
    let pay = |goal: &crate::requests::catalogue::Candidate| goal.strip.priority / f64::from(goal.t_acq.max(1));
    let mut order: Vec<(f64, usize)> = problem.goals.iter().map(pay).zip(0..).collect();
    let mut best = (begin.score(problem), begin);
    for _ in 0..rounds {
        if problem.exhausted() {
            break;
        }
        order.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let plan = greedy(problem, prefix.clone(), fixed, order.iter().map(|it| it.1));
        for (loudness, goal) in &mut order {
            if !plan.serves(problem, *goal) {
                *loudness *= 1.0 + SQUEAK * problem.goals[*goal].strip.priority;
            }
        }
        let score = plan.score(problem);
        if score > best.0 {
            best = (score, plan);
        }
    }
    best.1
}

/// Puts goals in one after the other wherever each pays and disturbs nothing.
pub(super) fn greedy(
    problem: &mut Problem<'_, '_>,
    mut plan: Schedule,
    fixed: usize,
    goals: impl Iterator<Item = usize>,
) -> Schedule {
    for goal in goals {
        if plan.serves(problem, goal) || problem.exhausted() {
            continue;
        }
        let mut longer = plan.clone();
        if longer.add(problem, goal, fixed) {
            longer.tighten(problem, fixed);
            if longer.score(problem) > plan.score(problem) && longer.conflicts(problem).is_empty() {
                plan = longer;
            }
        }
    }
    plan
}
