//! What can go wrong while planners are trained, stored and evaluated.

use std::path::{Path, PathBuf};

use swath_sim::error::SimError;

/// The error of this crate.
#[derive(Debug, thiserror::Error)]
pub enum TrainingError {
    /// A file could not be read or written.
    #[error("cannot {action} {path}")]
    File {
        /// `read`, `write`, …
        action: &'static str,
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        #[source]
        source: std::io::Error,
    },
    /// A run's TOML is not well-formed or has an unknown key.
    #[error("run {path} is not valid")]
    Toml {
        /// The file.
        path: PathBuf,
        /// Where and why.
        #[source]
        source: Box<toml::de::Error>,
    },
    /// A value of a run is outside what makes sense.
    #[error("{key} is {value}, which is not {limit}")]
    Setting {
        /// Dotted path of the key.
        key: String,
        /// The value found.
        value: String,
        /// What is allowed.
        limit: String,
    },
    /// A checkpoint or policy file is not what was once written.
    #[error("{path} is damaged: {reason}")]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// A file is whole, but not what is needed.
    #[error("{path} cannot be used here: {reason}")]
    Unsuitable {
        /// The file.
        path: PathBuf,
        /// What it is instead.
        reason: String,
    },
    /// Another process writes into the run's folder.
    #[error(
        "{path} belongs to a run that is going on, process {process}: wait for it, or choose another --out or --seed"
    )]
    Busy {
        /// The folder.
        path: PathBuf,
        /// The process that holds it.
        process: String,
    },
    /// What was asked for has no answer.
    #[error("there is no result: {0}")]
    NoResult(String),
    /// Somebody asked to stop; [`Trainer::state`](crate::trainer::Trainer::state) is that before the update.
    #[error("stopped before the update was complete")]
    Stopped,
    /// A checkpoint belongs to another run.
    #[error("{path} was made by another run: {key} is {found} there and {wanted} here")]
    Mismatch {
        /// The file.
        path: PathBuf,
        /// The first setting that differs.
        key: String,
        /// Its value in the file.
        found: String,
        /// Its value in this run.
        wanted: String,
    },
    /// No policy of this kind is part of the program.
    #[error("no {kind} policy is shipped: name a file, {kind}:FILE")]
    NotShipped {
        /// The kind.
        kind: String,
    },
    /// Nothing to resume from.
    #[error("{path} holds no checkpoint")]
    NoCheckpoint {
        /// The folder searched.
        path: PathBuf,
    },
    /// Learning diverged.
    #[error("{quantity} is not finite at step {step}")]
    NotFinite {
        /// Which number.
        quantity: &'static str,
        /// Environment steps taken so far.
        step: u64,
    },
    /// A policy returned NaN or infinity for an observation.
    #[error("the policy's {quantity} is not finite")]
    PolicyNotFinite {
        /// Which output.
        quantity: &'static str,
    },
    /// A policy was asked about an observation of another shape.
    #[error("the policy takes {wanted}, not {found}")]
    Shape {
        /// What the policy was trained on.
        wanted: String,
        /// What it was given.
        found: String,
    },
    /// libtorch refused an operation.
    #[error("libtorch failed")]
    Torch(#[from] tch::TchError),
    /// A setting of the simulation is out of range.
    #[error(transparent)]
    Simulation(#[from] SimError),
    /// The simulated environment could not be made or stepped.
    #[error("the environment failed: {0}")]
    Environment(String),
}

/// The result of this crate's functions.
pub type Result<T> = std::result::Result<T, TrainingError>;

impl TrainingError {
    /// For `map_err` on an I/O result.
    pub(crate) fn file(action: &'static str, path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_path_buf();
        move |source| Self::File { action, path, source }
    }

    pub(crate) fn damaged(path: &Path, reason: impl ToString) -> Self {
        Self::Damaged { path: path.to_path_buf(), reason: reason.to_string() }
    }

    pub(crate) fn unsuitable(path: &Path, reason: impl ToString) -> Self {
        Self::Unsuitable { path: path.to_path_buf(), reason: reason.to_string() }
    }

    /// For `map_err` on what goes wrong while the simulation flies.
    pub(crate) fn environment(error: impl ToString) -> Self {
        Self::Environment(error.to_string())
    }
}
