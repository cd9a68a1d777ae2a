//! What the ground's end is told, in order: whoever is told the same again is where it was, to the bit.

use serde::{Deserialize, Serialize};
use swath_sim::time::Tick;
use swath_sim::world::strip::StripId;

use super::end::Sent;
use super::ground::Ground;
use crate::orders::action::Action;
use crate::requests::refusal::Refusal;

/// What the ground is told.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Told {
    /// A frame is heard at a tick.
    Heard(Tick, Vec<u8>),
    /// Something is asked of it at its `at`.
    Asked(Action),
    /// The radio is open at a tick: it may send.
    Open(Tick),
}

/// What comes of it.
#[derive(Clone, Debug, PartialEq)]
pub enum Answer {
    /// Nothing that others must know at once.
    Nothing,
    /// The request that was asked for, or that something was asked of; or why it is refused.
    Asked(Result<Option<StripId>, Refusal>),
    /// Frames that leave.
    Sent(Vec<Sent>),
}

impl Told {
    /// When.
    #[must_use]
    pub fn at(&self) -> Tick {
        match self {
            Self::Heard(tick, _) | Self::Open(tick) => *tick,
            Self::Asked(action) => action.at,
        }
    }

    /// As bytes of a store.
    #[must_use]
    pub fn encode(&self) -> Vec<u8> {
        // Only a writer that is full could fail, and a vector is not.
        postcard::to_allocvec(self).unwrap_or_default()
    }

    /// From bytes of a store; nothing where they are damaged.
    #[must_use]
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        postcard::from_bytes(bytes).ok()
    }
}

impl Ground {
    /// Tells it something.
    pub fn tell(&mut self, told: &Told) -> Answer {
        match told {
            Told::Heard(now, frame) => {
                self.hear(*now, frame);
                Answer::Nothing
            }
            Told::Asked(action) => Answer::Asked(self.ask(action.clone(), action.at)),
            Told::Open(now) => Answer::Sent(self.transmit(*now)),
        }
    }
}
