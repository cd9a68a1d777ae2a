//! What a decision rests on, what it is, and who makes it.

use thiserror::Error;

use crate::requests::catalogue::Candidate;
use crate::task::{Duty, Task, TaskRecord};
use crate::vehicle::flight::Situation;
use crate::vehicle::health::lost;
use crate::vehicle::model::Model;

/// Everything that a decision rests on.
#[derive(Clone, Copy, Debug)]
pub struct DecisionContext<'a> {
    /// Number of the task to decide, from 0.
    pub task: u64,
    /// The satellite now.
    pub situation: &'a Situation,
    /// The next N strips by closing time of their windows; at most `planning.candidates`.
    pub candidates: &'a [Candidate],
    /// The task that ended here, and how; none at a mission's first decision.
    pub previous: Option<&'a TaskRecord>,
    /// Constants of the mission.
    pub model: &'a Model,
}

/// What to do next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decision {
    /// Image a candidate.
    Image {
        /// Index into the candidates.
        candidate: usize,
        /// Transition time T_pre [ticks].
        t_pre: u32,
    },
    /// Hold attitude.
    Wait {
        /// For how long [ticks], at least 1.
        ticks: u32,
    },
    /// See to power, data or momentum.
    Serve {
        /// What is done.
        duty: Duty,
        /// For how long [ticks], at least 1.
        ticks: u32,
    },
}

/// Why a planner gave no usable decision.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum PlannerError {
    /// The candidate does not exist.
    #[error("candidate {candidate} was chosen of {count}")]
    NoSuchCandidate {
        /// Index chosen.
        candidate: usize,
        /// Number of candidates.
        count: usize,
    },
    /// The transition is longer than allowed.
    #[error("a transition of {t_pre} ticks was chosen, the longest is {max}")]
    TransitionTooLong {
        /// T_pre chosen [ticks].
        t_pre: u32,
        /// Longest allowed [ticks].
        max: u32,
    },
    /// A wait of no ticks would never end.
    #[error("a wait of 0 ticks was chosen")]
    EmptyWait,
    /// Power, data and momentum have no bounds in this mission.
    #[error("{duty:?} was chosen, but the mission has no [resources]")]
    NoResources {
        /// What was chosen.
        duty: Duty,
    },
    /// The policy itself failed.
    #[error("policy failed: {0}")]
    Policy(String),
}

impl Decision {
    /// The task of this decision.
    ///
    /// # Errors
    /// When the decision is not one that the context allows.
    pub fn to_task(self, context: &DecisionContext<'_>) -> Result<Task, PlannerError> {
        match self {
            Self::Image { candidate, t_pre } => {
                let count = context.candidates.len();
                let chosen =
                    context.candidates.get(candidate).ok_or(PlannerError::NoSuchCandidate { candidate, count })?;
                let max = context.model.t_pre_max();
                if t_pre > max {
                    return Err(PlannerError::TransitionTooLong { t_pre, max });
                }
                Ok(Task::Image { id: chosen.id, strip: chosen.strip, t_pre, t_acq: chosen.t_acq })
            }
            Self::Wait { ticks: 0 } | Self::Serve { ticks: 0, .. } => Err(PlannerError::EmptyWait),
            Self::Wait { ticks } => Ok(Task::Wait { ticks }),
            Self::Serve { duty, .. } if context.model.config.resources.is_none() => {
                Err(PlannerError::NoResources { duty })
            }
            Self::Serve { duty, ticks } => Ok(Task::Serve { duty, ticks }),
        }
    }
}

/// What a planner that weighs its candidates says of a decision.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rationale {
    /// Probability of each candidate, in their order; entries beyond the candidates are padding.
    pub probabilities: Vec<f32>,
    /// Expected return as the critic sees it.
    pub value: f32,
    /// SHA-256 of the policy, in hexadecimal.
    pub policy: String,
}

/// A planner. The same context and the same planner state give the same decision.
pub trait Planner {
    /// Name in tables and records, such as `heuristic:90`.
    fn name(&self) -> String;

    /// Decides what to do next.
    ///
    /// # Errors
    /// When no usable decision could be made.
    fn decide(&mut self, context: &DecisionContext<'_>) -> Result<Decision, PlannerError>;

    /// Forgets what it has learned from the tasks before, as one that is made anew.
    fn forget(&mut self) {}

    /// Why another planner made the last decision in its place.
    fn replaced(&self) -> Option<&str> {
        None
    }

    /// Whether it plans with the wheels that the situation says are left.
    fn minds_wheels(&self) -> bool {
        false
    }

    /// Whether it sees to data by itself, so that the shield sees to battery and momentum alone.
    fn minds_resources(&self) -> bool {
        false
    }

    /// Why it decided as it last did; nothing from a planner that does not weigh candidates.
    fn rationale(&self) -> Option<Rationale> {
        None
    }

    /// Another one that goes on from here as this one would; none from a planner that cannot be doubled.
    fn fork(&self) -> Option<Box<dyn Planner + Send>> {
        None
    }
}

/// How long to wait when there is no candidate at all [s].
const EMPTY_CATALOGUE_WAIT_S: f64 = 60.0;

/// Waits until the first of `ticks_to_wait`, or a minute when there is none; new requests are seen after that.
pub(super) fn wait(context: &DecisionContext<'_>, ticks_to_wait: impl Iterator<Item = i64>) -> Decision {
    let longest = context.model.period.ticks_ceil(EMPTY_CATALOGUE_WAIT_S).max(1);
    let ticks = ticks_to_wait.min().map_or(longest, |ticks| ticks.clamp(1, i64::from(longest)) as u32);
    Decision::Wait { ticks }
}

/// Shortest wait when nothing can be imaged with a wheel lost [s].
const REST_S: f64 = 10.0;

/// Nothing can be imaged now: waits until a window comes within reach.
#[must_use]
pub fn wait_for_a_window(context: &DecisionContext<'_>) -> Decision {
    let latest = context.situation.now.after(context.model.t_pre_max());
    // With a wheel lost, strips in reach may be out of what can be pointed: the satellite comes to rest meanwhile.
    let least = if lost(&context.situation.wheels) { context.model.period.ticks_ceil(REST_S).max(1) } else { 1 };
    wait(context, context.candidates.iter().map(|c| c.window.open.since(latest).max(i64::from(least))))
}
