//! Pins: what the programs say and write, held against golden files, from outside and through files only, so that they
//! stay true whatever becomes of the crates. `SWATH_BLESS=1` writes the golden files anew.
//!
//! Programs are those beside `swath`: `cargo xtask test` builds them all first. Before this test alone is run, it is
//! `cargo build --release --workspace --bins` that makes them, or brings them up to date.

mod bags;
mod golden;
mod help;
mod kept;
mod missions;
mod place;
mod refusals;
mod training;
