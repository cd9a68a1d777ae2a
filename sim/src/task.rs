//! Tasks, how they went, and totals over them.

use std::f64::consts::FRAC_PI_2;

use serde::{Deserialize, Serialize};

use crate::time::Tick;
use crate::world::strip::{Strip, StripId};

/// What the satellite is asked to do next. All durations are whole ticks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Task {
    /// Slew for `t_pre` ticks, then image the strip for `t_acq` ticks.
    Image {
        /// Identity of the strip in the mission.
        id: StripId,
        /// The strip.
        strip: Strip,
        /// Transition time T_pre [ticks].
        t_pre: u32,
        /// Acquisition time T_acq [ticks].
        t_acq: u32,
    },
    /// Hold the attitude that the satellite has at the start.
    Wait {
        /// Length [ticks].
        ticks: u32,
    },
    /// See to power, data or momentum.
    Serve {
        /// What is done.
        duty: Duty,
        /// Length [ticks].
        ticks: u32,
    },
}

/// What the satellite does for itself; only where its resources have bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Duty {
    /// Point the solar array at the Sun.
    Charge,
    /// Point a body-fixed antenna at the Earth's centre, and send in contact.
    Downlink,
    /// Point the solar array at the Sun, and take momentum out of the wheels by thrusters.
    Desaturate,
}

impl Task {
    /// Length of the task [ticks].
    #[must_use]
    pub fn ticks(&self) -> u32 {
        match *self {
            Self::Image { t_pre, t_acq, .. } => t_pre + t_acq,
            Self::Wait { ticks } | Self::Serve { ticks, .. } => ticks,
        }
    }

    /// The strip that it images; `None` for a task without one.
    #[must_use]
    pub fn strip(&self) -> Option<StripId> {
        match *self {
            Self::Image { id, .. } => Some(id),
            Self::Wait { .. } | Self::Serve { .. } => None,
        }
    }

    /// What it does for the satellite itself; `None` for an image or a wait.
    #[must_use]
    pub fn duty(&self) -> Option<Duty> {
        match *self {
            Self::Serve { duty, .. } => Some(duty),
            Self::Image { .. } | Self::Wait { .. } => None,
        }
    }
}

/// Why a task brought no image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FailureReason {
    /// The attitude error exceeded its limit while imaging (eq. 13).
    Attitude,
    /// The satellite was too low over the target's horizon while imaging (eq. 12).
    Elevation,
    /// The task was cut short.
    Interrupted,
}

/// How a task went.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TaskOutcome {
    /// `None` when the strip was imaged, or for a wait.
    pub failure: Option<FailureReason>,
    /// Largest ‖σ_BR‖ while imaging; 0 when imaging did not begin.
    pub max_attitude_error: f64,
    /// Least elevation while imaging [rad]; π/2 when imaging did not begin.
    pub min_elevation: f64,
}

impl TaskOutcome {
    /// Outcome of a task that never began.
    pub const NOT_BEGUN: Self =
        Self { failure: Some(FailureReason::Interrupted), max_attitude_error: 0.0, min_elevation: FRAC_PI_2 };
}

/// A task as it was flown.
#[derive(Clone, Debug, PartialEq)]
pub struct TaskRecord {
    /// Number of the task, from 0.
    pub task: u64,
    /// Tick at which it began; a planning delay lies before it.
    pub start: Tick,
    /// Tick at which it ended.
    pub end: Tick,
    /// The strip, or `None` for a task without one.
    pub strip: Option<StripId>,
    /// What was done instead, or `None` for an image or a wait.
    pub duty: Option<Duty>,
    /// Transition time T_pre [ticks]; 0 for a wait.
    pub t_pre: u32,
    /// Acquisition time T_acq [ticks]; 0 for a wait.
    pub t_acq: u32,
    /// How it went.
    pub outcome: TaskOutcome,
}

impl TaskRecord {
    /// The record of task `number`, flown from `start` to `end`.
    #[must_use]
    pub fn new(number: u64, task: &Task, start: Tick, end: Tick, outcome: TaskOutcome) -> Self {
        let (t_pre, t_acq) = match *task {
            Task::Image { t_pre, t_acq, .. } => (t_pre, t_acq),
            Task::Wait { .. } | Task::Serve { .. } => (0, 0),
        };
        Self { task: number, start, end, strip: task.strip(), duty: task.duty(), t_pre, t_acq, outcome }
    }

    /// Whether a strip was imaged.
    #[must_use]
    pub fn success(&self) -> bool {
        self.strip.is_some() && self.outcome.failure.is_none()
    }

    /// Length [ticks].
    #[must_use]
    pub fn ticks(&self) -> u32 {
        self.end.since(self.start) as u32
    }
}

/// A task whose reward has been settled by whoever keeps the requests.
#[derive(Clone, Debug, PartialEq)]
pub struct SettledTask {
    /// The task as it was flown.
    pub record: TaskRecord,
    /// The strip's priority when this fulfilled it, else 0.
    pub reward: f64,
}

/// Totals over the tasks of a mission.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Totals {
    /// Tasks that tried to image a strip and were not cut short.
    pub attempts: u64,
    /// Strips imaged.
    pub fulfilled: u64,
    /// Sum of the priorities of the strips imaged.
    pub reward: f64,
    /// Ticks spent on transitions of attempts.
    pub t_pre_ticks: u64,
    /// Ticks spent imaging in attempts.
    pub t_acq_ticks: u64,
    /// Ticks spent waiting, and on power, data and momentum.
    pub wait_ticks: u64,
    /// Attempts that failed for attitude.
    pub failed_attitude: u64,
    /// Attempts that failed for elevation.
    pub failed_elevation: u64,
}

impl Totals {
    /// Counts a task.
    pub fn add(&mut self, settled: &SettledTask) {
        let record = &settled.record;
        self.reward += settled.reward;
        if record.strip.is_none() {
            self.wait_ticks += u64::from(record.ticks());
            return;
        }
        match record.outcome.failure {
            Some(FailureReason::Interrupted) => return,
            Some(FailureReason::Attitude) => self.failed_attitude += 1,
            Some(FailureReason::Elevation) => self.failed_elevation += 1,
            None => self.fulfilled += 1,
        }
        self.attempts += 1;
        self.t_pre_ticks += u64::from(record.t_pre);
        self.t_acq_ticks += u64::from(record.t_acq);
    }

    /// Share of the attempts that succeeded; NaN without attempts.
    #[must_use]
    pub fn success_rate(&self) -> f64 {
        self.fulfilled as f64 / self.attempts as f64
    }
}
