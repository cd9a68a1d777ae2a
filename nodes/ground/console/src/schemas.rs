//! What the API's description says of values whose types in Rust say less.

use serde_json::json;
use swath_mission::requests::lifecycle::State;
use utoipa::openapi::schema::{ObjectBuilder, Schema, Type};

/// A time as RFC 3339 has it; whether there is such a day is looked at when it is read.
const TIME: &str = "(19|2[0-2])[0-9]{2}-(0[1-9]|1[0-2])-(0[1-9]|[12][0-9]|3[01])[Tt ]([01][0-9]|2[0-3]):[0-5][0-9]:\
                    ([0-5][0-9]|60)([.][0-9]+)?([Zz]|[+-][0-9]{2}:[0-9]{2})";

fn end() -> String {
    format!("([.][.]|{TIME})?")
}

fn text(pattern: String, example: &str) -> Schema {
    ObjectBuilder::new().schema_type(Type::String).pattern(Some(pattern)).examples([json!(example)]).into()
}

/// An interval of simulated times; `..` or nothing for an open end.
#[must_use]
pub fn interval() -> Schema {
    text(format!("^{0}/{0}$", end()), "2026-01-01T00:00:00Z/2026-01-02T00:00:00Z")
}

/// A simulated time, or an interval.
#[must_use]
pub fn time_or_interval() -> Schema {
    text(format!("^({TIME}|{0}/{0})$", end()), "2026-01-01T00:00:00Z/..")
}

/// The name of a state of requests.
#[must_use]
pub fn state() -> Schema {
    ObjectBuilder::new().schema_type(Type::String).enum_values(Some(State::ALL.map(State::name))).into()
}

/// West, south, east, north [deg]; of six numbers the heights are passed over.
#[must_use]
pub fn bounding_box() -> Schema {
    let number = " *[-+]?([0-9]+[.]?[0-9]*|[.][0-9]+)([eE][-+]?[0-9]+)? *";
    text(format!("^{number}(,{number}){{3}}((,{number}){{2}})?$"), "-180,-90,180,90")
}
