//! Repair methods: what can be done about a conflict, and about a goal that is left out.

use rand::RngExt;

use super::schedule::{Activity, Conflict, Problem, Schedule};
use crate::rng::Rng;

/// How often each method is tried where it applies.
const MOVE_WEIGHT: u32 = 6;
const SWAP_WEIGHT: u32 = 2;
const TWIN_WEIGHT: u32 = 3;
const DELETE_WEIGHT: u32 = 3;

#[derive(Clone, Copy)]
enum Method {
    Move,
    Swap,
    Twin,
    Delete,
}

impl Schedule {
    /// Does something about the conflict at a position; activities before `fixed` stay where they are unless they are
    /// impossible.
    pub(super) fn repair(
        &mut self,
        problem: &mut Problem<'_, '_>,
        rng: &mut Rng,
        at: usize,
        why: Conflict,
        fixed: usize,
    ) {
        if why == Conflict::Double {
            self.0.remove(at);
            return;
        }
        let twin = self.twin(problem, at);
        let movable = at > fixed;
        let methods = [
            (Method::Move, if matches!(why, Conflict::Time(_)) { MOVE_WEIGHT } else { 0 }),
            (Method::Swap, if movable { SWAP_WEIGHT } else { 0 }),
            (Method::Twin, if twin.is_some() { TWIN_WEIGHT } else { 0 }),
            (Method::Delete, DELETE_WEIGHT),
        ];
        match (draw(&methods, rng), why, twin) {
            (Method::Move, Conflict::Time(start), _) => self.0[at].start = start,
            (Method::Swap, ..) => {
                self.0.swap(at - 1, at);
                self.tighten(problem, at - 1);
            }
            (Method::Twin, _, Some(twin)) => {
                self.0[at].goal = twin;
                self.tighten(problem, at);
            }
            _ => self.delete(problem, at, movable),
        }
    }

    /// Takes the activity that pays least per tick out of the two in conflict.
    fn delete(&mut self, problem: &Problem<'_, '_>, at: usize, movable: bool) {
        let pay = |it: &Activity| {
            let goal = &problem.goals[it.goal];
            goal.strip.priority / f64::from(goal.t_acq.max(1))
        };
        let culprit = if movable && pay(&self.0[at - 1]) < pay(&self.0[at]) { at - 1 } else { at };
        self.0.remove(culprit);
    }

    /// The twin of the goal at a position, if it is one of the goals.
    fn twin(&self, problem: &Problem<'_, '_>, at: usize) -> Option<usize> {
        let goal = self.0[at].goal;
        (0..problem.goals.len()).find(|&other| other != goal && problem.same(other, goal))
    }

    /// Puts a goal where it pays most, after the first `fixed` activities; what follows may then be in conflict.
    /// Nothing where it fits nowhere.
    pub(super) fn add(&mut self, problem: &mut Problem<'_, '_>, goal: usize, fixed: usize) -> bool {
        let mut best: Option<(f64, usize, Activity)> = None;
        for at in fixed..=self.0.len() {
            let Some(start) = problem.arrival(self.before(at), goal) else { continue };
            let activity = Activity { goal, start };
            let end = problem.end(&activity);
            let cost = match self.0.get(at).copied() {
                None => end.since(self.before(at).map_or(problem.begin(), |it| problem.end(it))) as f64 * problem.rate,
                Some(next) => match problem.arrival(Some(&activity), next.goal) {
                    Some(later) => later.since(next.start).max(0) as f64 * problem.rate,
                    // It would take the next one's place.
                    None => problem.goals[next.goal].strip.priority,
                },
            };
            if best.is_none_or(|(least, ..)| cost < least) {
                best = Some((cost, at, activity));
            }
        }
        let Some((_, at, activity)) = best else { return false };
        self.0.insert(at, activity);
        true
    }

    /// A goal that is left out, the more likely the higher its priority.
    pub(super) fn left_out(&self, problem: &Problem<'_, '_>, rng: &mut Rng) -> Option<usize> {
        let open: Vec<usize> = (0..problem.goals.len()).filter(|&goal| !self.serves(problem, goal)).collect();
        let weight = |&goal: &usize| problem.goals[goal].strip.priority;
        let total: f64 = open.iter().map(weight).sum();
        let mut left = rng.random_range(0.0..1.0) * total;
        open.iter()
            .find(|goal| {
                left -= weight(goal);
                left <= 0.0
            })
            .or(open.last())
            .copied()
    }
}

fn draw(methods: &[(Method, u32)], rng: &mut Rng) -> Method {
    let total: u32 = methods.iter().map(|(_, weight)| weight).sum();
    let mut left = rng.random_range(0..total);
    for &(method, weight) in methods {
        if left < weight {
            return method;
        }
        left -= weight;
    }
    Method::Delete
}
