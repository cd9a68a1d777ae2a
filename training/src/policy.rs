//! Trained policies as the planner node and the evaluation fly them: one observation, one decision.

use std::path::Path;

use serde::Serialize;
use serde_json::Value;
use swath_sim::config::SimConfig;
use swath_sim::learn::hybrid::{decision, wait};
use swath_sim::learn::observation::{ObservationSet, observe};
use swath_sim::planner::{Decision, DecisionContext, Planner, PlannerError, Rationale};
use tch::{Device, Tensor};

use crate::config::{EnvironmentConfig, RunConfig};
use crate::distribution::{best_choice, squash};
use crate::environment::{Action, ObservationShape};
use crate::error::{Result, TrainingError};
use crate::network::Network;
use crate::parameters::Parameters;
use crate::rollout::{finite, observations, to_vec};
use crate::store::Content;
use crate::weights::{self, settings};

/// Largest file that is read as a policy [bytes]; the paper's own sizes fit.
const LARGEST_FILE: u64 = 1 << 30;

/// A trained policy, read from a checkpoint or policy file.
#[derive(Debug)]
pub struct Policy {
    network: Network,
    parameters: Parameters,
    set: ObservationSet,
    run: RunConfig,
    steps: u64,
    digest: String,
    longest_s: f64,
    satellite: SimConfig,
}

/// What a policy says about one observation.
#[derive(Debug, Clone, PartialEq)]
pub struct Judgement {
    /// Probability of each token, in the order of the candidates; 0 for padding.
    pub probabilities: Vec<f32>,
    /// The critic's value.
    pub value: f32,
    /// The most probable action.
    pub action: Action,
}

/// Where a setting of the satellite that is flown differs from the one that a policy was trained on.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Difference {
    /// Dotted path, as in a mission's `[sim]` section.
    pub setting: String,
    /// Its value in training.
    pub trained: Value,
    /// Its value in flight.
    pub flown: Value,
}

/// The bytes of a file that may be a policy.
pub(crate) fn read(path: &Path) -> Result<Vec<u8>> {
    let size = std::fs::metadata(path).map_err(TrainingError::file("read", path))?.len();
    if size > LARGEST_FILE {
        let reason = format!("it has {size} bytes, a policy has at most {LARGEST_FILE}");
        return Err(TrainingError::unsuitable(path, reason));
    }
    std::fs::read(path).map_err(TrainingError::file("read", path))
}

impl Policy {
    /// Reads a policy. libtorch runs on one thread afterwards, so that the same observation always
    /// gives the same action.
    ///
    /// # Errors
    /// A file that cannot be read, is damaged, or was trained on another problem than strips.
    pub fn load(path: &Path) -> Result<Self> {
        Self::from_bytes(&read(path)?, path)
    }

    /// As [`Policy::load`], with the bytes of a file already at hand; `path` is what errors name.
    ///
    /// # Errors
    /// As [`Policy::load`].
    pub fn from_bytes(bytes: &[u8], path: &Path) -> Result<Self> {
        let content = Content::from_bytes(bytes, path)?;
        let header = weights::header(&content, path)?;
        let EnvironmentConfig::Strips(strips) = &header.run.environment else {
            return Err(TrainingError::unsuitable(path, "it was not trained on strips"));
        };
        let shape =
            ObservationShape { tokens: strips.simulation.planning.candidates, features: strips.observation.features() };
        let longest_s = strips.simulation.planning.t_pre_max_s;
        let (network, layout) = Network::new(&header.run.network, shape, longest_s)?;
        let weights = weights::flat_weights(&content, &layout, path)?;
        tch::set_num_threads(1);
        Ok(Self {
            parameters: Parameters::from_flat(&layout, Tensor::from_slice(&weights))?,
            network,
            set: strips.observation,
            steps: header.steps,
            digest: content.digest(),
            longest_s,
            satellite: strips.simulation.clone(),
            run: header.run,
        })
    }

    /// SHA-256 of header and weights, in hexadecimal.
    #[must_use]
    pub fn digest(&self) -> &str {
        &self.digest
    }

    /// The run that trained it.
    #[must_use]
    pub fn run(&self) -> &RunConfig {
        &self.run
    }

    /// The satellite that it was trained on.
    #[must_use]
    pub fn satellite(&self) -> &SimConfig {
        &self.satellite
    }

    /// Every setting in which a satellite is not the one that it was trained on.
    ///
    /// # Errors
    /// A satellite that JSON cannot hold.
    pub fn differences(&self, flown: &SimConfig) -> Result<Vec<Difference>> {
        let (trained, flown) = (settings(&self.satellite)?, settings(flown)?);
        let differing = trained.into_iter().filter_map(|(setting, trained)| {
            let flown = flown.get(&setting).cloned().unwrap_or(Value::Null);
            (trained != flown).then_some(Difference { setting, trained, flown })
        });
        Ok(differing.collect())
    }

    /// Environment steps that it was trained for.
    #[must_use]
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Features it wants of each strip.
    #[must_use]
    pub fn observation_set(&self) -> ObservationSet {
        self.set
    }

    /// Size of the observations it takes.
    #[must_use]
    pub fn shape(&self) -> ObservationShape {
        self.network.shape()
    }

    /// Longest transition it was trained with [s].
    #[must_use]
    pub fn longest_transition_s(&self) -> f64 {
        self.longest_s
    }

    /// Judges one observation: `features` is tokens × features in row order, `valid` false for padding.
    ///
    /// # Errors
    /// An observation of another shape or without a valid token, and outputs that are not finite.
    pub fn judge(&self, features: &[f32], valid: &[bool]) -> Result<Judgement> {
        let shape = self.network.shape();
        if features.len() != shape.len() || valid.len() != shape.tokens || !valid.contains(&true) {
            let found = format!("{} numbers for {} tokens", features.len(), valid.len());
            let wanted = format!("{} × {} numbers, one valid", shape.tokens, shape.features);
            return Err(TrainingError::Shape { wanted, found });
        }
        let _guard = tch::no_grad_guard();
        let seen = observations(features, valid, shape, Device::Cpu);
        let assessment = self.network.assess(&self.parameters, &seen);
        let logits = finite(to_vec(&assessment.logits)?, "choice")?;
        let value = finite(to_vec(&assessment.value)?, "value")?[0];
        let choice = best_choice(&logits);
        let (token, fixed) = self.network.decode(choice);
        let index = Tensor::from_slice(&[choice as i64]);
        let transition = self.network.transition(&self.parameters, &seen, &assessment, &index);
        let parameter = match (fixed, transition) {
            (Some(parameter), _) => parameter,
            (None, Some(gaussian)) => squash(finite(to_vec(&gaussian.mean)?, "transition")?[0]),
            (None, None) => 0.0,
        };
        Ok(Judgement { probabilities: self.token_probabilities(&logits), value, action: Action { token, parameter } })
    }

    /// The critic's values of several observations, one after the other in `features` and `valid`.
    ///
    /// # Errors
    /// Observations of another shape, and values that are not finite.
    pub fn values(&self, features: &[f32], valid: &[bool]) -> Result<Vec<f32>> {
        let shape = self.network.shape();
        if features.len() * shape.tokens != valid.len() * shape.len() || !valid.len().is_multiple_of(shape.tokens) {
            let found = format!("{} numbers for {} tokens", features.len(), valid.len());
            return Err(TrainingError::Shape {
                wanted: format!("{} × {} numbers each", shape.tokens, shape.features),
                found,
            });
        }
        let _guard = tch::no_grad_guard();
        let seen = observations(features, valid, shape, Device::Cpu);
        finite(to_vec(&self.network.assess(&self.parameters, &seen).value)?, "value")
    }

    /// Softmax of the logits, summed over the choices of each token.
    fn token_probabilities(&self, logits: &[f32]) -> Vec<f32> {
        let largest = logits.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        let weights: Vec<f64> = logits.iter().map(|&logit| f64::from(logit - largest).exp()).collect();
        let total: f64 = weights.iter().sum();
        let mut probabilities = vec![0.0f64; self.network.shape().tokens];
        for (choice, weight) in weights.iter().enumerate() {
            probabilities[self.network.decode(choice).0] += weight / total;
        }
        probabilities.into_iter().map(|p| p as f32).collect()
    }
}

/// A policy as a [`Planner`]: the most probable strip, and the mean of its transition.
#[derive(Debug)]
pub struct LearnedPlanner {
    policy: Policy,
    features: Vec<f32>,
    valid: Vec<bool>,
    judgement: Option<Judgement>,
}

impl LearnedPlanner {
    /// A planner that follows a policy.
    #[must_use]
    pub fn new(policy: Policy) -> Self {
        let shape = policy.shape();
        Self { policy, features: vec![0.0; shape.len()], valid: vec![false; shape.tokens], judgement: None }
    }

    /// The policy.
    #[must_use]
    pub fn policy(&self) -> &Policy {
        &self.policy
    }

    /// What the policy says of a situation with at least one candidate.
    ///
    /// # Errors
    /// As [`Policy::judge`], and a mission with more candidates or another longest transition than in training.
    pub fn consider(&mut self, context: &DecisionContext<'_>) -> Result<Judgement> {
        let (count, slots) = (context.candidates.len(), self.valid.len());
        let longest_s = context.model.config.planning.t_pre_max_s;
        if count > slots || longest_s != self.policy.longest_s {
            return Err(TrainingError::Shape {
                wanted: format!("at most {slots} candidates and {} s", self.policy.longest_s),
                found: format!("{count} candidates and {longest_s} s"),
            });
        }
        observe(context, self.policy.set, &mut self.features, &mut self.valid);
        self.policy.judge(&self.features, &self.valid)
    }

    /// What the policy said at the last decision; none before the first and after a wait.
    #[must_use]
    pub fn judgement(&self) -> Option<&Judgement> {
        self.judgement.as_ref()
    }
}

impl Planner for LearnedPlanner {
    fn name(&self) -> String {
        self.policy.run.network.kind().to_owned()
    }

    fn rationale(&self) -> Option<Rationale> {
        let judgement = self.judgement.as_ref()?;
        Some(Rationale {
            probabilities: judgement.probabilities.clone(),
            value: judgement.value,
            policy: self.policy.digest.clone(),
        })
    }

    fn decide(&mut self, context: &DecisionContext<'_>) -> std::result::Result<Decision, PlannerError> {
        self.judgement = None;
        if context.candidates.is_empty() {
            return Ok(wait(context.model));
        }
        let judgement = self.consider(context).map_err(|error| PlannerError::Policy(error.to_string()))?;
        let action = judgement.action;
        self.judgement = Some(judgement);
        Ok(decision(context.model, action))
    }
}
