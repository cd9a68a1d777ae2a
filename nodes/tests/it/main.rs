//! Tests of the programs of this suite, from outside: processes, topics, files.
#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

mod alarms;
mod bad_input;
mod bag;
mod bridge;
mod chaos;
mod citizens;
mod clients;
mod common;
mod console;
mod datagrams;
mod described;
mod drill;
mod examples;
mod fault_orders;
#[path = "../../examples/common/flight.rs"]
#[allow(dead_code, reason = "others use more of it")]
mod flight;
mod full;
mod habits;
mod killed;
mod lifecycle;
mod operators_day;
mod parity;
mod peer;
mod pins;
mod radio;
mod readme;
mod recorded;
#[path = "../../examples/common/request.rs"]
mod request;
mod resources;
mod start_and_end;
mod storm;
#[path = "../../ros/tests/it/stranger.rs"]
#[allow(dead_code, reason = "others use more of it")]
mod stranger;
mod supervised;
mod taken_over;
mod two_satellites;
