//! What the trainer needs from an environment: tokens with a mask, a hybrid action, a duration.

use crate::error::Result;

/// Size of an observation: a sequence of tokens, each with the same features.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ObservationShape {
    /// Tokens, which are also the discrete choices.
    pub tokens: usize,
    /// Features of one token.
    pub features: usize,
}

impl ObservationShape {
    /// Numbers in one observation.
    pub fn len(self) -> usize {
        self.tokens * self.features
    }

    /// Whether it holds no number.
    pub fn is_empty(self) -> bool {
        self.len() == 0
    }
}

/// A hybrid action.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Action {
    /// Which token.
    pub token: usize,
    /// Continuous parameter in [0, 1]; for strips T_pre over its maximum.
    pub parameter: f64,
}

/// How an episode stands after a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Progress {
    /// It goes on.
    Continues,
    /// It is over, and nothing can be gained after it.
    Terminated,
    /// It was cut off: what follows is worth the value of the next observation.
    Truncated,
}

/// What an action led to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// Reward, paid at the end of the step.
    pub reward: f64,
    /// Duration of the step [s].
    pub duration_s: f64,
    /// Whether the attempt succeeded.
    pub success: bool,
    /// How the episode stands.
    pub progress: Progress,
}

/// A semi-Markov decision process with a hybrid action; a pure function of its seed and actions.
pub trait Environment: Send {
    /// Size of its observations.
    fn shape(&self) -> ObservationShape;

    /// Begins the episode that belongs to `seed`.
    fn reset(&mut self, seed: u64) -> Result<()>;

    /// Writes the present observation: `features` is tokens × features in row order; `valid` says
    /// which tokens are no padding. At least one is valid.
    fn observe(&self, features: &mut [f32], valid: &mut [bool]) -> Result<()>;

    /// Carries an action out. After an outcome that does not continue, call [`Environment::reset`].
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
