//! The tests of bags: the library, `swath-bag` as a process, and other people's readers and bags.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test that cannot go on should panic")]

mod common;

mod commands;
mod conformance;
mod cyclone;
mod damage;
mod foreign;
mod kill;
mod mutation;
mod operations;
mod play;
mod readers;
mod record;
mod rosbag2;
