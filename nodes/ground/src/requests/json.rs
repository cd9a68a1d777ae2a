//! Requests as JSON: the one shape in which commands, exports and recordings tell of them.

use serde_json::{Value, json};
use swath_msgs::builtin_interfaces::Time;
use swath_msgs::swath_msgs as msg;

use swath_mission::orders::geojson::feature_of;
use swath_mission::orders::order::Order;
use swath_mission::requests::lifecycle::State;
use swath_mission::time_text;
use swath_node::stamp::nanoseconds;

/// Name of a state.
pub fn state_name(number: u8) -> &'static str {
    State::from_number(number).map_or("unknown", State::name)
}

/// A time, or a dash without one.
#[must_use]
pub fn time(time: &Time) -> String {
    if *time == Time::default() { "-".to_owned() } else { time_text::format(nanoseconds(time)) }
}

/// A time, or null without one.
#[must_use]
pub fn time_json(at: &Time) -> Value {
    if *at == Time::default() { Value::Null } else { time(at).into() }
}

/// Where a request stands, for machines.
#[must_use]
pub fn status_json(status: &msg::StripStatus) -> Value {
    let strip = &status.strip;
    json!({
        "id": strip.id,
        "name": strip.name,
        "client_ref": status.client_ref,
        "submitter": status.submitter,
        "start": [strip.start_longitude_deg, strip.start_latitude_deg],
        "end": [strip.end_longitude_deg, strip.end_latitude_deg],
        "priority": strip.priority,
        "acquisition_speed_m_s": strip.acquisition_speed,
        "state": state_name(status.state),
        "reason_code": status.reason_code,
        "reason": status.reason,
        "actor": status.actor,
        "changed": time_json(&status.header.stamp),
        "tick": status.tick,
        "created_tick": status.created_tick,
        "attempts": status.attempts,
        "reward": status.reward,
        "window_open": time_json(&status.window_open),
        "window_close": time_json(&status.window_close),
        "imaging": time_json(&status.imaging),
        "linked_to": status.linked_to,
        "supersedes": status.supersedes,
        "superseded_by": status.superseded_by,
        "order_id": status.order_id,
        "served_by": status.served_by,
    })
}

/// An order as a GeoJSON feature, with all of its conditions, where it stands and what it went through.
#[must_use]
pub fn exported(order: &Order, status: &msg::StripStatus, history: Vec<Value>) -> Value {
    let mut feature = feature_of(order);
    if let (Value::Object(properties), Value::Object(standing)) = (&mut feature["properties"], status_json(status)) {
        // The geometry tells them.
        let standing = standing.into_iter().filter(|(key, _)| !["start", "end"].contains(&key.as_str()));
        properties.extend(standing);
        properties.insert("history".to_owned(), history.into());
    }
    feature
}

/// A line of the audit trail, for machines.
#[must_use]
pub fn history_json(entry: &msg::HistoryEntry) -> Value {
    json!({
        "sequence": entry.sequence,
        "strip": entry.strip_id,
        "client_ref": entry.client_ref,
        "name": entry.name,
        "time": time_json(&entry.stamp),
        "tick": entry.tick,
        "state": state_name(entry.state),
        "reason_code": entry.reason_code,
        "reason": entry.reason,
        "actor": entry.actor,
    })
}
