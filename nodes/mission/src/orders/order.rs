//! An order: what is asked for, by whom, under which names and conditions.

use serde::{Deserialize, Serialize};
use swath_sim::world::strip::StripRequest;

/// A request with the names that its submitter gave it, and its conditions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Order {
    /// Submitter's own reference; empty without one.
    pub client_ref: String,
    /// Who submits.
    pub submitter: String,
    /// Name for people.
    pub name: String,
    /// What is asked for.
    pub request: StripRequest,
    /// Simulated time before which imaging may not start [ns since 1970-01-01 UTC]; 0 for any.
    pub valid_from_ns: u64,
    /// Simulated time after which imaging may not end [ns since 1970-01-01 UTC]; 0 for any.
    pub valid_until_ns: u64,
    /// Whether it waits for an operator's approval.
    pub hold_for_approval: bool,
    /// Attempts before it fails; 0 for the mission's default.
    pub max_attempts: u32,
    /// The line or area that it is a strip of; none if it is an order of its own.
    pub part: Option<Part>,
}

/// Which strip of a line or area it is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Part {
    /// Reference of the whole, the same for all of its strips.
    pub order_ref: String,
    /// Number of the strip in it, from 1.
    pub number: u32,
    /// How many strips it has.
    pub of: u32,
    /// Share of the worth of the whole [1]: the strip's priority is that of the whole times this.
    pub share: f64,
}

/// Submitter of the strips that a mission knows from the start.
pub const MISSION: &str = "mission";

impl Order {
    /// A request of the mission's own, without conditions.
    #[must_use]
    pub fn new(client_ref: String, name: String, request: StripRequest) -> Self {
        Self {
            client_ref,
            submitter: MISSION.to_owned(),
            name,
            request,
            valid_from_ns: 0,
            valid_until_ns: 0,
            hold_for_approval: false,
            max_attempts: 0,
            part: None,
        }
    }

    /// Whether it asks for the same as one that is known, of which, if it is bidirectional, the other direction may have
    /// been kept. What both are parts of does not matter.
    #[must_use]
    pub fn is_for_the_same_as(&self, known: &Self) -> bool {
        let same = Self { part: known.part.clone(), ..self.clone() };
        same == *known || (self.request.bidirectional && *known == Self { request: self.request.reversed(), ..same })
    }

    /// Simulated times between which it may be imaged [ns since 1970-01-01 UTC].
    #[must_use]
    pub fn validity_ns(&self) -> (u64, u64) {
        (self.valid_from_ns, if self.valid_until_ns == 0 { u64::MAX } else { self.valid_until_ns })
    }
}
