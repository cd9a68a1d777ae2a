//! What was asked for and taken: the part of a mission that its file does not tell.

use swath_sim::time::Tick;
use swath_sim::world::strip::StripId;

use crate::approval::Mode;
use crate::orders::geojson::NamedRequest;
use crate::requests::logic::Review;

/// Something that was asked for and taken.
#[derive(Clone, Debug, PartialEq)]
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

/// What can be asked for.
#[derive(Clone, Debug, PartialEq)]
pub enum Act {
    /// A strip, under the number that it got.
    Submit(StripId, Box<NamedRequest>),
    /// A request is taken back.
    Cancel(StripId),
    /// A request is held, released or rejected.
    Review(StripId, Review),
    /// A request takes the place of another one.
    Replace(StripId, Box<NamedRequest>),
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
