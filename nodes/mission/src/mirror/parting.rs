//! Where flight and prediction part, and why.

use std::f64::consts::TAU;

use swath_sim::time::Tick;
use swath_sim::world::strip::StripId;

/// A place where the flight was not as predicted.
#[derive(Clone, Debug, PartialEq)]
pub struct Parting {
    /// Number of the first imaging task that was not as predicted.
    pub task: u64,
    /// When it began in flight.
    pub at: Tick,
    /// From when on the prediction had flown in the head: the epoch, or the housekeeping that it rested on.
    pub since: Tick,
    /// Strip that was flown.
    pub flown: StripId,
    /// Strip that was predicted for the task; none where it was to wait.
    pub predicted: Option<StripId>,
    /// Why.
    pub cause: Cause,
}

/// Why flight and prediction have parted, as far as what came down tells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cause {
    /// A request was taken up on board at another time, because frames were lost.
    Radio {
        /// The request.
        id: StripId,
        /// When it was taken up.
        on_board: Tick,
        /// When it was predicted to be; none for later than what was predicted so far.
        predicted: Option<Tick>,
    },
    /// The satellite pointed elsewhere when a task was decided.
    Attitude {
        /// Number of the task.
        task: u64,
        /// By how much [rad].
        angle: f64,
    },
    /// Imaging held its attitude otherwise: the satellite is not as its model says.
    Tracking {
        /// Number of the task.
        task: u64,
        /// Greatest attitude error, ‖σ_BR‖, in flight.
        flown: f64,
        /// The same in the prediction.
        predicted: f64,
    },
    /// Nothing else differed: the planner decided otherwise, or did not decide.
    Decision,
}

impl Cause {
    /// In words; `time` says when a tick is.
    #[must_use]
    pub fn text(&self, time: impl Fn(Tick) -> String) -> String {
        match self {
            Self::Radio { id, on_board, predicted } => {
                let predicted = predicted.map_or("later".to_owned(), &time);
                format!("request {} was on board at {}, predicted was {predicted}", id.0, time(*on_board))
            }
            Self::Attitude { task, angle } => {
                format!("the attitude at task {task} was {:.3}° from what was predicted", angle / TAU * 360.0)
            }
            Self::Tracking { task, flown, predicted } => format!(
                "the greatest attitude error of task {task} was {flown:.5}, predicted was {predicted:.5}: the satellite \
                 is not as its model says"
            ),
            Self::Decision => "the planner decided otherwise on the same, or did not decide".to_owned(),
        }
    }
}

impl Parting {
    /// In words; `time` says when a tick is.
    #[must_use]
    pub fn text(&self, time: impl Fn(Tick) -> String) -> String {
        let predicted = match self.predicted {
            Some(id) if id == self.flown => format!("strip {} otherwise than predicted", self.flown.0),
            Some(id) => format!("strip {} where {} was predicted", self.flown.0, id.0),
            None => format!("strip {} where a wait was predicted", self.flown.0),
        };
        format!("task {} at {} was {predicted}: {}", self.task, time(self.at), self.cause.text(&time))
    }
}
