//! Faults by order: what is to fail, when, and for how long.
//!
//! `PART:WHAT@WHEN+HOW LONG`, such as `guidance:kill@120s`, `planner:hang@300s+10s`, `topic:drop 20%@400s+60s`,
//! `wheel2:weak 50%@600s`, `gyro:bias 0.01deg/s@700s`, `startracker:out@800s+30s`, `store:full`, `bag:full`.

pub mod grammar;
pub mod orders;
pub mod plan;
pub mod random;

pub use grammar::{GrammarError, PlannedFault, What};
pub use plan::{FaultPlan, FaultPlanError};
