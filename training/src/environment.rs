//! What the trainer needs from an environment: tokens with a mask, a hybrid action, a duration.

use crate::error::Result;

pub use swath_sim::learn::hybrid::{Action, ObservationShape, Outcome, Progress};

/// A semi-Markov decision process with a hybrid action; a pure function of its seed and actions.
pub trait Environment: Send {
    /// Size of its observations.
    fn shape(&self) -> ObservationShape;

    /// Begins the episode that belongs to `seed`.
    ///
    /// # Errors
    /// An episode in which there is nothing to do.
    fn reset(&mut self, seed: u64) -> Result<()>;

    /// Writes the present observation: `features` is tokens × features in row order; `valid` says
    /// which tokens are no padding. At least one is valid.
    ///
    /// # Errors
    /// Before the first [`Environment::reset`].
    fn observe(&self, features: &mut [f32], valid: &mut [bool]) -> Result<()>;

    /// Carries an action out. After an outcome that does not continue, call [`Environment::reset`].
    ///
    /// # Errors
    /// An action that does not exist; before the first [`Environment::reset`].
    fn step(&mut self, action: Action) -> Result<Outcome>;

    /// Time by which the reward of an episode is scaled when it is reported [s]: one orbit.
    fn reporting_period_s(&self) -> f64;

    /// The longest transition [s]: what a parameter of 1 stands for.
    fn parameter_scale_s(&self) -> f64;

    /// What the environment's teacher does next. Where it would wait, time moves on first, which counts to the duration
    /// of the next step.
    ///
    /// # Errors
    /// An environment without a teacher.
    fn teach(&mut self) -> Result<Action>;
}
