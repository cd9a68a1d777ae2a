//! The ground segment: the request manager with its store, the launcher, operators' commands, and what a bag tells
//! afterwards.
#![expect(non_snake_case, reason = "frame letters")]

pub mod alarms;
pub mod debrief;
pub mod launch;
pub mod operate;
pub mod passes;
pub mod place;
pub mod requests;
