//! All integration tests of the trainer.

#![expect(clippy::unwrap_used, reason = "a test may panic")]

mod case;
mod cli;
mod drawing;
mod learning;
mod networks;
mod paper;
mod policy;
mod results;
mod resume;
mod robustness;
mod stopping;
