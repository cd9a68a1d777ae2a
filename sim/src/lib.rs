//! The satellite, its guidance and its planning problem as pure functions: no I/O, no clock, no threads, no logging.
//!
//! Frames: N inertial, E planet-fixed, B body, R the strip's reference (the paper's R2), H Hill. `r_BN_N` is the position
//! of B relative to N in N components; `dcm_BN` takes N components to B components. Everything is in SI units and
//! radians unless a name says otherwise; configuration and requests are in degrees and kilometres. Equations and tables
//! are those of Cheval & Schaub, "Reinforcement Learning with Hybrid Action Representation for Autonomous Strip Imaging
//! Task Scheduling in High-Resolution Super-Agile Satellites".
//!
//! A satellite, its requests and a planner make a mission ([`mission::Mission`]), which decides, flies and settles one
//! task after the other:
//!
//! ```
//! use std::sync::Arc;
//!
//! use swath_sim::config::SimConfig;
//! use swath_sim::learn::episode::{Env, EpisodeConfig};
//! use swath_sim::vehicle::model::Model;
//! use swath_sim::planner::PlannerSpec;
//! use swath_sim::task::Totals;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let model = Arc::new(Model::new(SimConfig::default())?);
//! let config = EpisodeConfig { orbits: 0.5, ..EpisodeConfig::evaluation() };
//! let spec: PlannerSpec = "lookahead".parse()?;
//! let mut planner = spec.hand_written(7).ok_or("a policy is made by the trainer's crate")?;
//! let mut totals = Totals::default();
//! Env::episode(model, &config, 7).run(planner.as_mut(), |settled| totals.add(settled))?;
//! assert!(totals.reward > 10.0 && totals.success_rate() == 1.0);
//! # Ok(())
//! # }
//! ```
#![expect(non_snake_case, reason = "frame letters")]

pub mod config;
pub mod error;
pub mod foresight;
pub mod learn;
pub mod mission;
pub mod planner;
pub mod requests;
pub mod rng;
pub mod task;
pub mod time;
pub mod vehicle;
pub mod world;
