//! Trains and evaluates strip planners: networks, semi-MDP PPO, rollouts, checkpoints, figures.
//!
//! A run is one TOML file ([`config::RunConfig`]); a [`trainer::Trainer`] goes through it one update at a time, and can be
//! saved and restored between any two of them:
//!
//! ```
//! use swath_training::checkpoint;
//! use swath_training::config::RunConfig;
//! use swath_training::trainer::Trainer;
//! use tch::Device;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let run: RunConfig = toml::from_str(
//!     r#"
//!     name = "toy"
//!     steps = 80
//!     environment = { kind = "toy", tokens = 4 }
//!     network = { kind = "hop-ppo-mlp", encoder = [8], discrete = [8], continuous = [8], critic = [8] }
//!     rollout = { environments = 4, group = 2 }
//!     ppo = { batch = 40, minibatch = 20, epochs = 2 }
//!     "#,
//! )?;
//! run.validate()?;
//! let mut trainer = Trainer::new(run.clone(), Device::Cpu)?;
//! let report = trainer.advance()?;
//! assert_eq!((report.steps, report.episodes), (40, 0));
//!
//! let folder = tempfile::tempdir()?;
//! let file = folder.path().join(checkpoint::file_name(&trainer));
//! checkpoint::save(&trainer, &file)?;
//! let mut resumed = checkpoint::resume(run, &file, Device::Cpu)?;
//! assert_eq!(resumed.advance()?.update, trainer.advance()?.update);
//! assert!(resumed.is_finished());
//! # Ok(())
//! # }
//! ```
//!
//! What was trained flies as a planner of the simulation ([`planners::make`]), and is compared with others on the same
//! missions ([`evaluate::fly`]).

pub mod adam;
pub mod checkpoint;
pub mod config;
pub mod distribution;
pub mod environment;
pub mod error;
pub mod evaluate;
pub mod figures;
pub mod gae;
pub mod ground;
pub mod lock;
pub mod lookahead;
pub mod network;
pub mod parameters;
pub mod planners;
pub mod policy;
pub mod ppo;
pub mod process;
pub mod program;
pub mod rollout;
pub mod stop;
pub mod store;
pub mod strips;
pub mod tensorboard;
pub mod toy;
pub mod trainer;
pub mod weights;

pub use error::{Result, TrainingError};
