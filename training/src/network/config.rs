//! Which network a run trains, and its sizes.

use serde::{Deserialize, Serialize};

use crate::environment::ObservationShape;
use crate::error::{Result, TrainingError};

/// Largest size that a layer may have, to catch typing errors before they exhaust the memory.
const LARGEST_LAYER: usize = 16384;

/// The networks of the paper's comparison (section V.A, Table 3).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum NetworkConfig {
    /// Two actors; a transformer encoder shared by the discrete actor and the critic.
    HopPpo(HopPpo),
    /// The same with an MLP as encoder.
    HopPpoMlp(HopPpoMlp),
    /// Standard hybrid PPO: an MLP encoder shared by both actors, one parameter per choice.
    HPpo(HPpo),
    /// Every pair of a strip and a transition time from a grid is one choice.
    DiscretePpo(DiscretePpo),
}

/// How the discrete actor and the critic read a sequence of encoded tokens.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Head {
    /// All tokens joined into one vector, as in the paper.
    Flat,
    /// One small MLP scores each token; the critic sees the mean token.
    Pointer,
}

/// Sizes of HOP-PPO.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HopPpo {
    /// Embedding dimension.
    pub dim: usize,
    /// Attention heads.
    pub heads: usize,
    /// Encoder layers.
    pub layers: usize,
    /// Units of the encoder's feed-forward networks.
    pub feed_forward: usize,
    /// How actor and critic read the tokens.
    pub head: Head,
    /// Hidden layers of the discrete actor.
    pub discrete: Vec<usize>,
    /// Hidden layers of the continuous actor.
    pub continuous: Vec<usize>,
    /// Hidden layers of the critic.
    pub critic: Vec<usize>,
}

/// Sizes of HOP-PPO with an MLP encoder.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HopPpoMlp {
    /// Layers of the encoder.
    pub encoder: Vec<usize>,
    /// Hidden layers of the discrete actor.
    pub discrete: Vec<usize>,
    /// Hidden layers of the continuous actor.
    pub continuous: Vec<usize>,
    /// Hidden layers of the critic.
    pub critic: Vec<usize>,
}

/// Sizes of H-PPO.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HPpo {
    /// Layers of the actors' encoder.
    pub encoder: Vec<usize>,
    /// Hidden layers of the discrete actor.
    pub discrete: Vec<usize>,
    /// Hidden layers of the continuous actor.
    pub continuous: Vec<usize>,
    /// Hidden layers of the critic, which reads the raw observation.
    pub critic: Vec<usize>,
}

/// Sizes of discrete PPO.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DiscretePpo {
    /// Distance of the grid of transition times [s]; divides the longest one.
    pub granularity_s: f64,
    /// Hidden layers of the actor.
    pub discrete: Vec<usize>,
    /// Hidden layers of the critic.
    pub critic: Vec<usize>,
}

impl NetworkConfig {
    /// The name used in configurations, tables and file names.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match self {
            Self::HopPpo(_) => "hop-ppo",
            Self::HopPpoMlp(_) => "hop-ppo-mlp",
            Self::HPpo(_) => "h-ppo",
            Self::DiscretePpo(_) => "discrete-ppo",
        }
    }

    /// Checks every size against what can be built for this observation.
    ///
    /// # Errors
    /// The first size that is out of range.
    pub fn validate(&self, shape: ObservationShape, parameter_scale_s: f64) -> Result<()> {
        if shape.is_empty() {
            return Err(setting("environment", format!("{shape:?}"), "an observation with numbers in it"));
        }
        for (key, layers) in self.layers() {
            for &units in layers {
                check(&format!("network.{key}"), units, 1, LARGEST_LAYER)?;
            }
        }
        match self {
            Self::HopPpo(sizes) => sizes.validate(),
            Self::HopPpoMlp(HopPpoMlp { encoder, .. }) | Self::HPpo(HPpo { encoder, .. }) if encoder.is_empty() => {
                Err(setting("network.encoder", "[]".into(), "at least one layer"))
            }
            Self::DiscretePpo(sizes) => sizes.levels(parameter_scale_s).map(|_| ()),
            _ => Ok(()),
        }
    }

    fn layers(&self) -> Vec<(&'static str, &[usize])> {
        match self {
            Self::HopPpo(it) => {
                vec![("discrete", &it.discrete), ("continuous", &it.continuous), ("critic", &it.critic)]
            }
            Self::HopPpoMlp(it) => vec![
                ("encoder", &it.encoder),
                ("discrete", &it.discrete),
                ("continuous", &it.continuous),
                ("critic", &it.critic),
            ],
            Self::HPpo(it) => vec![
                ("encoder", &it.encoder),
                ("discrete", &it.discrete),
                ("continuous", &it.continuous),
                ("critic", &it.critic),
            ],
            Self::DiscretePpo(it) => {
                vec![("discrete", &it.discrete), ("critic", &it.critic)]
            }
        }
    }
}

impl HopPpo {
    fn validate(&self) -> Result<()> {
        check("network.dim", self.dim, 2, 4096)?;
        check("network.layers", self.layers, 1, 64)?;
        check("network.feed_forward", self.feed_forward, 1, LARGEST_LAYER)?;
        check("network.heads", self.heads, 1, self.dim)?;
        if !self.dim.is_multiple_of(2) {
            return Err(setting("network.dim", self.dim.to_string(), "even"));
        }
        if !self.dim.is_multiple_of(self.heads) {
            let limit = format!("a multiple of network.heads, {}", self.heads);
            return Err(setting("network.dim", self.dim.to_string(), &limit));
        }
        Ok(())
    }
}

impl DiscretePpo {
    /// Number of transition times on the grid from 0 to the longest, both included.
    ///
    /// # Errors
    /// A distance that does not divide the longest.
    pub fn levels(&self, parameter_scale_s: f64) -> Result<usize> {
        let steps = parameter_scale_s / self.granularity_s;
        let whole = (steps - steps.round()).abs() < 1e-9;
        if !(steps.is_finite() && whole && (1.0..=1000.0).contains(&steps)) {
            let limit = format!("a divisor of the longest transition, {parameter_scale_s} s");
            let value = self.granularity_s.to_string();
            return Err(setting("network.granularity_s", value, &limit));
        }
        Ok(steps.round() as usize + 1)
    }
}

fn check(key: &str, value: usize, least: usize, most: usize) -> Result<()> {
    if (least..=most).contains(&value) {
        return Ok(());
    }
    Err(setting(key, value.to_string(), &format!("in {least} to {most}")))
}

fn setting(key: &str, value: String, limit: &str) -> TrainingError {
    TrainingError::Setting { key: key.to_owned(), value, limit: limit.to_owned() }
}
