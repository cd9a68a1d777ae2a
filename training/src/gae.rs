//! Generalised advantage estimation for decisions of unequal duration (paper eq. 23).

/// What followed a decision.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Next {
    /// The next decision of the same episode is the next entry of the sequence.
    Decision,
    /// The episode is over: no reward can follow.
    Terminated,
    /// The episode was cut off, or the sequence ends here: the value of the observation that
    /// followed stands for all later rewards.
    Cut {
        /// The critic's value of that observation.
        value: f64,
    },
}

/// One decision of a sequence.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Decision {
    /// Reward, paid when the decision's action ends.
    pub reward: f64,
    /// Duration of the action [s].
    pub duration_s: f64,
    /// The critic's value before the decision.
    pub value: f64,
    /// What followed.
    pub next: Next,
}

/// Advantages of a sequence, in its order.
///
/// δₜ = γ^Δₜ·(rₜ + Vₜ₊₁) − Vₜ and Aₜ = δₜ + λ·γ^Δₜ·Aₜ₊₁, with γ per second. Equation 23's indices
/// do not agree with equation 14; this is the form that does. A last entry that says
/// [`Next::Decision`] is treated as terminated.
///
/// ```
/// use swath_training::gae::{Decision, Next, advantages};
///
/// let imaged = Decision { reward: 1.0, duration_s: 100.0, value: 0.5, next: Next::Terminated };
/// let advantage = advantages(&[imaged], 0.999, 0.95)[0];
/// assert!((advantage - (0.999f64.powf(100.0) - 0.5)).abs() < 1e-12);
/// ```
#[must_use]
pub fn advantages(sequence: &[Decision], gamma: f64, lambda: f64) -> Vec<f64> {
    let mut result = vec![0.0; sequence.len()];
    let (mut next_value, mut next_advantage) = (0.0, 0.0);
    for (decision, advantage) in sequence.iter().zip(&mut result).rev() {
        match decision.next {
            Next::Decision => {}
            Next::Terminated => (next_value, next_advantage) = (0.0, 0.0),
            Next::Cut { value } => (next_value, next_advantage) = (value, 0.0),
        }
        let discount = gamma.powf(decision.duration_s);
        let delta = discount * (decision.reward + next_value) - decision.value;
        *advantage = delta + lambda * discount * next_advantage;
        (next_value, next_advantage) = (decision.value, *advantage);
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn decision(reward: f64, duration_s: f64, value: f64, next: Next) -> Decision {
        Decision { reward, duration_s, value, next }
    }

    #[test]
    fn with_lambda_one_an_advantage_is_the_discounted_return_less_the_value() {
        let sequence = [
            decision(1.0, 100.0, 0.7, Next::Decision),
            decision(0.5, 40.0, 0.2, Next::Decision),
            decision(0.25, 60.0, 0.4, Next::Cut { value: 3.0 }),
        ];
        let gamma: f64 = 0.999;
        let found = advantages(&sequence, gamma, 1.0);
        let returned = gamma.powf(100.0) * (1.0 + gamma.powf(40.0) * (0.5 + gamma.powf(60.0) * (0.25 + 3.0)));
        assert_relative_eq!(found[0], returned - 0.7, epsilon = 1e-12);
    }

    #[test]
    fn with_lambda_zero_it_is_the_one_step_error() {
        let sequence = [decision(1.0, 10.0, 0.7, Next::Decision), decision(0.5, 20.0, 0.2, Next::Terminated)];
        let found = advantages(&sequence, 0.9, 0.0);
        assert_relative_eq!(found[0], 0.9f64.powf(10.0) * 1.2 - 0.7, epsilon = 1e-12);
        assert_relative_eq!(found[1], 0.9f64.powf(20.0) * 0.5 - 0.2, epsilon = 1e-12);
    }

    /// Equation 23 written out as the double sum over later decisions.
    #[test]
    fn the_recursion_equals_the_sum_of_equation_23() {
        let (gamma, lambda) = (0.995f64, 0.9f64);
        let (rewards, durations) = ([0.3, 0.0, 0.9, 0.4], [35.0, 120.5, 80.0, 61.5]);
        let values = [1.0, 0.8, 1.4, 0.9, 1.2];
        let sequence: Vec<Decision> = (0..4)
            .map(|i| {
                let last = Next::Cut { value: values[4] };
                let next = if i == 3 { last } else { Next::Decision };
                decision(rewards[i], durations[i], values[i], next)
            })
            .collect();
        let found = advantages(&sequence, gamma, lambda);
        for t in 0..4 {
            let mut sum = 0.0;
            for i in 0..4 - t {
                let elapsed: f64 = durations[t..t + i].iter().sum();
                let step = gamma.powf(durations[t + i]);
                let delta = step * (rewards[t + i] + values[t + i + 1]) - values[t + i];
                sum += lambda.powi(i as i32) * gamma.powf(elapsed) * delta;
            }
            assert_relative_eq!(found[t], sum, epsilon = 1e-12);
        }
    }

    #[test]
    fn nothing_flows_back_over_an_episode_boundary() {
        let first = decision(1.0, 10.0, 0.0, Next::Cut { value: 2.0 });
        let alone = advantages(&[first], 0.99, 0.95);
        let later = decision(100.0, 10.0, 5.0, Next::Terminated);
        assert_eq!(advantages(&[first, later], 0.99, 0.95)[0], alone[0]);
    }
}
