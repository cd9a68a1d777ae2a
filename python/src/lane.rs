//! One of the episodes that are flown side by side.

use swath_sim::error::SimError;
use swath_sim::learn::episode::Env;
use swath_sim::learn::hybrid::{Action, Episode, LearnError, ObservationShape, Progress};
use thiserror::Error;

use crate::records::failure_number;
use crate::settings::Settings;

/// Why an episode cannot begin or go on.
#[derive(Debug, Error)]
pub enum LaneError {
    /// What `sim` says of episodes.
    #[error(transparent)]
    Learn(#[from] LearnError),
    /// What `sim` says of settings.
    #[error(transparent)]
    Sim(#[from] SimError),
    /// A strip that is not offered.
    #[error("strip {token} was chosen, outside 0 to {last}: {offered} strips are offered")]
    Token {
        /// Strip chosen.
        token: i64,
        /// Last one that is offered.
        last: i64,
        /// Strips offered.
        offered: usize,
    },
    /// A transition that is no share of the longest one.
    #[error("the transition is {parameter}, outside 0 to 1 times planning.t_pre_max_s")]
    Parameter {
        /// Transition chosen over the longest one.
        parameter: f64,
    },
    /// An error in one of several lanes.
    #[error("environment {lane}: {source}")]
    Lane {
        /// Which one.
        lane: usize,
        /// Why.
        #[source]
        source: Box<Self>,
    },
}

/// What a lane is to do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Order {
    /// Nothing but look.
    Look,
    /// Fly an action.
    Step(Action),
    /// Begin the episode of a seed.
    Reset(u64),
}

/// What came of an order; all zero of one that flew nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Flown {
    /// Reward, paid at the end of the step.
    pub reward: f64,
    /// Duration of the step [s].
    pub duration_s: f64,
    /// Whether the strip was imaged.
    pub success: bool,
    /// Whether nothing can be gained any more.
    pub terminated: bool,
    /// Whether the episode's length is reached.
    pub truncated: bool,
    /// Number of the reason of a failure; 0 of none.
    pub failure: i64,
    /// Identity of the strip; 0 of none.
    pub strip: i64,
}

/// An episode, one after the other.
pub struct Lane {
    settings: Settings,
    episode: Episode,
}

impl Lane {
    /// A lane whose first episode is still to begin.
    pub fn new(settings: &Settings) -> Self {
        let episode = Episode::new(settings.model.clone(), settings.episode().clone(), settings.observation());
        Self { settings: settings.clone(), episode }
    }

    /// Size of an observation.
    pub fn shape(&self) -> ObservationShape {
        self.episode.shape()
    }

    /// The simulation as the present episode has it.
    ///
    /// # Errors
    /// Before the first episode.
    pub fn env(&self) -> Result<&Env, LaneError> {
        Ok(self.episode.env()?)
    }

    /// The action of a choice, checked before anything flies.
    ///
    /// # Errors
    /// A strip that is not offered; a transition outside [0, 1]; before the first episode.
    pub fn action(&self, token: i64, parameter: f64) -> Result<Action, LaneError> {
        let offered = self.env()?.context().candidates.len();
        if !(0.0..=1.0).contains(&parameter) {
            return Err(LaneError::Parameter { parameter });
        }
        match usize::try_from(token) {
            Ok(token) if token < offered => Ok(Action { token, parameter }),
            _ => Err(LaneError::Token { token, last: offered as i64 - 1, offered }),
        }
    }

    /// Carries an order out and writes what is seen then; nothing is seen before the first episode.
    ///
    /// # Errors
    /// An episode without a strip.
    pub fn carry_out(&mut self, order: Order, features: &mut [f32], valid: &mut [bool]) -> Result<Flown, LaneError> {
        let flown = match order {
            Order::Look => Flown::default(),
            Order::Reset(seed) => {
                let env = self.settings.env(seed)?;
                self.episode.begin_in(env, seed, self.settings.asked(seed))?;
                Flown::default()
            }
            Order::Step(action) => self.step(action)?,
        };
        if order != Order::Look || self.episode.env().is_ok() {
            self.episode.observe(features, valid)?;
        }
        Ok(flown)
    }

    fn step(&mut self, action: Action) -> Result<Flown, LaneError> {
        let strip = self.env()?.context().candidates.get(action.token).map_or(0, |it| it.id.0 as i64);
        let outcome = self.episode.step(action)?;
        Ok(Flown {
            reward: outcome.reward,
            duration_s: outcome.duration_s,
            success: outcome.success,
            terminated: outcome.progress == Progress::Terminated,
            truncated: outcome.progress == Progress::Truncated,
            failure: outcome.failure.map_or(0, failure_number),
            strip,
        })
    }
}
