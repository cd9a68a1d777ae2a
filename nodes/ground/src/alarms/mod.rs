//! Alarms as operators meet them: the board of a flying mission, its topics and its services.

mod board;
pub mod messages;

pub use board::FlyingBoard;
