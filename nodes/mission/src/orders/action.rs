//! What was asked for and taken: the part of a mission that its file does not tell.

use serde::{Deserialize, Serialize};
use swath_sim::time::Tick;
use swath_sim::world::strip::StripId;

use crate::approval::Mode;
use crate::orders::order::Order;

/// Something that was asked for and taken.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Action {
    /// Simulated time at which it counted.
    pub at: Tick,
    /// Whether it counted before the mission's first decision.
    pub initial: bool,
    /// Who asked for it.
    pub actor: String,
    /// Why, in words.
    pub reason: String,
    /// What was asked for.
    pub act: Act,
}

/// What an operator decides on a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Review {
    /// A held request is accepted.
    Release,
    /// A held request is refused.
    Reject,
    /// An accepted request is held.
    Hold,
}

/// What can be asked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Act {
    /// A strip, under the number that it got.
    Submit(StripId, Box<Order>),
    /// A request is taken back.
    Cancel(StripId),
    /// A request is held, released or rejected.
    Review(StripId, Review),
    /// A request takes the place of another one.
    Replace(StripId, Box<Order>),
    /// What the planner may do by itself.
    SetMode(Mode),
    /// A proposal of the planner is approved, or not.
    Decide {
        /// Its number.
        proposal: u64,
        /// Whether it is approved.
        approve: bool,
    },
}
