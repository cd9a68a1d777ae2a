//! Adam over one flat vector of weights; its whole state can be saved exactly.

use tch::{Device, Kind, Tensor};

use crate::parameters::Parameters;

const BETA_1: f64 = 0.9;
const BETA_2: f64 = 0.999;
const EPSILON: f64 = 1e-8;

/// The optimiser's state (Kingma & Ba 2015).
#[derive(Debug)]
pub struct Adam {
    /// Running mean of gradients.
    pub first: Tensor,
    /// Running mean of squared gradients.
    pub second: Tensor,
    /// Steps taken.
    pub steps: u64,
}

impl Adam {
    /// A fresh state for `count` weights.
    #[must_use]
    pub fn new(count: usize, device: Device) -> Self {
        Self {
            first: Tensor::zeros([count as i64], (Kind::Float, device)),
            second: Tensor::zeros([count as i64], (Kind::Float, device)),
            steps: 0,
        }
    }

    /// One step against `gradient`, a vector like [`Parameters::flat`].
    pub fn step(&mut self, parameters: &mut Parameters, gradient: &Tensor, learning_rate: f64) {
        self.steps += 1;
        let steps = self.steps as f64;
        self.first *= BETA_1;
        self.first += gradient * (1.0 - BETA_1);
        self.second *= BETA_2;
        self.second += gradient.square() * (1.0 - BETA_2);
        let correction = (1.0 - BETA_2.powf(steps)).sqrt();
        let deviation = self.second.sqrt() / correction + EPSILON;
        let rate = learning_rate / (1.0 - BETA_1.powf(steps));
        parameters.flat -= &self.first * rate / deviation;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::Layout;
    use approx::assert_relative_eq;

    #[test]
    fn it_follows_the_published_recursion() {
        let mut layout = Layout::default();
        layout.vector("x", 1, 1.0);
        let flat = Tensor::from_slice(&[1.0f32]);
        let mut parameters = Parameters::from_flat(&layout, flat).unwrap();
        let mut adam = Adam::new(1, Device::Cpu);
        let (mut x, mut m, mut v) = (1.0f64, 0.0f64, 0.0f64);
        for (step, gradient) in [0.5f64, -0.25, 2.0].into_iter().enumerate() {
            adam.step(&mut parameters, &Tensor::from_slice(&[gradient as f32]), 0.1);
            let t = step as i32 + 1;
            m = 0.9 * m + 0.1 * gradient;
            v = 0.999 * v + 0.001 * gradient * gradient;
            let corrected = (v / (1.0 - 0.999f64.powi(t))).sqrt() + 1e-8;
            x -= 0.1 * m / (1.0 - 0.9f64.powi(t)) / corrected;
            assert_relative_eq!(parameters.flat.double_value(&[0]), x, epsilon = 1e-5);
        }
    }
}
