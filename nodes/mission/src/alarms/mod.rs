//! Alarms with a life of their own (ISA-18.2, with the states that Yamcs gives it): raised, acknowledged, returned,
//! shelved, and a journal of all of it.

pub mod board;
pub mod conditions;
pub mod definitions;
pub mod state;
pub mod wishes;

pub use board::{Board, Entry, Event, Key, OperatorError, Standing};
pub use definitions::{DEFINITIONS, Definition, Severity};
pub use state::{Alarm, Input, Refused, State};
