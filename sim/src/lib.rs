//! The satellite, its guidance and its planning problem as pure functions: no I/O, no clock, no threads, no logging.
//!
//! Frames: N inertial, E planet-fixed, B body, R the strip's reference (the paper's R2), H Hill. `r_BN_N` is the position
//! of B relative to N in N components; `dcm_BN` takes N components to B components. Everything is in SI units and
//! radians unless a name says otherwise; configuration and requests are in degrees and kilometres. Equations and tables
//! are those of Cheval & Schaub, "Reinforcement Learning with Hybrid Action Representation for Autonomous Strip Imaging
//! Task Scheduling in High-Resolution Super-Agile Satellites".
#![expect(non_snake_case, reason = "frame letters")]

pub mod catalogue;
pub mod config;
pub mod control;
pub mod dynamics;
pub mod env;
pub mod error;
pub mod flight;
pub mod ground;
pub mod guidance;
pub mod model;
pub mod mrp;
pub mod observation;
pub mod orbit;
pub mod planner;
pub mod plant_errors;
pub mod rng;
pub mod scenario;
pub mod strip;
pub mod time;
pub mod windows;
