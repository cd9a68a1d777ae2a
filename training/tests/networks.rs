//! Every network against the same calculation written out in plain loops and double precision.

use std::collections::HashMap;

use approx::assert_abs_diff_eq;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use swath_training::distribution::{best_choice, log_probabilities};
use swath_training::environment::ObservationShape;
use swath_training::network::{DiscretePpo, HPpo, Head, HopPpo, HopPpoMlp, Network, NetworkConfig, Observations};
use swath_training::parameters::{Layout, Parameters};
use swath_training::rollout::to_vec;
use tch::{Device, Tensor};

const SHAPE: ObservationShape = ObservationShape { tokens: 5, features: 3 };
const BATCH: usize = 4;

type Row = Vec<f64>;
/// Tokens of one observation.
type Tokens = Vec<Row>;

/// Weights by name, as plain numbers.
struct Weights(HashMap<String, (Vec<i64>, Vec<f64>)>);

impl Weights {
    fn new(layout: &Layout, parameters: &Parameters) -> Self {
        let flat = to_vec(&parameters.flat).unwrap();
        let mut numbers = flat.into_iter().map(f64::from);
        let named = layout.entries().map(|(name, shape)| {
            let count = shape.iter().product::<i64>() as usize;
            let values = numbers.by_ref().take(count).collect();
            (name.to_owned(), (shape.to_vec(), values))
        });
        Self(named.collect())
    }

    fn vector(&self, name: &str) -> &[f64] {
        &self.0[name].1
    }

    fn linear(&self, name: &str, x: &[f64]) -> Row {
        let (shape, weight) = &self.0[&format!("{name}.weight")];
        let bias = self.vector(&format!("{name}.bias"));
        assert_eq!(shape[1] as usize, x.len());
        let rows = weight.chunks(x.len()).zip(bias);
        rows.map(|(row, bias)| dot(row, x) + bias).collect()
    }

    fn norm(&self, name: &str, x: &[f64]) -> Row {
        let mean = x.iter().sum::<f64>() / x.len() as f64;
        let variance = x.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / x.len() as f64;
        let scale = self.vector(&format!("{name}.weight"));
        let shift = self.vector(&format!("{name}.bias"));
        let normal = x.iter().map(|x| (x - mean) / (variance + 1e-5).sqrt());
        normal.zip(scale).zip(shift).map(|((x, a), b)| a * x + b).collect()
    }

    fn mlp(&self, name: &str, hidden: usize, x: &[f64]) -> Row {
        self.linear(&format!("{name}.output"), &self.trunk(name, hidden, x))
    }

    fn trunk(&self, name: &str, hidden: usize, x: &[f64]) -> Row {
        (0..hidden).fold(x.to_vec(), |x, layer| relu(self.linear(&format!("{name}.{layer}"), &x)))
    }

    /// Section IV.C for one observation.
    fn encode(&self, tokens: &Tokens, valid: &[bool], dim: usize, heads: usize, layers: usize) -> Tokens {
        let mut x: Tokens = tokens
            .iter()
            .enumerate()
            .map(|(n, token)| add(&self.linear("encoder.embed", token), &position(n, dim)))
            .collect();
        for layer in 0..layers {
            let name = |part: &str| format!("encoder.layer{layer}.{part}");
            let normed: Tokens = x.iter().map(|x| self.norm(&name("norm_attention"), x)).collect();
            let mixed = self.attend(&name("query_key_value"), &normed, valid, heads);
            for (x, mixed) in x.iter_mut().zip(mixed) {
                *x = add(x, &self.linear(&name("project"), &mixed));
                let normed = self.norm(&name("norm_feed_forward"), x);
                let hidden = relu(self.linear(&name("expand"), &normed));
                *x = add(x, &self.linear(&name("contract"), &hidden));
            }
        }
        x.iter().map(|x| self.norm("encoder.norm", x)).collect()
    }

    fn attend(&self, name: &str, x: &Tokens, valid: &[bool], heads: usize) -> Tokens {
        let dim = x[0].len();
        let width = dim / heads;
        let joined: Tokens = x.iter().map(|x| self.linear(name, x)).collect();
        let part = |token: usize, which: usize, head: usize| &joined[token][which * dim + head * width..][..width];
        let mut mixed = vec![vec![0.0; dim]; x.len()];
        for (query, out) in mixed.iter_mut().enumerate() {
            for head in 0..heads {
                let score = |key: usize| dot(part(query, 0, head), part(key, 1, head)) / (width as f64).sqrt();
                let weight = |key: usize| if valid[key] { score(key).exp() } else { 0.0 };
                let total: f64 = (0..x.len()).map(weight).sum();
                for key in 0..x.len() {
                    let share = weight(key) / total;
                    for (index, value) in part(key, 2, head).iter().enumerate() {
                        out[head * width + index] += share * value;
                    }
                }
            }
        }
        mixed
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn add(a: &[f64], b: &[f64]) -> Row {
    a.iter().zip(b).map(|(a, b)| a + b).collect()
}

fn relu(x: Row) -> Row {
    x.into_iter().map(|x| x.max(0.0)).collect()
}

/// Equation 21.
fn position(n: usize, dim: usize) -> Row {
    let angle = |i: usize| n as f64 / 10000f64.powf(2.0 * i as f64 / dim as f64);
    (0..dim / 2).flat_map(|i| [angle(i).sin(), angle(i).cos()]).collect()
}

/// A network with weights large enough to matter, and a batch of observations with padding.
struct Case {
    network: Network,
    parameters: Parameters,
    weights: Weights,
    observations: Vec<(Tokens, Vec<bool>)>,
}

impl Case {
    fn new(config: &NetworkConfig) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let (network, layout) = Network::new(config, SHAPE, 120.0).unwrap();
        let parameters = Parameters::initial(&layout, &mut rng, Device::Cpu).unwrap();
        let noise: Vec<f32> = (0..layout.count()).map(|_| rng.random_range(-0.3..0.3)).collect();
        let flat = &parameters.flat + Tensor::from_slice(&noise);
        let parameters = Parameters::from_flat(&layout, flat).unwrap();
        let observations = (0..BATCH).map(|row| {
            let mut number = || f64::from(rng.random_range(-1.0f32..1.0));
            let tokens = (0..SHAPE.tokens).map(|_| (0..SHAPE.features).map(|_| number()).collect());
            let valid = (0..SHAPE.tokens).map(|token| token < SHAPE.tokens - row);
            (tokens.collect(), valid.collect())
        });
        Self { observations: observations.collect(), weights: Weights::new(&layout, &parameters), network, parameters }
    }

    fn seen(&self) -> Observations {
        let numbers = self.observations.iter().flat_map(|(tokens, _)| tokens.iter().flatten());
        let features: Vec<f32> = numbers.map(|&x| x as f32).collect();
        let valid: Vec<bool> = self.observations.iter().flat_map(|(_, valid)| valid.clone()).collect();
        swath_training::rollout::observations(&features, &valid, SHAPE, Device::Cpu)
    }

    /// Compares with logits and value written out, and with the transition of every token.
    fn check(
        &self,
        expected: impl Fn(&Weights, &Tokens, &[bool]) -> (Row, f64),
        transition: impl Fn(&Weights, &Tokens, usize) -> Option<Row>,
    ) {
        let seen = self.seen();
        let assessment = self.network.assess(&self.parameters, &seen);
        let choices = self.network.choices();
        let (logits, values) = (to_vec(&assessment.logits).unwrap(), to_vec(&assessment.value).unwrap());
        let probabilities = to_vec(&log_probabilities(&assessment.logits).exp()).unwrap();
        for (row, (tokens, valid)) in self.observations.iter().enumerate() {
            let (wanted, value) = expected(&self.weights, tokens, valid);
            assert_eq!(wanted.len(), choices);
            assert_abs_diff_eq!(f64::from(values[row]), value, epsilon = 1e-4);
            for choice in 0..choices {
                let place = row * choices + choice;
                if valid[self.network.decode(choice).0] {
                    assert_abs_diff_eq!(f64::from(logits[place]), wanted[choice], epsilon = 1e-4);
                } else {
                    assert_eq!(probabilities[place], 0.0, "padding has probability");
                }
            }
        }
        for token in 0..SHAPE.tokens {
            let choice = Tensor::from_slice(&[token as i64; BATCH]);
            let found = self.network.transition(&self.parameters, &seen, &assessment, &choice);
            for (row, (tokens, _)) in self.observations.iter().enumerate() {
                let Some(wanted) = transition(&self.weights, tokens, token) else {
                    assert!(found.is_none());
                    continue;
                };
                let gaussian = found.as_ref().unwrap();
                let mean = gaussian.mean.double_value(&[row as i64]);
                let deviation = gaussian.log_deviation.double_value(&[row as i64]);
                assert_abs_diff_eq!(mean, wanted[0], epsilon = 1e-4);
                assert_abs_diff_eq!(deviation, wanted[1].clamp(-5.0, 2.0), epsilon = 1e-4);
            }
        }
    }
}

fn hop(head: Head) -> NetworkConfig {
    NetworkConfig::HopPpo(HopPpo {
        dim: 8,
        heads: 2,
        layers: 2,
        feed_forward: 12,
        head,
        discrete: vec![6],
        continuous: vec![7, 5],
        critic: vec![4],
    })
}

#[test]
fn hop_ppo_with_pointer_heads() {
    Case::new(&hop(Head::Pointer)).check(
        |weights, tokens, valid| {
            let code = weights.encode(tokens, valid, 8, 2, 2);
            let logits = code.iter().map(|token| weights.mlp("discrete", 1, token)[0]).collect();
            let count = valid.iter().filter(|&&valid| valid).count() as f64;
            let real = || code.iter().zip(valid).filter(|(_, valid)| **valid);
            let mean: Row = (0..8).map(|i| real().map(|(x, _)| x[i]).sum::<f64>() / count).collect();
            (logits, weights.mlp("critic", 1, &mean)[0])
        },
        |weights, tokens, token| Some(weights.mlp("continuous", 2, &tokens[token])),
    );
}

#[test]
fn hop_ppo_with_the_papers_flat_heads() {
    Case::new(&hop(Head::Flat)).check(
        |weights, tokens, valid| {
            let code = weights.encode(tokens, valid, 8, 2, 2).concat();
            (weights.mlp("discrete", 1, &code), weights.mlp("critic", 1, &code)[0])
        },
        |weights, tokens, token| Some(weights.mlp("continuous", 2, &tokens[token])),
    );
}

#[test]
fn hop_ppo_mlp() {
    let config = NetworkConfig::HopPpoMlp(HopPpoMlp {
        encoder: vec![9, 8],
        discrete: vec![6],
        continuous: vec![7],
        critic: vec![4],
    });
    Case::new(&config).check(
        |weights, tokens, _| {
            let code = weights.trunk("encoder", 2, &tokens.concat());
            (weights.mlp("discrete", 1, &code), weights.mlp("critic", 1, &code)[0])
        },
        |weights, tokens, token| Some(weights.mlp("continuous", 1, &tokens[token])),
    );
}

#[test]
fn h_ppo_has_a_transition_for_every_token_and_a_critic_of_its_own() {
    let config =
        NetworkConfig::HPpo(HPpo { encoder: vec![9], discrete: vec![6], continuous: vec![7], critic: vec![4, 3] });
    Case::new(&config).check(
        |weights, tokens, _| {
            let code = weights.trunk("encoder", 1, &tokens.concat());
            let value = weights.mlp("critic", 2, &tokens.concat())[0];
            (weights.mlp("discrete", 1, &code), value)
        },
        |weights, tokens, token| {
            let code = weights.trunk("encoder", 1, &tokens.concat());
            let all = weights.mlp("continuous", 1, &code);
            Some(all[2 * token..2 * token + 2].to_vec())
        },
    );
}

#[test]
fn discrete_ppo_has_a_choice_for_every_strip_and_time() {
    let config = NetworkConfig::DiscretePpo(DiscretePpo { granularity_s: 60.0, discrete: vec![6], critic: vec![4] });
    let case = Case::new(&config);
    case.check(
        |weights, tokens, _| {
            let flat = tokens.concat();
            (weights.mlp("discrete", 1, &flat), weights.mlp("critic", 1, &flat)[0])
        },
        |_, _, _| None,
    );
    // 0, 60 and 120 s for each strip: the paper's 3N choices.
    assert_eq!(case.network.choices(), 3 * SHAPE.tokens);
    assert_eq!(case.network.decode(7), (2, Some(0.5)));
    for choice in 0..case.network.choices() {
        let (token, parameter) = case.network.decode(choice);
        assert_eq!(case.network.encode(token, parameter.unwrap()), choice);
    }
}

#[test]
fn what_stands_in_padding_changes_nothing() {
    for config in [hop(Head::Pointer)] {
        let mut case = Case::new(&config);
        let before = case.network.assess(&case.parameters, &case.seen());
        for (tokens, valid) in &mut case.observations {
            let padding = tokens.iter_mut().zip(valid).filter(|(_, valid)| !**valid);
            padding.for_each(|(token, _)| token.fill(0.9));
        }
        let after = case.network.assess(&case.parameters, &case.seen());
        assert_eq!(to_vec(&before.logits).unwrap(), to_vec(&after.logits).unwrap());
        assert_eq!(to_vec(&before.value).unwrap(), to_vec(&after.value).unwrap());
        let logits = to_vec(&after.logits).unwrap();
        for (row, (_, valid)) in case.observations.iter().enumerate() {
            let best = best_choice(&logits[row * SHAPE.tokens..][..SHAPE.tokens]);
            assert!(valid[best]);
        }
    }
}

#[test]
fn sizes_that_cannot_be_built_are_refused_by_name() {
    let refused = |config: NetworkConfig| Network::new(&config, SHAPE, 120.0).map(|_| ()).unwrap_err().to_string();
    let with = |change: fn(&mut HopPpo)| {
        let NetworkConfig::HopPpo(mut sizes) = hop(Head::Flat) else { unreachable!() };
        change(&mut sizes);
        refused(NetworkConfig::HopPpo(sizes))
    };
    assert!(with(|it| it.heads = 3).contains("network.dim is 8"));
    assert!(with(|it| it.dim = 0).contains("network.dim is 0"));
    assert!(with(|it| it.layers = 1000).contains("network.layers is 1000"));
    assert!(with(|it| it.discrete = vec![0]).contains("network.discrete is 0"));
    let granularity =
        refused(NetworkConfig::DiscretePpo(DiscretePpo { granularity_s: 50.0, discrete: vec![6], critic: vec![4] }));
    assert!(granularity.contains("network.granularity_s is 50"), "{granularity}");
}
