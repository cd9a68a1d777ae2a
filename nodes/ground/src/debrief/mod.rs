//! What `swath` makes of a recorded mission: flown again, reported, exported.

pub mod export;
pub mod places;
pub mod recorded;
pub mod refly;
pub mod report;
