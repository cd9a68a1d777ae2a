//! The requests that a request manager keeps: those of the whole mission, or, where there is a radio, the ground's.

use swath_mission::orders::action::{Act, Review};
use swath_mission::orders::order::Order;
use swath_mission::requests::journal::Entry;
use swath_mission::requests::logic::{Contradiction, RequestLogic};
use swath_mission::requests::refusal::Refusal;
use swath_sim::world::strip::StripId;

use super::ground_end::GroundEnd;

/// The requests.
pub enum Book {
    /// Ground and satellite are one.
    Whole(Box<RequestLogic>),
    /// The satellite decides, and the ground learns of it.
    Ground(Box<GroundEnd>),
}

impl Book {
    /// The requests as they are known here.
    #[must_use]
    pub fn logic(&self) -> &RequestLogic {
        match self {
            Self::Whole(logic) => logic,
            Self::Ground(end) => end.ground().requests(),
        }
    }

    /// Whether something may be asked now, or the radio must be heard first.
    #[must_use]
    pub fn may_be_asked(&self) -> bool {
        match self {
            Self::Whole(_) => true,
            Self::Ground(end) => end.asking().is_some(),
        }
    }

    /// Takes a request; see [`RequestLogic::submit`].
    ///
    /// # Errors
    /// Why it is refused.
    pub fn submit(&mut self, order: Order) -> Result<StripId, Refusal> {
        match self {
            Self::Whole(logic) => logic.submit(order, logic.now()),
            Self::Ground(end) => {
                let actor = order.submitter.clone();
                end.ask(&actor, "", Act::Submit(StripId(0), Box::new(order)))
            }
        }
    }

    /// Takes a request in place of another one; see [`RequestLogic::replace`].
    ///
    /// # Errors
    /// Why it is refused at once.
    pub fn replace(&mut self, old: StripId, order: Order) -> Result<StripId, Refusal> {
        match self {
            Self::Whole(logic) => logic.replace(old, order, logic.now()),
            Self::Ground(end) => {
                let actor = order.submitter.clone();
                end.ask(&actor, "", Act::Replace(old, Box::new(order)))
            }
        }
    }

    /// Takes a request back; see [`RequestLogic::cancel`].
    ///
    /// # Errors
    /// Why it is refused at once.
    pub fn cancel(&mut self, id: StripId, actor: &str, reason: &str) -> Result<(), Refusal> {
        match self {
            Self::Whole(logic) => logic.cancel(id, actor, reason),
            Self::Ground(end) => end.ask(actor, reason, Act::Cancel(id)).map(drop),
        }
    }

    /// Decides on a request; see [`RequestLogic::review`].
    ///
    /// # Errors
    /// Why it is refused at once.
    pub fn review(&mut self, id: StripId, review: Review, actor: &str, reason: &str) -> Result<(), Refusal> {
        match self {
            Self::Whole(logic) => logic.review(id, review, actor, reason),
            Self::Ground(end) => end.ask(actor, reason, Act::Review(id, review)).map(drop),
        }
    }

    /// Lines of the journal since the last call.
    pub fn take_journal(&mut self) -> Vec<Entry> {
        match self {
            Self::Whole(logic) => logic.take_journal(),
            Self::Ground(end) => end.take_journal(),
        }
    }

    /// Changes that were reported since the last call and that the life cycle does not have.
    pub fn take_contradictions(&mut self) -> Vec<Contradiction> {
        match self {
            Self::Whole(logic) => logic.take_contradictions(),
            Self::Ground(end) => end.ground_mut().take_contradictions(),
        }
    }
}
