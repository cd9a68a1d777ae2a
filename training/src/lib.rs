//! Trains and evaluates strip planners: networks, semi-MDP PPO, rollouts, checkpoints, figures.

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
pub mod lookahead;
pub mod network;
pub mod parameters;
pub mod planners;
pub mod policy;
pub mod ppo;
pub mod process;
pub mod rollout;
pub mod store;
pub mod strips;
pub mod tensorboard;
pub mod toy;
pub mod trainer;

pub use error::{Result, TrainingError};
