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
        let there = rounded(&known.request);
        let same = Self { part: known.part.clone(), request: known.request.clone(), ..self.clone() } == *known;
        let here = rounded(&self.request);
        same && (here == there || (self.request.bidirectional && here.reversed() == there))
    }

    /// Simulated times between which it may be imaged [ns since 1970-01-01 UTC].
    #[must_use]
    pub fn validity_ns(&self) -> (u64, u64) {
        (self.valid_from_ns, if self.valid_until_ns == 0 { u64::MAX } else { self.valid_until_ns })
    }
}

/// Numbers that differ by less are the same in a request: of degrees, a tenth of a millimetre.
const SAME: f64 = 1e-9;

/// The same request told alike whoever wrote it: formats print fewer digits than a number has, and some turn longitudes.
#[must_use]
pub fn rounded(request: &StripRequest) -> StripRequest {
    // Nothing is minus zero.
    let rounded = |number: f64| (number / SAME).round() * SAME + 0.0;
    let longitude = |it: f64| rounded(if it > 180.0 { it - 360.0 } else { it });
    StripRequest {
        start_latitude_deg: rounded(request.start_latitude_deg),
        start_longitude_deg: longitude(request.start_longitude_deg),
        end_latitude_deg: rounded(request.end_latitude_deg),
        end_longitude_deg: longitude(request.end_longitude_deg),
        priority: rounded(request.priority),
        ..request.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_place_in_other_digits_or_turns_is_the_same_request() {
        let request = StripRequest {
            start_latitude_deg: 0.1 + 0.2,
            start_longitude_deg: 200.1,
            end_latitude_deg: 1.0,
            end_longitude_deg: -159.0,
            priority: 0.5,
            acquisition_speed_m_s: 3000.0,
            bidirectional: true,
        };
        let order = Order::new("r".to_owned(), "n".to_owned(), request.clone());
        let other = StripRequest { start_latitude_deg: 0.3, start_longitude_deg: -159.9, ..request.clone() };
        let known = |request: StripRequest| Order { request, ..order.clone() };
        assert!(order.is_for_the_same_as(&known(other.clone())));
        assert!(order.is_for_the_same_as(&known(other.reversed())));
        let further = StripRequest { start_latitude_deg: 0.300_001, ..request.clone() };
        assert!(!order.is_for_the_same_as(&known(further)));
        assert!(!order.is_for_the_same_as(&known(StripRequest { priority: 0.6, ..request.clone() })));
        assert!(!order.is_for_the_same_as(&Order { max_attempts: 2, ..order.clone() }));
    }
}
