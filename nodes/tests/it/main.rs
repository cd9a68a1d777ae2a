//! Tests of the programs of this suite, from outside: processes, topics, files.
#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

mod bad_input;
mod bag;
mod bridge;
mod clients;
mod common;
mod console;
mod examples;
mod habits;
mod killed;
mod operators_day;
mod parity;
mod peer;
mod pins;
mod readme;
mod recorded;
mod supervised;
mod two_satellites;
