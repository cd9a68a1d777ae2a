//! The satellite, its guidance and its planning problem as pure functions: no I/O, no clock, no threads, no logging.
//!
//! Frames: N inertial, E planet-fixed, B body, R the strip's reference (the paper's R2), H Hill. `r_BN_N` is the position
//! of B relative to N in N components; `dcm_BN` takes N components to B components. Everything is in SI units and
//! radians unless a name says otherwise; configuration and requests are in degrees and kilometres. Equations and tables
//! are those of Cheval & Schaub, "Reinforcement Learning with Hybrid Action Representation for Autonomous Strip Imaging
//! Task Scheduling in High-Resolution Super-Agile Satellites".
#![expect(non_snake_case, reason = "frame letters")]

pub mod config;
pub mod error;
pub mod foresight;
pub mod learn;
pub mod mission;
pub mod model;
pub mod planner;
pub mod requests;
pub mod rng;
pub mod task;
pub mod time;
pub mod vehicle;
pub mod world;
