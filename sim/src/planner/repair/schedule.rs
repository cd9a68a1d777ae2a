//! A plan as iterative repair sees it: activities with times, the conflicts among them, and what it is worth.

use std::collections::BTreeMap;

use super::super::transitions::Transitions;
use crate::requests::catalogue::Candidate;
use crate::time::Tick;
use crate::vehicle::flight::Situation;
use crate::world::strip::StripId;

/// Ends of imaging within this many ticks of each other share their transitions.
const BUCKET: u64 = 20;
/// Transition with which a flight looks for the time to settle [s].
const GUESS_S: f64 = 25.0;

/// Transition times that were flown: from the strip imaged before and its end, to the strip to come.
#[derive(Clone, Debug, Default)]
pub(super) struct Memo(BTreeMap<(u64, StripId, StripId), Option<u32>>);

impl Memo {
    /// Forgets what began before a tick.
    pub(super) fn forget(&mut self, before: Tick) {
        self.0 = self.0.split_off(&(before.0 / BUCKET, StripId(0), StripId(0)));
    }
}

/// An activity: imaging of a goal from a tick on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Activity {
    /// Index of the goal.
    pub goal: usize,
    /// Tick at which imaging begins.
    pub start: Tick,
}

/// What is wrong with an activity of a plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Conflict {
    /// It cannot begin before its window closes, given the activity before it.
    Window,
    /// The transition before it is too short, or its window has closed by then; it could begin at this tick.
    Time(Tick),
    /// The same strip, or its twin, is planned before.
    Double,
}

/// A plan.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Schedule(pub(super) Vec<Activity>);

/// What is to be planned.
pub(super) struct Problem<'a, 'm> {
    pub goals: &'a [Candidate],
    pub transitions: Transitions<'a>,
    /// What a tick is worth.
    pub rate: f64,
    /// Ticks that may be flown.
    pub budget: u64,
    begin: Situation,
    /// No transition is longer [ticks].
    longest: u32,
    guess: u32,
    /// From the beginning, which no other decision shares.
    first: BTreeMap<StripId, Option<u32>>,
    memo: &'m mut Memo,
}

impl<'a, 'm> Problem<'a, 'm> {
    pub(super) fn new(
        goals: &'a [Candidate],
        transitions: Transitions<'a>,
        (longest, guess_ticks): (u32, impl Fn(f64) -> u32),
        (rate, budget): (f64, u64),
        memo: &'m mut Memo,
    ) -> Self {
        let begin = transitions.search.begin;
        memo.forget(begin.now);
        let guess = guess_ticks(GUESS_S);
        Self { goals, transitions, rate, budget, begin, longest, guess, first: BTreeMap::new(), memo }
    }

    /// Whether all ticks that may be flown have been.
    pub(super) fn exhausted(&self) -> bool {
        self.transitions.search.ticks >= self.budget
    }

    pub(super) fn end(&self, activity: &Activity) -> Tick {
        activity.start.after(self.goals[activity.goal].t_acq)
    }

    /// Tick at which the plan's first transition may begin.
    pub(super) fn begin(&self) -> Tick {
        self.begin.now
    }

    /// Whether two goals are one strip.
    pub(super) fn same(&self, a: usize, b: usize) -> bool {
        a == b || self.goals[a].twin == Some(self.goals[b].id)
    }

    /// Earliest tick at which imaging of a goal can begin after an activity, or from the beginning.
    pub(super) fn arrival(&mut self, before: Option<&Activity>, goal: usize) -> Option<Tick> {
        let candidate = &self.goals[goal];
        let free = before.map_or(self.begin.now, |it| self.end(it));
        if candidate.window.close < free {
            return None;
        }
        let start = free.after(self.transition(before, goal)?).max(candidate.window.open);
        (start <= candidate.window.close).then_some(start)
    }

    fn transition(&mut self, before: Option<&Activity>, goal: usize) -> Option<u32> {
        let candidate = &self.goals[goal];
        let (from, known) = match before {
            None => (self.begin, self.first.get(&candidate.id)),
            Some(it) => {
                let key = (self.end(it).0 / BUCKET, self.goals[it.goal].id, candidate.id);
                (self.begin, self.memo.0.get(&key))
            }
        };
        if let Some(known) = known {
            return *known;
        }
        let from = before.map_or(from, |it| self.transitions.imaged(&self.goals[it.goal], it.start));
        let flown = self.transitions.search.settling(&from, candidate, self.guess, self.longest);
        match before {
            None => self.first.insert(candidate.id, flown),
            Some(it) => self.memo.0.insert((self.end(it).0 / BUCKET, self.goals[it.goal].id, candidate.id), flown),
        };
        flown
    }
}

impl Schedule {
    /// The activity before position `at`.
    pub(super) fn before(&self, at: usize) -> Option<&Activity> {
        self.0.get(at.checked_sub(1)?)
    }

    /// Whether a goal, or its twin, is planned.
    pub(super) fn serves(&self, problem: &Problem<'_, '_>, goal: usize) -> bool {
        self.0.iter().any(|it| problem.same(it.goal, goal))
    }

    /// What is wrong at a position.
    pub(super) fn conflict(&self, problem: &mut Problem<'_, '_>, at: usize) -> Option<Conflict> {
        let activity = self.0[at];
        if self.0[..at].iter().any(|it| problem.same(it.goal, activity.goal)) {
            return Some(Conflict::Double);
        }
        let close = problem.goals[activity.goal].window.close;
        let start = problem.arrival(self.before(at), activity.goal);
        start.map_or(Some(Conflict::Window), |start| {
            (start > activity.start || activity.start > close).then_some(Conflict::Time(start))
        })
    }

    /// Every conflict, in order of time.
    pub(super) fn conflicts(&self, problem: &mut Problem<'_, '_>) -> Vec<(usize, Conflict)> {
        (0..self.0.len()).filter_map(|at| Some((at, self.conflict(problem, at)?))).collect()
    }

    /// Begins each activity from `from` on as early as the ones before allow; one that cannot begin at all stays as it is.
    pub(super) fn tighten(&mut self, problem: &mut Problem<'_, '_>, from: usize) {
        for at in from..self.0.len() {
            if let Some(start) = problem.arrival(self.before(at), self.0[at].goal) {
                self.0[at].start = start;
            }
        }
    }

    /// Priorities less what the time is worth; anything is better than nothing.
    pub(super) fn score(&self, problem: &Problem<'_, '_>) -> f64 {
        let Some(last) = self.0.last() else { return f64::NEG_INFINITY };
        let reward: f64 = self.0.iter().map(|it| problem.goals[it.goal].strip.priority).sum();
        reward - problem.rate * problem.end(last).since(problem.begin()) as f64
    }
}
