//! Whether two files of requests ask for the same strips.
#![allow(dead_code, reason = "not every test asks for all of it")]

use swath_mission::orders::found::Import;
use swath_mission::orders::order::Order;

/// Greatest difference of two places that are the same [deg]: formats print fewer digits than a number has.
const SAME_DEG: f64 = 1e-8;

/// What differs between two files; without `conditions` only names and places are compared.
pub fn difference(one: &Import, other: &Import, conditions: bool) -> Option<String> {
    if let Some(fault) = one.refused.first().or(other.refused.first()) {
        return Some(fault.to_string());
    }
    if one.orders.len() != other.orders.len() {
        return Some(format!("{} strips and {}", one.orders.len(), other.orders.len()));
    }
    let by_name = |import: &Import| {
        let mut orders = import.orders.clone();
        orders.sort_by(|a, b| a.name.cmp(&b.name));
        orders
    };
    let pairs = by_name(one).into_iter().zip(by_name(other));
    pairs.filter(|(a, b)| !same(a, b, conditions)).map(|(a, b)| format!("{a:?} and {b:?}")).next()
}

fn same(a: &Order, b: &Order, conditions: bool) -> bool {
    let (one, two) = (&a.request, &b.request);
    let near = |a: f64, b: f64| {
        let turned = (a - b).rem_euclid(360.0);
        turned.min(360.0 - turned) < SAME_DEG
    };
    let placed = near(one.start_latitude_deg, two.start_latitude_deg)
        && near(one.start_longitude_deg, two.start_longitude_deg)
        && near(one.end_latitude_deg, two.end_latitude_deg)
        && near(one.end_longitude_deg, two.end_longitude_deg);
    let asked = (one.priority - two.priority).abs() < 1e-9
        && one.acquisition_speed_m_s == two.acquisition_speed_m_s
        && one.bidirectional == two.bidirectional
        && (&a.client_ref, &a.submitter, a.validity_ns()) == (&b.client_ref, &b.submitter, b.validity_ns())
        && (a.hold_for_approval, a.max_attempts) == (b.hold_for_approval, b.max_attempts);
    a.name == b.name && placed && (asked || !conditions)
}
