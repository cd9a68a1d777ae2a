//! All integration tests of the simulation: `val_*` against outside numbers, `regress_*` against our own rules.

#![expect(clippy::unwrap_used, reason = "a test may panic")]

mod regress_faults;
mod regress_ground;
mod regress_learners;
mod regress_missions;
mod regress_plant_errors;
mod regress_resources;
mod val_basilisk;
mod val_basilisk_resources;
mod val_paper_construction;
mod val_paper_operating_points;
