//! The policies that PPO trains: observation in, distributions over choices and transition, and a value.

mod config;
mod layers;
mod transformer;

pub use config::{DiscretePpo, HPpo, Head, HopPpo, HopPpoMlp, NetworkConfig};

use tch::{Kind, Tensor};

use crate::distribution::{MASKED_LOGIT, SquashedGaussian};
use crate::environment::ObservationShape;
use crate::error::Result;
use crate::parameters::{Layout, Parameters};
use layers::{Mlp, Trunk};
use transformer::{Transformer, TransformerSize};

/// Gain of an actor's last layer: small, so that a fresh policy hardly prefers anything.
const ACTOR_GAIN: f64 = 0.01;

/// A batch of observations.
#[derive(Debug)]
pub struct Observations {
    /// [batch, tokens, features], f32.
    pub features: Tensor,
    /// [batch, tokens], bool: false for padding. `None` when nothing is padded.
    pub valid: Option<Tensor>,
}

/// What a network says about a batch of observations.
#[derive(Debug)]
pub struct Assessment {
    /// Logits of all choices, [batch, choices]; padding is masked.
    pub logits: Tensor,
    /// Values, [batch].
    pub value: Tensor,
    /// H-PPO's outputs for every token, [batch, tokens, 2].
    transitions: Option<Tensor>,
}

/// The structure of a policy; its weights are [`Parameters`] with the layout given by [`Network::new`].
#[derive(Debug, Clone)]
pub struct Network {
    body: Body,
    shape: ObservationShape,
    /// Choices per token: 1, or the number of transition times of discrete PPO.
    levels: usize,
    hybrid: bool,
}

#[derive(Debug, Clone)]
enum Body {
    Hop { encoder: Transformer, head: Head, discrete: Mlp, critic: Mlp, continuous: Mlp },
    HopMlp { encoder: Trunk, discrete: Mlp, critic: Mlp, continuous: Mlp },
    H { encoder: Trunk, discrete: Mlp, continuous: Mlp, critic: Mlp },
    Discrete { discrete: Mlp, critic: Mlp },
}

impl Network {
    /// Builds a network for observations of `shape`; `parameter_scale_s` is the longest transition.
    ///
    /// # Errors
    /// A size that cannot be built.
    pub fn new(config: &NetworkConfig, shape: ObservationShape, parameter_scale_s: f64) -> Result<(Self, Layout)> {
        config.validate(shape, parameter_scale_s)?;
        let mut layout = Layout::default();
        let levels = match config {
            NetworkConfig::DiscretePpo(sizes) => sizes.levels(parameter_scale_s)?,
            _ => 1,
        };
        let body = match config {
            NetworkConfig::HopPpo(sizes) => hop(&mut layout, sizes, shape),
            NetworkConfig::HopPpoMlp(sizes) => hop_mlp(&mut layout, sizes, shape),
            NetworkConfig::HPpo(sizes) => h(&mut layout, sizes, shape),
            NetworkConfig::DiscretePpo(sizes) => discrete(&mut layout, sizes, shape, levels),
        };
        let network = Self { body, shape, levels, hybrid: !matches!(config, NetworkConfig::DiscretePpo(_)) };
        Ok((network, layout))
    }

    /// Size of the observations it takes.
    #[must_use]
    pub fn shape(&self) -> ObservationShape {
        self.shape
    }

    /// Number of discrete choices.
    #[must_use]
    pub fn choices(&self) -> usize {
        self.shape.tokens * self.levels
    }

    /// Whether it has a continuous actor.
    #[must_use]
    pub fn is_hybrid(&self) -> bool {
        self.hybrid
    }

    /// Whether its two actors are trained with an objective each (H-PPO) or jointly (eq. 20).
    #[must_use]
    pub fn has_separate_objectives(&self) -> bool {
        matches!(self.body, Body::H { .. })
    }

    /// The token of a choice, and the parameter that the choice fixes, if any.
    #[must_use]
    pub fn decode(&self, choice: usize) -> (usize, Option<f64>) {
        if self.hybrid {
            return (choice, None);
        }
        let level = choice % self.levels;
        let parameter = level as f64 / (self.levels - 1) as f64;
        (choice / self.levels, Some(parameter))
    }

    /// The choice that comes closest to an action; the inverse of [`Network::decode`].
    #[must_use]
    pub fn encode(&self, token: usize, parameter: f64) -> usize {
        if self.hybrid {
            return token;
        }
        let level = (parameter * (self.levels - 1) as f64).round() as usize;
        token * self.levels + level.min(self.levels - 1)
    }

    /// Logits and values of a batch.
    pub fn assess(&self, parameters: &Parameters, observations: &Observations) -> Assessment {
        let x = &observations.features;
        let flat = || x.flatten(1, -1);
        let (logits, value, transitions) = match &self.body {
            Body::Hop { encoder, head, discrete, critic, .. } => {
                let padding = observations.valid.as_ref().map(attention_padding);
                let tokens = encoder.forward(parameters, x, padding.as_ref());
                let (for_actor, for_critic) = match head {
                    Head::Flat => (tokens.flatten(1, -1), tokens.flatten(1, -1)),
                    Head::Pointer => {
                        let mean = mean_token(&tokens, observations.valid.as_ref());
                        (tokens, mean)
                    }
                };
                let logits = discrete.forward(parameters, &for_actor);
                let logits = logits.view([-1, self.shape.tokens as i64]);
                (logits, critic.forward(parameters, &for_critic), None)
            }
            Body::HopMlp { encoder, discrete, critic, .. } => {
                let code = encoder.forward(parameters, &flat());
                let logits = discrete.forward(parameters, &code);
                (logits, critic.forward(parameters, &code), None)
            }
            Body::H { encoder, discrete, continuous, critic } => {
                let code = encoder.forward(parameters, &flat());
                let logits = discrete.forward(parameters, &code);
                let transitions = continuous.forward(parameters, &code);
                let transitions = transitions.view([-1, self.shape.tokens as i64, 2]);
                (logits, critic.forward(parameters, &flat()), Some(transitions))
            }
            Body::Discrete { discrete, critic } => {
                let logits = discrete.forward(parameters, &flat());
                (logits, critic.forward(parameters, &flat()), None)
            }
        };
        Assessment { logits: self.mask(logits, observations.valid.as_ref()), value: value.squeeze_dim(-1), transitions }
    }

    /// The distribution of the transition for the chosen tokens, [batch] of i64; `None` for a
    /// network without a continuous actor.
    #[must_use]
    pub fn transition(
        &self,
        parameters: &Parameters,
        observations: &Observations,
        assessment: &Assessment,
        choice: &Tensor,
    ) -> Option<SquashedGaussian> {
        let outputs = match &self.body {
            Body::Hop { continuous, .. } | Body::HopMlp { continuous, .. } => {
                let own = select(&observations.features, choice);
                continuous.forward(parameters, &own)
            }
            Body::H { .. } => select(assessment.transitions.as_ref()?, choice),
            Body::Discrete { .. } => return None,
        };
        Some(SquashedGaussian::from_outputs(&outputs))
    }

    fn mask(&self, logits: Tensor, valid: Option<&Tensor>) -> Tensor {
        let Some(valid) = valid else {
            return logits;
        };
        let valid = valid.repeat_interleave_self_int(self.levels as i64, 1, None);
        logits.masked_fill(&valid.logical_not(), MASKED_LOGIT)
    }
}

/// Rows of [batch, tokens, width] picked by [batch], giving [batch, width].
fn select(rows: &Tensor, choice: &Tensor) -> Tensor {
    let width = rows.size()[2];
    let index = choice.view([-1, 1, 1]).expand([-1, 1, width], false);
    rows.gather(1, &index, false).squeeze_dim(1)
}

/// 0 for valid tokens and a large negative number for padding, [batch, 1, 1, tokens].
fn attention_padding(valid: &Tensor) -> Tensor {
    let valid = valid.to_kind(Kind::Float);
    ((valid - 1.0) * -MASKED_LOGIT).unsqueeze(1).unsqueeze(1)
}

fn mean_token(tokens: &Tensor, valid: Option<&Tensor>) -> Tensor {
    let Some(valid) = valid else {
        return tokens.mean_dim(1, false, Kind::Float);
    };
    let weight = valid.to_kind(Kind::Float).unsqueeze(-1);
    let sum = (tokens * &weight).sum_dim_intlist(1, false, Kind::Float);
    sum / weight.sum_dim_intlist(1, false, Kind::Float)
}

fn hop(layout: &mut Layout, sizes: &HopPpo, shape: ObservationShape) -> Body {
    let size = TransformerSize {
        tokens: shape.tokens,
        features: shape.features,
        dim: sizes.dim,
        heads: sizes.heads,
        layers: sizes.layers,
        feed_forward: sizes.feed_forward,
    };
    let encoder = Transformer::new(layout, "encoder", size);
    let (inputs, scores, pooled) = match sizes.head {
        Head::Flat => {
            let joined = shape.tokens * sizes.dim;
            (joined, shape.tokens, joined)
        }
        Head::Pointer => (sizes.dim, 1, sizes.dim),
    };
    Body::Hop {
        encoder,
        head: sizes.head,
        discrete: Mlp::new(layout, "discrete", inputs, &sizes.discrete, scores, ACTOR_GAIN),
        critic: Mlp::new(layout, "critic", pooled, &sizes.critic, 1, 1.0),
        continuous: continuous(layout, &sizes.continuous, shape),
    }
}

fn hop_mlp(layout: &mut Layout, sizes: &HopPpoMlp, shape: ObservationShape) -> Body {
    let encoder = Trunk::new(layout, "encoder", shape.len(), &sizes.encoder);
    let width = encoder.width;
    Body::HopMlp {
        encoder,
        discrete: Mlp::new(layout, "discrete", width, &sizes.discrete, shape.tokens, ACTOR_GAIN),
        critic: Mlp::new(layout, "critic", width, &sizes.critic, 1, 1.0),
        continuous: continuous(layout, &sizes.continuous, shape),
    }
}

fn h(layout: &mut Layout, sizes: &HPpo, shape: ObservationShape) -> Body {
    let encoder = Trunk::new(layout, "encoder", shape.len(), &sizes.encoder);
    let (width, tokens) = (encoder.width, shape.tokens);
    Body::H {
        encoder,
        discrete: Mlp::new(layout, "discrete", width, &sizes.discrete, tokens, ACTOR_GAIN),
        continuous: Mlp::new(layout, "continuous", width, &sizes.continuous, 2 * tokens, ACTOR_GAIN),
        critic: Mlp::new(layout, "critic", shape.len(), &sizes.critic, 1, 1.0),
    }
}

fn discrete(layout: &mut Layout, sizes: &DiscretePpo, shape: ObservationShape, levels: usize) -> Body {
    let choices = shape.tokens * levels;
    Body::Discrete {
        discrete: Mlp::new(layout, "discrete", shape.len(), &sizes.discrete, choices, ACTOR_GAIN),
        critic: Mlp::new(layout, "critic", shape.len(), &sizes.critic, 1, 1.0),
    }
}

/// The continuous actor reads the raw features of one token: mean and log-deviation.
fn continuous(layout: &mut Layout, hidden: &[usize], shape: ObservationShape) -> Mlp {
    Mlp::new(layout, "continuous", shape.features, hidden, 2, ACTOR_GAIN)
}
