//! The two distributions of the hybrid policy: a masked categorical and a squashed Gaussian.

use rand::{Rng, RngExt};
use tch::{Kind, Tensor};

use crate::parameters::standard_normal;

/// Logit of a choice that is padding; its probability is exactly 0 in f32.
pub const MASKED_LOGIT: f64 = -1e9;

const HALF_LN_TAU: f64 = 0.918_938_533_204_672_7;

/// Bounds of the logarithm of the standard deviation, before squashing.
const LOG_DEVIATION: (f64, f64) = (-5.0, 2.0);

/// Log-probabilities of all choices, [batch, choices]; masked ones get a very negative number.
pub fn log_probabilities(logits: &Tensor) -> Tensor {
    logits.log_softmax(-1, Kind::Float)
}

/// Log-probability of the chosen entries, [batch].
pub fn chosen(log_probabilities: &Tensor, choice: &Tensor) -> Tensor {
    log_probabilities.gather(-1, &choice.unsqueeze(-1), false).squeeze_dim(-1)
}

/// Entropy of the categorical, [batch].
pub fn entropy(log_probabilities: &Tensor) -> Tensor {
    -(log_probabilities.exp() * log_probabilities).sum_dim_intlist(-1, false, Kind::Float)
}

/// KL(old ‖ new) of two categoricals given as log-probabilities, [batch].
pub fn categorical_kl(old: &Tensor, new: &Tensor) -> Tensor {
    (old.exp() * (old - new)).sum_dim_intlist(-1, false, Kind::Float)
}

/// A Gaussian over a latent x that is squashed to a parameter u = (1 + tanh x)/2 in (0, 1).
#[derive(Debug)]
pub struct SquashedGaussian {
    /// Mean of x, [batch].
    pub mean: Tensor,
    /// Logarithm of the standard deviation of x, [batch].
    pub log_deviation: Tensor,
}

impl SquashedGaussian {
    /// From a network's two outputs, [batch, 2]; the second is kept within bounds.
    #[must_use]
    pub fn from_outputs(outputs: &Tensor) -> Self {
        Self {
            mean: outputs.select(-1, 0),
            log_deviation: outputs.select(-1, 1).clamp(LOG_DEVIATION.0, LOG_DEVIATION.1),
        }
    }

    /// Log-density of u at the latent x, with the change of variables, [batch].
    pub fn log_density(&self, latent: &Tensor) -> Tensor {
        let scaled = (latent - &self.mean) * (-&self.log_deviation).exp();
        let normal = scaled.square() * -0.5 - &self.log_deviation - HALF_LN_TAU;
        // ln du/dx = ln((1 − tanh²x)/2) = ln 2 − 2x − 2 ln(1 + e^(−2x)), stable for large |x|
        let softplus = (latent * -2.0).softplus();
        let log_slope = (latent + softplus) * -2.0 + std::f64::consts::LN_2;
        normal - log_slope
    }

    /// Entropy of the Gaussian before squashing, [batch].
    pub fn latent_entropy(&self) -> Tensor {
        &self.log_deviation + (0.5 + HALF_LN_TAU)
    }

    /// KL(self ‖ new), [batch]; squashing does not change it.
    pub fn kl(&self, new: &Self) -> Tensor {
        let variance = (&self.log_deviation * 2.0).exp();
        let distance = (&self.mean - &new.mean).square();
        let scaled = (variance + distance) * (&new.log_deviation * -2.0).exp() * 0.5;
        &new.log_deviation - &self.log_deviation + scaled - 0.5
    }
}

/// The parameter of a latent, u = (1 + tanh x)/2.
#[must_use]
pub fn squash(latent: f32) -> f64 {
    0.5 * (1.0 + f64::from(latent).tanh())
}

/// The latent of a parameter, kept away from the ends where it would be infinite.
#[must_use]
pub fn unsquash(parameter: f64) -> f32 {
    let bounded = parameter.clamp(1e-4, 1.0 - 1e-4);
    (2.0 * bounded - 1.0).atanh() as f32
}

/// Draws an index with probabilities proportional to exp(logit).
pub fn sample_choice(logits: &[f32], rng: &mut impl Rng) -> usize {
    let largest = logits.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    let weight = |logit: f32| f64::from(logit - largest).exp();
    let total: f64 = logits.iter().map(|&logit| weight(logit)).sum();
    let mut left = rng.random::<f64>() * total;
    let mut last = 0;
    for (index, &logit) in logits.iter().enumerate() {
        let weight = weight(logit);
        if weight > 0.0 {
            last = index;
            left -= weight;
            if left < 0.0 {
                break;
            }
        }
    }
    last
}

/// The index of the greatest logit, the first of equals.
#[must_use]
pub fn best_choice(logits: &[f32]) -> usize {
    let mut best = 0;
    for (index, &logit) in logits.iter().enumerate() {
        if logit > logits[best] {
            best = index;
        }
    }
    best
}

/// Draws a latent.
pub fn sample_latent(mean: f32, log_deviation: f32, rng: &mut impl Rng) -> f32 {
    let draw = standard_normal(rng);
    (f64::from(mean) + f64::from(log_deviation).exp() * draw) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::{assert_abs_diff_eq, assert_relative_eq};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    fn gaussian(mean: f32, log_deviation: f32) -> SquashedGaussian {
        SquashedGaussian { mean: Tensor::from_slice(&[mean]), log_deviation: Tensor::from_slice(&[log_deviation]) }
    }

    #[test]
    fn log_probabilities_are_those_of_a_softmax_and_ignore_masked_choices() {
        let logits = Tensor::from_slice(&[0.3f32, -1.0, 2.0, MASKED_LOGIT as f32]).view([1, 4]);
        let weights = [0.3f64.exp(), (-1.0f64).exp(), 2.0f64.exp()];
        let total: f64 = weights.iter().sum();
        let logs = log_probabilities(&logits);
        for (index, weight) in weights.iter().enumerate() {
            let choice = Tensor::from_slice(&[index as i64]);
            let found = chosen(&logs, &choice).double_value(&[0]);
            assert_abs_diff_eq!(found, (weight / total).ln(), epsilon = 1e-6);
        }
        assert_eq!(logs.exp().double_value(&[0, 3]), 0.0);
        let wanted: f64 = weights.iter().map(|w| -(w / total) * (w / total).ln()).sum();
        assert_abs_diff_eq!(entropy(&logs).double_value(&[0]), wanted, epsilon = 1e-6);
    }

    #[test]
    fn categorical_kl_equals_the_sum_written_out() {
        let p = [0.2f64, 0.5, 0.3];
        let q = [0.4f64, 0.35, 0.25];
        let logs = |p: &[f64; 3]| Tensor::from_slice(&p.map(|p| p.ln() as f32)).view([1, 3]);
        let wanted: f64 = p.iter().zip(q).map(|(p, q)| p * (p / q).ln()).sum();
        let found = categorical_kl(&logs(&p), &logs(&q)).double_value(&[0]);
        assert_abs_diff_eq!(found, wanted, epsilon = 1e-6);
        assert_abs_diff_eq!(categorical_kl(&logs(&p), &logs(&p)).double_value(&[0]), 0.0);
    }

    #[test]
    fn the_squashed_density_integrates_to_one() {
        let gaussian = gaussian(0.4, -0.3);
        let count = 20_000;
        let parameters = (0..count).map(|i| (f64::from(i) + 0.5) / f64::from(count));
        let latents: Vec<f32> = parameters.map(|u| (2.0 * u - 1.0).atanh() as f32).collect();
        let densities = gaussian.log_density(&Tensor::from_slice(&latents)).exp();
        assert_abs_diff_eq!(densities.mean(Kind::Double).double_value(&[]), 1.0, epsilon = 1e-4);
    }

    #[test]
    fn the_squashed_density_equals_its_closed_form_and_stays_finite_far_out() {
        let (mean, deviation, x) = (0.4f64, 0.6f64, -1.1f64);
        let found = gaussian(mean as f32, deviation.ln() as f32)
            .log_density(&Tensor::from_slice(&[x as f32]))
            .double_value(&[0]);
        let normal = (-0.5 * ((x - mean) / deviation).powi(2)).exp() / (deviation * std::f64::consts::TAU.sqrt());
        let slope = 0.5 * (1.0 - x.tanh().powi(2));
        assert_relative_eq!(found, (normal / slope).ln(), epsilon = 1e-5);
        let far = gaussian(0.0, 2.0).log_density(&Tensor::from_slice(&[50.0f32]));
        assert!(far.double_value(&[0]).is_finite());
    }

    #[test]
    fn gaussian_kl_equals_its_closed_form() {
        let (m0, s0, m1, s1) = (0.1f64, 0.5f64, -0.4f64, 0.9f64);
        let found = gaussian(m0 as f32, s0.ln() as f32).kl(&gaussian(m1 as f32, s1.ln() as f32)).double_value(&[0]);
        let wanted = (s1 / s0).ln() + (s0 * s0 + (m0 - m1).powi(2)) / (2.0 * s1 * s1) - 0.5;
        assert_abs_diff_eq!(found, wanted, epsilon = 1e-6);
    }

    #[test]
    fn samples_have_the_frequencies_of_the_distribution() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let logits = [0.0f32, 1.0, MASKED_LOGIT as f32, -0.5];
        let total: f64 = [0.0f64, 1.0, -0.5].iter().map(|logit| logit.exp()).sum();
        let mut counts = [0usize; 4];
        for _ in 0..40_000 {
            counts[sample_choice(&logits, &mut rng)] += 1;
        }
        assert_eq!(counts[2], 0);
        for index in [0, 1, 3] {
            let wanted = f64::from(logits[index]).exp() / total;
            assert_abs_diff_eq!(counts[index] as f64 / 40_000.0, wanted, epsilon = 0.01);
        }
    }

    #[test]
    fn squashing_and_unsquashing_are_inverse() {
        for parameter in [0.01, 0.3, 0.5, 0.99] {
            assert_abs_diff_eq!(squash(unsquash(parameter)), parameter, epsilon = 1e-6);
        }
        assert!(unsquash(0.0).is_finite() && unsquash(1.0).is_finite());
    }
}
