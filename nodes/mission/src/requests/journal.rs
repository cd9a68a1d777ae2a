//! What the request manager writes down: requests as they came, every change of them, every attempt.

use serde::{Deserialize, Serialize};
use swath_sim::task::FailureReason;
use swath_sim::time::Tick;
use swath_sim::world::strip::StripId;
use swath_sim::world::windows::Window;

use super::lifecycle::State;
use super::reason_number::Reason;
use crate::orders::action::Action;
use crate::orders::order::Order;

/// A line of the journal.
#[derive(Clone, Debug, PartialEq)]
pub enum Entry {
    /// A request got a number; the change that says what became of it follows.
    Added(Box<Added>),
    /// A request changed.
    Changed(Change),
    /// An attempt ended.
    Attempted(Attempt),
    /// Something that was asked for was taken.
    Taken(Box<Action>),
    /// What the ground's end of the radio was told, as bytes; all else follows from it.
    Told(Vec<u8>),
}

/// A request that got a number.
#[derive(Clone, Debug, PartialEq)]
pub struct Added {
    /// Its number.
    pub id: StripId,
    /// What was asked for.
    pub order: Order,
    /// Its start windows.
    pub windows: Vec<Window>,
    /// When.
    pub tick: Tick,
    /// The same strip scanned the other way.
    pub linked: Option<StripId>,
    /// The request that it replaces.
    pub supersedes: Option<StripId>,
    /// Number of the order that it is a strip of.
    pub order_id: StripId,
}

/// A change of a request.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Change {
    /// The request; 0 for one that was refused.
    pub id: StripId,
    /// State that it has now.
    pub state: State,
    /// Why, and in words.
    pub reason: (Reason, String),
    /// Who made the change.
    pub actor: String,
    /// When.
    pub tick: Tick,
    /// What follows the request around.
    pub standing: Standing,
    /// What was asked for, when it was refused.
    pub refused: Option<Box<Order>>,
}

/// What a request has gone through so far.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Standing {
    /// Attempts flown.
    pub attempts: u32,
    /// Attempts that count against the most allowed: not those that were cut short.
    pub counted: u32,
    /// Reward earned.
    pub reward: f64,
    /// Tick at which imaging starts or started last; 0 when it was never planned.
    pub imaging: Tick,
    /// The request that replaces it.
    pub superseded_by: Option<StripId>,
}

/// How an attempt ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Outcome {
    /// Imaged.
    Succeeded,
    /// Not imaged within the limits.
    Failed(FailureReason),
    /// The request was no longer wanted.
    Cancelled,
}

/// An attempt that has ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Attempt {
    /// The strip.
    pub id: StripId,
    /// Number of the task.
    pub task: u64,
    /// First tick.
    pub start: Tick,
    /// Last tick.
    pub end: Tick,
    /// Transition [ticks].
    pub t_pre: u32,
    /// Acquisition [ticks].
    pub t_acq: u32,
    /// How it went.
    pub outcome: Outcome,
    /// Largest ‖σ_BR‖ while imaging.
    pub max_attitude_error: f64,
    /// Least elevation while imaging [rad].
    pub min_elevation: f64,
    /// Reward earned.
    pub reward: f64,
}

/// How far the mission has come, as far as the request manager knows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Progress {
    /// Simulated time.
    pub now: Tick,
    /// Imaging tasks below this number are settled.
    pub settled: u64,
    /// The task under way that images a strip.
    pub in_flight: Option<InFlight>,
}

/// A task that images a strip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InFlight {
    /// Number of the task.
    pub task: u64,
    /// The strip.
    pub id: StripId,
    /// Tick at which it starts.
    pub start: Tick,
    /// Transition [ticks].
    pub t_pre: u32,
    /// Acquisition [ticks].
    pub t_acq: u32,
}
