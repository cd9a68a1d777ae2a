//! Iterative repair: planners as NASA flies them. CASPER repairs its plan on board all the time, ASPEN makes a whole
//! plan on the ground, which is then flown as it is (Rabideau et al. 1999; Chien et al. 2000).

mod methods;
mod schedule;
mod search;

use std::collections::VecDeque;

use super::decision::{Decision, DecisionContext, Planner, PlannerError, wait_for_a_window};
use super::lookahead::{Allowance, Experience};
use super::transitions::Transitions;
use crate::requests::catalogue::Candidate;
use crate::rng;
use crate::time::Tick;
use crate::vehicle::model::Model;
use crate::world::strip::StripId;
use schedule::{Activity, Memo, Problem, Schedule};
pub use search::Method;
use search::{greedy, improve, resolve};

/// Activities that begin within this time are committed to [s].
const COMMITTED_S: f64 = 60.0;
/// Closed-loop ticks that a decision on board may fly in the head.
const ON_BOARD: u64 = 40_000;
/// As many for a plan made on the ground.
const ON_GROUND: u64 = 400_000;
/// Disturbances of a plan for each decision on board, and for a plan on the ground.
const ROUNDS: u32 = 400;
const ROUNDS_ON_GROUND: u32 = 2000;
/// A plan made on the ground is flown for at most this time [s].
const BATCH_S: f64 = 600.0;
/// First guess of the reward rate: a strip of middling priority each 100 s [1/s].
const RATE: f64 = 0.5 / 100.0;
/// How fast the reward rate follows the plans made.
const RATE_STEP: f64 = 0.05;

/// What both planners share: transitions known, the reward rate of the plans so far, the seed.
#[derive(Clone, Debug)]
struct Desk {
    method: Method,
    seed: u64,
    memo: Memo,
    /// Reward per tick; none before the first plan.
    rate: Option<f64>,
}

/// How hard to think: ticks flown and disturbances.
#[derive(Clone, Copy, Debug)]
struct Effort {
    ticks: u64,
    rounds: u32,
}

impl Desk {
    fn new(method: Method, seed: u64) -> Self {
        Self { method, seed, memo: Memo::default(), rate: None }
    }

    fn forget(&mut self) {
        *self = Self::new(self.method, self.seed);
    }

    /// A plan for the candidates of a decision, beginning from what is left of an earlier one: the strips in their order,
    /// each with the tick at which imaging begins.
    fn plan(
        &mut self,
        context: &DecisionContext<'_>,
        allowance: &Allowance,
        effort: Effort,
        earlier: &[(StripId, Tick)],
    ) -> Vec<(usize, Tick)> {
        let model = context.model;
        let mut rng = rng::planner(self.seed, context.task);
        let transitions = Transitions::new(model, context.situation, allowance);
        let rate = self.rate.unwrap_or(RATE * model.period.seconds());
        let limits = (model.t_pre_max(), |seconds| model.period.ticks_ceil(seconds));
        let mut problem = Problem::new(context.candidates, transitions, limits, (rate, effort.ticks), &mut self.memo);
        let mut plan = Schedule(inherited(context.candidates, earlier));
        let committed = problem.begin().after(model.period.ticks_ceil(COMMITTED_S));
        plan.tighten(&mut problem, 0);
        if !resolve(&mut plan, &mut problem, &mut rng, 0) {
            plan = Schedule::default();
        }
        let fixed = plan.0.iter().filter(|it| it.start < committed).count();
        plan = greedy(&mut problem, plan, fixed, by_priority(context.candidates));
        plan = improve(&mut problem, &mut rng, (self.method, effort.rounds), plan, fixed);
        if let Some(last) = plan.0.last() {
            let reward: f64 = plan.0.iter().map(|it| context.candidates[it.goal].strip.priority).sum();
            let paid = reward / problem.end(last).since(problem.begin()).max(1) as f64;
            self.rate = Some(rate + RATE_STEP * (paid - rate));
        }
        plan.0.iter().map(|it| (it.goal, it.start)).collect()
    }
}

/// What is left of a plan: the strips that may still be imaged.
fn inherited(candidates: &[Candidate], earlier: &[(StripId, Tick)]) -> Vec<Activity> {
    let find = |&(id, start): &(StripId, Tick)| {
        let goal = candidates.iter().position(|it| it.id == id)?;
        Some(Activity { goal, start })
    };
    earlier.iter().filter_map(find).collect()
}

/// Goals by falling priority.
fn by_priority(candidates: &[Candidate]) -> impl Iterator<Item = usize> + use<> {
    let mut order: Vec<(f64, usize)> = candidates.iter().map(|it| it.strip.priority).zip(0..).collect();
    order.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    order.into_iter().map(|it| it.1)
}

/// Continuous planner on board, as CASPER.
///
/// At each decision the plan of the last one is brought up to date, its conflicts are repaired, what begins within a
/// minute is committed to, and the rest is made better as long as it may think. Then the first activity is flown in the
/// head and begun.
#[derive(Clone, Debug)]
pub struct Repair {
    desk: Desk,
    ticks: u64,
    experience: Experience,
    plan: Vec<(StripId, Tick)>,
}

impl Repair {
    /// A planner of a mission's seed.
    #[must_use]
    pub fn new(method: Method, seed: u64) -> Self {
        Self::with_budget(method, ON_BOARD, seed)
    }

    /// One that flies about `ticks` in the head for a decision.
    #[must_use]
    pub fn with_budget(method: Method, ticks: u64, seed: u64) -> Self {
        Self { desk: Desk::new(method, seed), ticks, experience: Experience::default(), plan: Vec::new() }
    }
}

impl Planner for Repair {
    fn name(&self) -> String {
        format!("repair{}", self.desk.method.ending())
    }

    fn fork(&self) -> Option<Box<dyn Planner + Send>> {
        Some(Box::new(self.clone()))
    }

    fn forget(&mut self) {
        self.desk.forget();
        self.experience.forget();
        self.plan.clear();
    }

    fn decide(&mut self, context: &DecisionContext<'_>) -> Result<Decision, PlannerError> {
        let allowance = self.experience.learn(context);
        let effort = Effort { ticks: self.ticks, rounds: ROUNDS };
        let plan = self.desk.plan(context, &allowance, effort, &self.plan);
        let mut transitions = Transitions::new(context.model, context.situation, &allowance);
        let begin = transitions.search.begin;
        let first = plan.iter().enumerate().find_map(|(at, &(goal, _))| {
            let found = transitions.search.shortest(&begin, &context.candidates[goal], u32::MAX)?;
            Some((at, Decision::Image { candidate: goal, t_pre: found.t_pre }))
        });
        let (kept, decision) = match first {
            Some((at, decision)) => (at + 1, decision),
            None => (0, wait_for_a_window(context)),
        };
        self.plan = plan[kept..].iter().map(|&(goal, start)| (context.candidates[goal].id, start)).collect();
        self.experience.remember(context, decision);
        Ok(decision)
    }
}

/// Planner on the ground, as ASPEN: it thinks long about all that is known, and its plan is flown as it is until the
/// next one.
#[derive(Clone, Debug)]
pub struct Aspen {
    desk: Desk,
    plan: VecDeque<(StripId, Tick)>,
    /// Tick up to which the plan is flown.
    until: Tick,
}

impl Aspen {
    /// A planner without a plan.
    #[must_use]
    pub fn new(method: Method, seed: u64) -> Self {
        Self { desk: Desk::new(method, seed), plan: VecDeque::new(), until: Tick(0) }
    }

    /// Makes a plan and flies it in the head, so that each activity begins as early as it can.
    fn renew(&mut self, context: &DecisionContext<'_>) {
        let (now, model) = (context.situation.now, context.model);
        let effort = Effort { ticks: ON_GROUND, rounds: ROUNDS_ON_GROUND };
        let plan = self.desk.plan(context, &Allowance::default(), effort, &[]);
        self.plan = flown(model, context, &plan);
        self.until = now.after(model.period.ticks_ceil(BATCH_S));
    }
}

/// Flies a plan in the head: what each strip's imaging begins at. Strips that fail are left out.
fn flown(model: &Model, context: &DecisionContext<'_>, plan: &[(usize, Tick)]) -> VecDeque<(StripId, Tick)> {
    let mut transitions = Transitions::new(model, context.situation, &Allowance::default());
    let mut at = transitions.search.begin;
    let mut tasks = VecDeque::new();
    for &(goal, _) in plan {
        let candidate = &context.candidates[goal];
        let Some(found) = transitions.search.shortest(&at, candidate, u32::MAX) else { continue };
        tasks.push_back((candidate.id, at.now.after(found.t_pre)));
        at = found.end;
    }
    tasks
}

impl Planner for Aspen {
    fn name(&self) -> String {
        format!("aspen{}", self.desk.method.ending())
    }

    fn fork(&self) -> Option<Box<dyn Planner + Send>> {
        Some(Box::new(self.clone()))
    }

    fn forget(&mut self) {
        self.desk.forget();
        self.plan.clear();
        self.until = Tick(0);
    }

    fn decide(&mut self, context: &DecisionContext<'_>) -> Result<Decision, PlannerError> {
        let now = context.situation.now;
        if self.plan.is_empty() || now >= self.until {
            self.renew(context);
        }
        while let Some((id, start)) = self.plan.pop_front() {
            let candidate = context.candidates.iter().position(|it| it.id == id);
            // Imaging begins at its time even if the transition begins late.
            let t_pre = start.since(now);
            if let Some(candidate) = candidate
                && (0..=i64::from(context.model.t_pre_max())).contains(&t_pre)
            {
                return Ok(Decision::Image { candidate, t_pre: t_pre as u32 });
            }
        }
        Ok(wait_for_a_window(context))
    }
}

#[cfg(test)]
mod tests;
