//! What a planner learns of the satellite from how its own tasks went.

use super::super::decision::{Decision, DecisionContext};
use crate::task::FailureReason;
use crate::time::Tick;
use crate::world::strip::StripId;

/// By how much weaker the wheels are taken to be after a failure, as a share of their torque limit.
const STEP: f64 = 0.02;
/// Share of failures at which the weakness neither grows nor shrinks in the long run.
const FAILURES_AIMED_AT: f64 = 0.005;
/// Greatest weakness: beyond it something else is wrong than the margin.
const WEAKNESS_MAX: f64 = 0.4;
/// Longest delay that is believed [ticks].
const DELAY_MAX: i64 = 240;

/// What flights in the head allow for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Allowance {
    /// Added to each transition found [ticks].
    pub ticks: u32,
    /// Share of the wheels' torque limit that is not counted on.
    pub weakness: f64,
    /// Time from the situation to the start of the task decided on it, in which the attitude is held [ticks].
    pub delay: u32,
}

/// A planner's experience: how late its decisions take effect, and the margin that its transitions need.
///
/// The margin is a weakness: transitions are sought with wheels weaker than the model's. A slew that is limited by
/// torque, by what gyroscopic torque leaves of it, or by inertia takes longer in proportion, so that one number fits
/// short transitions and long ones, where a number of seconds does not. Each failure for attitude raises it by a step,
/// each success lowers it by so much less that failures settle at a small share (the update of adaptive conformal
/// inference, Gibbs & Candès 2021). As long as nothing fails there is no margin.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Experience {
    fixed: Option<u32>,
    weakness: f64,
    delay: u32,
    decided: Option<Decided>,
}

/// A decision that was made.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Decided {
    task: u64,
    now: Tick,
    strip: Option<StripId>,
    t_pre: u32,
}

impl Experience {
    /// One that learns nothing: a fixed number of ticks is added to each transition.
    #[must_use]
    pub fn fixed(ticks: u32) -> Self {
        Self { fixed: Some(ticks), ..Self::default() }
    }

    /// Forgets what it has learned; a margin that is fixed stays.
    pub fn forget(&mut self) {
        *self = Self { fixed: self.fixed, ..Self::default() };
    }

    /// The fixed margin, if it is one [ticks].
    #[must_use]
    pub fn margin(&self) -> Option<u32> {
        self.fixed
    }

    /// Learns from the task that ended here, if it was decided by this planner, and says what to allow for now.
    pub fn learn(&mut self, context: &DecisionContext<'_>) -> Allowance {
        if let Some(ticks) = self.fixed {
            return Allowance { ticks, ..Allowance::default() };
        }
        if let (Some(previous), Some(decided)) = (context.previous, self.decided.take())
            && (previous.task, previous.strip, previous.t_pre) == (decided.task, decided.strip, decided.t_pre)
        {
            self.delay = previous.start.since(decided.now).clamp(0, DELAY_MAX) as u32;
            if previous.strip.is_some() {
                self.adapt(previous.outcome.failure);
            }
        }
        // The first failure shows that the model is not exact: then a tick is no sure bound either.
        Allowance { ticks: u32::from(self.weakness > 0.0), weakness: self.weakness, delay: self.delay }
    }

    fn adapt(&mut self, failure: Option<FailureReason>) {
        let change = match failure {
            Some(FailureReason::Attitude) => STEP * (1.0 - FAILURES_AIMED_AT),
            None => -STEP * FAILURES_AIMED_AT,
            // No margin helps against a window that was missed or a task that was cut short.
            Some(FailureReason::Elevation | FailureReason::Interrupted) => 0.0,
        };
        self.weakness = (self.weakness + change).clamp(0.0, WEAKNESS_MAX);
    }

    /// Remembers what was decided.
    pub fn remember(&mut self, context: &DecisionContext<'_>, decision: Decision) {
        let (strip, t_pre) = match decision {
            Decision::Image { candidate, t_pre } => (context.candidates.get(candidate).map(|it| it.id), t_pre),
            Decision::Wait { .. } | Decision::Serve { .. } => (None, 0),
        };
        self.decided = Some(Decided { task: context.task, now: context.situation.now, strip, t_pre });
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use proptest::prelude::*;

    use super::*;
    use crate::config::SimConfig;
    use crate::learn::episode::{Env, EpisodeConfig};
    use crate::task::{TaskOutcome, TaskRecord};
    use crate::vehicle::model::Model;

    fn env() -> Env {
        let episode = EpisodeConfig { orbits: 0.1, ..EpisodeConfig::default() };
        Env::episode(Arc::new(Model::new(SimConfig::default()).unwrap()), &episode, 2)
    }

    /// The record of a decision's task, `delay` ticks late.
    fn record(context: &DecisionContext<'_>, t_pre: u32, delay: u32, failure: Option<FailureReason>) -> TaskRecord {
        let start = context.situation.now.after(delay);
        TaskRecord {
            task: context.task,
            start,
            end: start.after(t_pre),
            strip: Some(context.candidates[0].id),
            duty: None,
            t_pre,
            t_acq: 0,
            outcome: TaskOutcome { failure, ..TaskOutcome::NOT_BEGUN },
        }
    }

    proptest! {
        #[test]
        fn failures_raise_the_margin_and_successes_never_take_it_below_none(outcomes in prop::collection::vec(0..3u8, 1..200)) {
            let env = env();
            let context = env.context();
            let mut experience = Experience::default();
            let mut before = experience.learn(&context);
            prop_assert_eq!(before, Allowance::default());
            for outcome in outcomes {
                let failure = [None, Some(FailureReason::Attitude), Some(FailureReason::Elevation)][usize::from(outcome)];
                experience.remember(&context, Decision::Image { candidate: 0, t_pre: 50 });
                let previous = record(&context, 50, 0, failure);
                let now = experience.learn(&DecisionContext { previous: Some(&previous), ..context });
                prop_assert!((0.0..=WEAKNESS_MAX).contains(&now.weakness));
                prop_assert_eq!(now.ticks > 0, now.weakness > 0.0);
                match outcome {
                    0 => prop_assert!(now.weakness <= before.weakness),
                    1 => prop_assert!(now.weakness > before.weakness || now.weakness == WEAKNESS_MAX),
                    _ => prop_assert_eq!(now.weakness, before.weakness),
                }
                before = now;
            }
        }
    }

    #[test]
    fn it_learns_the_delay_and_only_from_its_own_tasks() {
        let env = env();
        let context = env.context();
        let failure = Some(FailureReason::Attitude);
        let learned = |experience: &mut Experience, previous: &TaskRecord| {
            experience.learn(&DecisionContext { previous: Some(previous), ..context })
        };
        let mut experience = Experience::default();
        let late = record(&context, 50, 3, failure);
        assert_eq!(learned(&mut experience, &late), Allowance::default(), "nothing was decided yet");
        experience.remember(&context, Decision::Image { candidate: 0, t_pre: 60 });
        assert_eq!(learned(&mut experience, &late), Allowance::default(), "another transition was decided");
        experience.remember(&context, Decision::Image { candidate: 0, t_pre: 50 });
        let allowance = learned(&mut experience, &late);
        assert_eq!((allowance.ticks, allowance.delay), (1, 3));
        assert_eq!(learned(&mut experience, &late), allowance, "a task is learned from once");
        let mut fixed = Experience::fixed(4);
        fixed.remember(&context, Decision::Image { candidate: 0, t_pre: 50 });
        assert_eq!(learned(&mut fixed, &late), Allowance { ticks: 4, ..Allowance::default() });
    }
}
