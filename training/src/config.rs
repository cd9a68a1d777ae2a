//! A run: one TOML file that holds everything a result depends on.

use std::path::Path;

use serde::{Deserialize, Serialize};
use swath_sim::config::SimConfig;
use swath_sim::learn::episode::EpisodeConfig;
use swath_sim::learn::observation::ObservationSet;
use swath_sim::planner::PlannerSpec;

use crate::error::{Result, TrainingError};
use crate::network::NetworkConfig;

/// Everything that a run depends on besides the program itself.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunConfig {
    /// Name of the run: its folder and its title in tables.
    pub name: String,
    /// Seed of everything random.
    #[serde(default)]
    pub seed: u64,
    /// Environment steps in all.
    pub steps: u64,
    /// Steps between checkpoints.
    #[serde(default = "checkpoint_every")]
    pub checkpoint_every: u64,
    /// What is learned.
    pub environment: EnvironmentConfig,
    /// Which network.
    pub network: NetworkConfig,
    /// How experience is gathered.
    #[serde(default)]
    pub rollout: RolloutConfig,
    /// How it is learned from.
    #[serde(default)]
    pub ppo: PpoConfig,
    /// Behaviour cloning before PPO; none when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub warm_start: Option<WarmStartConfig>,
}

fn checkpoint_every() -> u64 {
    100_000
}

/// The environment of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum EnvironmentConfig {
    /// Strip imaging: the `sim` crate.
    Strips(Box<StripsConfig>),
    /// A tiny problem with a known optimum.
    Toy(ToyConfig),
}

/// Strip imaging.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct StripsConfig {
    /// Which features the policy sees of each strip.
    pub observation: ObservationSet,
    /// Length and requests of an episode.
    pub episode: EpisodeConfig,
    /// The satellite.
    pub simulation: SimConfig,
}

/// The tiny problem.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ToyConfig {
    /// Tokens.
    pub tokens: usize,
}

/// How experience is gathered. Results depend on these numbers, not on the number of threads.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RolloutConfig {
    /// Environments.
    pub environments: usize,
    /// Environments stepped in lockstep with one inference; divides `environments`.
    pub group: usize,
    /// Each environment's first episode is cut off after a random number of decisions up to this, so that later ones do
    /// not end together; 0 cuts none off.
    pub stagger: u64,
}

impl Default for RolloutConfig {
    fn default() -> Self {
        Self { environments: 64, group: 32, stagger: 0 }
    }
}

/// Hyperparameters of PPO. Defaults are Table 3's, and RLlib 2.6.3's where the paper is silent, with these exceptions:
/// `clip` and `gradient_norm` are as in RLlib's examples, 0.2 and 0.5, which Table 3 prints the other way round; the
/// value clamp and the KL penalty are off. `docs/paper-comparison.md` sets all of it side by side.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PpoConfig {
    /// Decisions per update; rounded up to a multiple of the environments.
    pub batch: usize,
    /// Decisions per gradient step.
    pub minibatch: usize,
    /// Passes over each batch.
    pub epochs: usize,
    /// Adam's step at the start.
    pub learning_rate: f64,
    /// Adam's step at the end; it changes linearly with the environment steps.
    pub learning_rate_end: f64,
    /// Discount factor γ, per second.
    pub gamma: f64,
    /// λ of the advantage estimate.
    pub lambda: f64,
    /// ε of the clipped surrogate (eq. 16).
    pub clip: f64,
    /// Largest global norm of a gradient.
    pub gradient_norm: f64,
    /// Weight of the squared error of the critic.
    pub value_coefficient: f64,
    /// Clamp of the squared error of the critic; none when absent.
    pub value_clamp: Option<f64>,
    /// Weight of the discrete actor's entropy.
    pub entropy_coefficient: f64,
    /// Weight of the continuous actor's entropy, before squashing.
    pub transition_entropy_coefficient: f64,
    /// Adaptive penalty on the KL divergence from the policy that gathered the batch; none when absent.
    pub kl_penalty: Option<KlPenalty>,
    /// Ends the passes over a batch once the mean KL divergence of a pass is greater; none when absent.
    pub kl_stop: Option<f64>,
    /// Parts that a minibatch's gradient is computed in, on as many threads.
    pub shards: usize,
}

/// RLlib's adaptive KL penalty.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KlPenalty {
    /// Weight at the start; grows by half above twice the target and halves below half of it.
    pub coefficient: f64,
    /// Target of the mean divergence after an update.
    pub target: f64,
}

impl Default for PpoConfig {
    fn default() -> Self {
        Self {
            batch: 3000,
            minibatch: 128,
            epochs: 10,
            learning_rate: 3e-5,
            learning_rate_end: 3e-5,
            gamma: 0.999,
            lambda: 0.95,
            clip: 0.2,
            gradient_norm: 0.5,
            value_coefficient: 1.0,
            value_clamp: None,
            entropy_coefficient: 0.0,
            transition_entropy_coefficient: 0.0,
            kl_penalty: None,
            kl_stop: None,
            shards: 2,
        }
    }
}

/// Learning from a teacher before PPO starts: the actors imitate it, and the critic learns what its way is worth.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WarmStartConfig {
    /// Decisions shown, in batches as PPO's.
    pub decisions: u64,
    /// Adam's step at the beginning; it falls linearly to a tenth.
    pub learning_rate: f64,
    /// For strips: the planner that is imitated.
    #[serde(default = "teacher")]
    pub teacher: PlannerSpec,
}

fn teacher() -> PlannerSpec {
    PlannerSpec::Heuristic(90.0)
}

impl RunConfig {
    /// Reads and validates a run.
    ///
    /// # Errors
    /// An unreadable file, an unknown key, or a value out of range.
    pub fn load(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(TrainingError::file("read", path))?;
        let run: Self = toml::from_str(&text)
            .map_err(|source| TrainingError::Toml { path: path.to_path_buf(), source: Box::new(source) })?;
        run.validate()?;
        Ok(run)
    }

    /// Checks every number that has a range; NaN is in none. Network sizes are checked where the
    /// network is built.
    ///
    /// # Errors
    /// The first setting that is out of range.
    pub fn validate(&self) -> Result<()> {
        let plain = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
        if self.name.is_empty() || self.name.starts_with('.') || !self.name.chars().all(plain) {
            return Err(setting("name", &self.name, "letters, digits, '-', '_' and '.'"));
        }
        // A run is kept as TOML, which has no greater number.
        if i64::try_from(self.seed).is_err() {
            return Err(setting("seed", self.seed, &format!("in 0 to {}", i64::MAX)));
        }
        between("steps", self.steps as f64, 1.0, 1e12)?;
        between("checkpoint_every", self.checkpoint_every as f64, 1.0, 1e12)?;
        self.rollout.validate()?;
        self.ppo.validate()?;
        if let Some(warm_start) = &self.warm_start {
            between("warm_start.decisions", warm_start.decisions as f64, 1.0, 1e9)?;
            between("warm_start.learning_rate", warm_start.learning_rate, 1e-9, 1.0)?;
        }
        self.environment.validate()
    }

    /// Steps that every environment takes for a batch.
    #[must_use]
    pub fn steps_per_environment(&self) -> usize {
        self.ppo.batch.div_ceil(self.rollout.environments)
    }
}

impl EnvironmentConfig {
    fn validate(&self) -> Result<()> {
        match self {
            Self::Toy(toy) => between("environment.tokens", toy.tokens as f64, 2.0, 1000.0),
            Self::Strips(strips) => {
                strips.simulation.validate()?;
                Ok(strips.episode.validate()?)
            }
        }
    }
}

impl RolloutConfig {
    fn validate(&self) -> Result<()> {
        between("rollout.environments", self.environments as f64, 1.0, 65536.0)?;
        between("rollout.group", self.group as f64, 1.0, self.environments as f64)?;
        between("rollout.stagger", self.stagger as f64, 0.0, 1e9)?;
        if !self.environments.is_multiple_of(self.group) {
            let limit = format!("a divisor of rollout.environments, {}", self.environments);
            return Err(setting("rollout.group", self.group, &limit));
        }
        Ok(())
    }
}

impl PpoConfig {
    fn validate(&self) -> Result<()> {
        for (key, value, least, most) in [
            ("ppo.batch", self.batch as f64, 2.0, 1e7),
            ("ppo.minibatch", self.minibatch as f64, 1.0, self.batch as f64),
            ("ppo.epochs", self.epochs as f64, 1.0, 1000.0),
            ("ppo.learning_rate", self.learning_rate, 1e-12, 1.0),
            ("ppo.learning_rate_end", self.learning_rate_end, 0.0, 1.0),
            ("ppo.gamma", self.gamma, 0.0, 1.0),
            ("ppo.lambda", self.lambda, 0.0, 1.0),
            ("ppo.clip", self.clip, 1e-6, 10.0),
            ("ppo.gradient_norm", self.gradient_norm, 1e-6, 1e6),
            ("ppo.value_coefficient", self.value_coefficient, 0.0, 1e6),
            ("ppo.value_clamp", self.value_clamp.unwrap_or(1.0), 1e-6, 1e9),
            ("ppo.entropy_coefficient", self.entropy_coefficient, 0.0, 100.0),
            ("ppo.transition_entropy_coefficient", self.transition_entropy_coefficient, 0.0, 100.0),
            ("ppo.kl_stop", self.kl_stop.unwrap_or(1.0), 1e-9, 1e3),
            ("ppo.shards", self.shards as f64, 1.0, self.minibatch as f64),
        ] {
            between(key, value, least, most)?;
        }
        if let Some(penalty) = &self.kl_penalty {
            between("ppo.kl_penalty.coefficient", penalty.coefficient, 0.0, 1e3)?;
            between("ppo.kl_penalty.target", penalty.target, 1e-9, 1e3)?;
        }
        Ok(())
    }
}

fn between(key: &str, value: f64, least: f64, most: f64) -> Result<()> {
    if (least..=most).contains(&value) {
        return Ok(());
    }
    Err(setting(key, value, &format!("in {least} to {most}")))
}

fn setting(key: &str, value: impl ToString, limit: &str) -> TrainingError {
    TrainingError::Setting { key: key.to_owned(), value: value.to_string(), limit: limit.to_owned() }
}
