//! A tiny strip-like problem with a known optimum, to test that learning learns.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::environment::{Action, Environment, ObservationShape, Outcome, Progress};
use crate::error::Result;

const FEATURES: usize = 2;
const STEPS: usize = 20;
/// Longest transition [s].
const LONGEST_S: f64 = 100.0;
/// Seconds that imaging itself takes.
const IMAGING_S: f64 = 20.0;

/// Each token has a worth and a need. Choosing it pays worth × (1 − 4·(parameter − need)²), at
/// least 0, and lasts 20 s plus 100 s times the need.
///
/// Fresh tokens are drawn every step, so what an action changes besides its reward is time alone:
/// the best action's parameter is the need, and its token is worth most, less what its time costs.
pub struct Toy {
    tokens: usize,
    rng: ChaCha8Rng,
    worth: Vec<f32>,
    need: Vec<f32>,
    valid: usize,
    step: usize,
}

impl Toy {
    /// A toy with this many tokens, of which at least two are valid at any time.
    #[must_use]
    pub fn new(tokens: usize) -> Self {
        Self {
            tokens,
            rng: ChaCha8Rng::seed_from_u64(0),
            worth: vec![0.0; tokens],
            need: vec![0.0; tokens],
            valid: tokens,
            step: 0,
        }
    }

    fn draw(&mut self) {
        self.valid = self.rng.random_range(2..=self.tokens);
        for token in 0..self.tokens {
            self.worth[token] = self.rng.random_range(0.0..1.0);
            self.need[token] = self.rng.random_range(0.0..0.9);
        }
    }

    /// The value of being about to draw fresh tokens when acting optimally, by iterating
    /// V = E[max γ^Δ·(worth + V)] over `samples` draws.
    #[must_use]
    pub fn optimal_value(tokens: usize, gamma: f64, samples: usize) -> f64 {
        let mut toy = Self::new(tokens);
        let draws: Vec<Vec<(f64, f64)>> = (0..samples)
            .map(|_| {
                toy.draw();
                (0..toy.valid).map(|token| toy.prospect(token)).collect()
            })
            .collect();
        let mut value = 0.0;
        for _ in 0..200 {
            let best = |draw: &Vec<(f64, f64)>| {
                let gains = draw.iter().map(|(worth, s)| gamma.powf(*s) * (worth + value));
                gains.fold(f64::MIN, f64::max)
            };
            value = draws.iter().map(best).sum::<f64>() / samples as f64;
        }
        value
    }

    /// The optimal action, given [`Toy::optimal_value`].
    #[must_use]
    pub fn best(&self, gamma: f64, value: f64) -> Action {
        let gain = |token: usize| {
            let (worth, duration_s) = self.prospect(token);
            gamma.powf(duration_s) * (worth + value)
        };
        let token = (0..self.valid).max_by(|&a, &b| gain(a).total_cmp(&gain(b))).unwrap_or(0);
        Action { token, parameter: f64::from(self.need[token]) }
    }

    /// Worth of a token and the duration of choosing it [s].
    fn prospect(&self, token: usize) -> (f64, f64) {
        let need = f64::from(self.need[token]);
        (f64::from(self.worth[token]), IMAGING_S + LONGEST_S * need)
    }
}

impl Environment for Toy {
    fn shape(&self) -> ObservationShape {
        ObservationShape { tokens: self.tokens, features: FEATURES }
    }

    fn reset(&mut self, seed: u64) -> Result<()> {
        self.rng = ChaCha8Rng::seed_from_u64(seed);
        self.step = 0;
        self.draw();
        Ok(())
    }

    fn observe(&self, features: &mut [f32], valid: &mut [bool]) -> Result<()> {
        for token in 0..self.tokens {
            let real = token < self.valid;
            valid[token] = real;
            features[token * FEATURES] = if real { self.worth[token] } else { 0.0 };
            features[token * FEATURES + 1] = if real { self.need[token] } else { 0.0 };
        }
        Ok(())
    }

    fn step(&mut self, action: Action) -> Result<Outcome> {
        let token = action.token.min(self.tokens - 1);
        let (worth, duration_s) = self.prospect(token);
        let error = action.parameter - f64::from(self.need[token]);
        let share = if token < self.valid { (1.0 - 4.0 * error * error).max(0.0) } else { 0.0 };
        self.step += 1;
        self.draw();
        Ok(Outcome {
            reward: worth * share,
            duration_s,
            success: share > 0.9,
            failure: None,
            progress: if self.step == STEPS { Progress::Truncated } else { Progress::Continues },
        })
    }

    fn reporting_period_s(&self) -> f64 {
        1000.0
    }

    fn parameter_scale_s(&self) -> f64 {
        LONGEST_S
    }

    fn teach(&mut self) -> Result<Action> {
        // Greedy: the greatest worth per second.
        let rate = |token: usize| {
            let (worth, duration_s) = self.prospect(token);
            worth / duration_s
        };
        let token = (0..self.valid).max_by(|&a, &b| rate(a).total_cmp(&rate(b)));
        let token = token.unwrap_or(0);
        Ok(Action { token, parameter: f64::from(self.need[token]) })
    }
}
