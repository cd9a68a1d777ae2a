//! A plan: tasks with their times.

use crate::time::Tick;
use crate::world::strip::StripId;

/// An imaging task with its time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlannedTask {
    /// The strip.
    pub strip: StripId,
    /// Tick at which the transition begins.
    pub begin: Tick,
    /// Transition time T_pre [ticks].
    pub t_pre: u32,
    /// Acquisition time T_acq [ticks].
    pub t_acq: u32,
}

impl PlannedTask {
    /// Tick at which imaging begins.
    #[must_use]
    pub fn imaging(&self) -> Tick {
        self.begin.after(self.t_pre)
    }

    /// Tick at which the task ends.
    #[must_use]
    pub fn end(&self) -> Tick {
        self.imaging().after(self.t_acq)
    }
}

/// Tasks in the order of their times.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plan {
    /// The tasks.
    pub tasks: Vec<PlannedTask>,
    /// Sum of the priorities when every task succeeds.
    pub reward: f64,
    /// Closed-loop ticks that were flown to find it.
    pub ticks: u64,
}
