//! What counts as the same strip asked for twice.

use swath_sim::world::strip::StripRequest;

use super::lifecycle::State;
use super::request::Request;
use crate::orders::order::Order;

/// Units of a degree in which strips are compared: about a metre.
const SAME_PLACE_PER_DEG: f64 = 1e5;

/// Where a strip lies: latitude and longitude of its ends in those units.
pub(super) type Place = [i32; 4];

/// Whether an order asks for what a request at the same place asks for already: a submitter asks for a strip once at a
/// time.
pub(super) fn is_asked_again(order: &Order, known: &Request) -> bool {
    let (ours_from, ours_until) = order.validity_ns();
    let (from, until) = known.order.validity_ns();
    known.order.submitter == order.submitter
        && known.order.request.acquisition_speed_m_s == order.request.acquisition_speed_m_s
        && ours_from < until
        && from < ours_until
}

/// Where a strip lies; two at one place are the same strip.
pub(super) fn place(request: &StripRequest) -> Place {
    let rounded = |degrees: f64| (degrees * SAME_PLACE_PER_DEG).round() as i32;
    let east = |degrees: f64| rounded(if degrees > 180.0 { degrees - 360.0 } else { degrees });
    [
        rounded(request.start_latitude_deg),
        east(request.start_longitude_deg),
        rounded(request.end_latitude_deg),
        east(request.end_longitude_deg),
    ]
}

/// Whether the same again is a new request: it was not imaged, and will not be.
pub(super) fn may_be_asked_again(state: State) -> bool {
    state.is_final() && !matches!(state, State::Completed | State::FulfilledByLink)
}
