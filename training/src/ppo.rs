//! Proximal policy optimisation of a hybrid policy: one batch of experience in, better weights out.

use rand::Rng;
use rand::seq::SliceRandom;
use rayon::prelude::*;
use tch::{Device, Kind, Tensor};

use crate::adam::Adam;
use crate::config::PpoConfig;
use crate::distribution::{self, SquashedGaussian};
use crate::environment::ObservationShape;
use crate::error::{Result, TrainingError};
use crate::network::{Network, Observations};
use crate::parameters::Parameters;
use crate::rollout::{self, Segment};
use crate::stop::Stop;

/// The learner's state besides the weights.
#[derive(Debug)]
pub struct Ppo {
    /// Hyperparameters.
    pub config: PpoConfig,
    /// Optimiser.
    pub adam: Adam,
    /// Present weight of the KL penalty; 0 when there is none.
    pub kl_coefficient: f64,
}

/// What a batch of experience is learned for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Aim {
    /// The policy gathered it: actions that turned out well become more probable.
    Improve,
    /// A teacher gathered it: its actions become more probable.
    Imitate,
}

/// One batch to learn from.
#[derive(Debug, Clone, Copy)]
pub struct Lesson<'a> {
    /// Experience.
    pub segments: &'a [Segment],
    /// What for.
    pub aim: Aim,
    /// Adam's step.
    pub learning_rate: f64,
    /// Environment steps taken so far, for errors.
    pub step: u64,
    /// Ends it before its time.
    pub stop: &'a Stop,
}

/// The loss that is made small.
struct Objective<'a> {
    aim: Aim,
    config: &'a PpoConfig,
    kl_coefficient: f64,
    network: &'a Network,
}

/// Experience as tensors, with what the policy that gathered it said. All have one row a decision.
#[derive(Debug)]
struct Batch {
    observations: Observations,
    choice: Tensor,
    latent: Tensor,
    log_probabilities: Tensor,
    gaussian: SquashedGaussian,
    log_density: Tensor,
    /// Advantages, standardised.
    advantage: Tensor,
    /// What the critic should have said.
    value: Tensor,
}

/// Means over an update.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct UpdateStatistics {
    /// Clipped surrogate, or log-likelihood of the teacher's actions, to be made large.
    pub surrogate: f64,
    /// Squared error of the critic.
    pub value_loss: f64,
    /// KL divergence of the new policy from the old one, over the last pass.
    pub kl: f64,
    /// Share of the decisions whose ratio was clipped.
    pub clip_fraction: f64,
    /// Entropy of the discrete actor [nat].
    pub entropy: f64,
    /// Entropy of the continuous actor before squashing [nat].
    pub transition_entropy: f64,
    /// Global norm of the gradient before clipping.
    pub gradient_norm: f64,
    /// Share of the returns' variance that the critic explained before the update.
    pub explained_variance: f64,
    /// Passes over the batch.
    pub epochs: f64,
}

/// Number of sums over a shard's decisions, in the order in which [`Objective::loss`] gives them.
const SUMS: usize = 6;

/// Sums over all minibatches of an update.
#[derive(Debug, Default)]
struct Whole {
    sums: [f64; SUMS],
    norm: f64,
    minibatches: f64,
}

impl Ppo {
    /// A fresh learner for `count` weights.
    #[must_use]
    pub fn new(config: PpoConfig, count: usize, device: Device) -> Self {
        let kl_coefficient = config.kl_penalty.map_or(0.0, |penalty| penalty.coefficient);
        Self { adam: Adam::new(count, device), kl_coefficient, config }
    }

    /// Changes the weights by several passes over a batch of experience.
    ///
    /// # Errors
    /// A gradient that is not finite. [`TrainingError::Stopped`], with weights that are partly changed.
    pub fn update(
        &mut self,
        network: &Network,
        parameters: &mut Parameters,
        lesson: Lesson<'_>,
        rng: &mut impl Rng,
    ) -> Result<UpdateStatistics> {
        let batch = Batch::new(network, lesson.segments, parameters.flat.device())?;
        let mut order: Vec<i64> = (0..batch.len() as i64).collect();
        let (mut whole, mut epochs, mut kl) = (Whole::default(), 0.0, 0.0);
        for _ in 0..self.config.epochs {
            order.shuffle(rng);
            kl = self.pass(network, parameters, &lesson, &batch, &order, &mut whole)? / batch.len() as f64;
            epochs += 1.0;
            if lesson.aim == Aim::Improve && self.config.kl_stop.is_some_and(|limit| kl > limit) {
                break;
            }
        }
        if lesson.aim == Aim::Improve {
            self.adapt_kl(kl);
        }
        let decisions = batch.len() as f64 * epochs;
        Ok(UpdateStatistics {
            surrogate: whole.sums[0] / decisions,
            value_loss: whole.sums[1] / decisions,
            kl,
            clip_fraction: whole.sums[3] / decisions,
            entropy: whole.sums[4] / decisions,
            transition_entropy: whole.sums[5] / decisions,
            gradient_norm: whole.norm / whole.minibatches,
            explained_variance: explained_variance(lesson.segments),
            epochs,
        })
    }

    /// One pass over a batch in the given order; the sum of the KL divergence over its decisions.
    fn pass(
        &mut self,
        network: &Network,
        parameters: &mut Parameters,
        lesson: &Lesson<'_>,
        batch: &Batch,
        order: &[i64],
        whole: &mut Whole,
    ) -> Result<f64> {
        let mut kl = 0.0;
        for minibatch in order.chunks(self.config.minibatch) {
            lesson.stop.check()?;
            let (gradient, sums) = self.gradient(network, parameters, batch, lesson.aim, minibatch)?;
            let norm = gradient.norm().double_value(&[]);
            if !norm.is_finite() {
                return Err(TrainingError::NotFinite { quantity: "the gradient", step: lesson.step });
            }
            let scale = (self.config.gradient_norm / (norm + 1e-6)).min(1.0);
            self.adam.step(parameters, &(gradient * scale), lesson.learning_rate);
            kl += sums[2];
            for (sum, own) in whole.sums.iter_mut().zip(sums) {
                *sum += own;
            }
            whole.norm += norm;
            whole.minibatches += 1.0;
        }
        Ok(kl)
    }

    /// Gradient of the mean loss over a minibatch, and sums of its parts: the minibatch is cut into
    /// shards that threads share, and their gradients are added in a fixed order.
    fn gradient(
        &self,
        network: &Network,
        parameters: &Parameters,
        batch: &Batch,
        aim: Aim,
        minibatch: &[i64],
    ) -> Result<(Tensor, [f64; SUMS])> {
        let shard = minibatch.len().div_ceil(self.config.shards);
        let objective = Objective { aim, config: &self.config, kl_coefficient: self.kl_coefficient, network };
        let tasks: Vec<(Parameters, Batch)> =
            minibatch.chunks(shard).map(|rows| (parameters.share(), batch.rows(rows))).collect();
        let results: Vec<Result<(Tensor, [f64; SUMS])>> = tasks
            .into_par_iter()
            .map(|(parameters, rows)| {
                let (loss, sums) = objective.loss(&parameters, &rows);
                let gradient = parameters.gradient(&(loss / minibatch.len() as f64))?;
                let sums = rollout::to_vec(&sums)?;
                Ok((gradient, std::array::from_fn(|index| f64::from(sums[index]))))
            })
            .collect();
        let mut total: Option<(Tensor, [f64; SUMS])> = None;
        for result in results {
            let (gradient, sums) = result?;
            total = Some(match total {
                None => (gradient, sums),
                Some((so_far, so_far_sums)) => {
                    (so_far + gradient, std::array::from_fn(|index| so_far_sums[index] + sums[index]))
                }
            });
        }
        total.ok_or_else(|| TrainingError::Environment("a minibatch is empty".into()))
    }

    fn adapt_kl(&mut self, kl: f64) {
        if let Some(penalty) = self.config.kl_penalty {
            if kl > 2.0 * penalty.target {
                self.kl_coefficient *= 1.5;
            } else if kl < 0.5 * penalty.target {
                self.kl_coefficient *= 0.5;
            }
        }
    }
}

impl Objective<'_> {
    /// Sum of the loss over some decisions (eqs 16, 17, 20), and the sums that are reported.
    fn loss(&self, parameters: &Parameters, batch: &Batch) -> (Tensor, Tensor) {
        let (config, network) = (self.config, self.network);
        let assessment = network.assess(parameters, &batch.observations);
        let logs = distribution::log_probabilities(&assessment.logits);
        let old = &batch.log_probabilities;
        let choice_log = distribution::chosen(&logs, &batch.choice);
        let choice_ratio = &choice_log - distribution::chosen(old, &batch.choice);
        let entropy = distribution::entropy(&logs);
        let mut kl = distribution::categorical_kl(old, &logs);
        let transition = network.transition(parameters, &batch.observations, &assessment, &batch.choice);
        let mut transition_entropy = entropy.zeros_like();
        let transition_log = transition.map(|gaussian| {
            kl += batch.gaussian.kl(&gaussian);
            transition_entropy = gaussian.latent_entropy();
            gaussian.log_density(&batch.latent)
        });
        let transition_ratio = transition_log.as_ref().map(|log| log - &batch.log_density);
        let (surrogate, clipped) = match (self.aim, transition_ratio) {
            (Aim::Imitate, _) => {
                let likelihood = transition_log.map_or_else(|| choice_log.shallow_clone(), |log| &choice_log + log);
                (likelihood, entropy.zeros_like())
            }
            (Aim::Improve, None) => self.surrogate(&choice_ratio, &batch.advantage),
            (Aim::Improve, Some(transition_ratio)) if network.has_separate_objectives() => {
                let (a, clipped_a) = self.surrogate(&choice_ratio, &batch.advantage);
                let (b, clipped_b) = self.surrogate(&transition_ratio, &batch.advantage);
                (a + b, (clipped_a + clipped_b) * 0.5)
            }
            (Aim::Improve, Some(transition_ratio)) => {
                self.surrogate(&(choice_ratio + transition_ratio), &batch.advantage)
            }
        };
        let error = (&assessment.value - &batch.value).square();
        let error = match config.value_clamp {
            Some(limit) => error.clamp_max(limit),
            None => error,
        };
        let parts = [&surrogate, &error, &kl, &clipped, &entropy, &transition_entropy];
        let sums = Tensor::stack(&parts, 0).sum_dim_intlist(-1, false, Kind::Float);
        let weights = match self.aim {
            Aim::Imitate => [-1.0, config.value_coefficient, 0.0, 0.0, 0.0, 0.0],
            Aim::Improve => [
                -1.0,
                config.value_coefficient,
                self.kl_coefficient,
                0.0,
                -config.entropy_coefficient,
                -config.transition_entropy_coefficient,
            ],
        };
        let weights = Tensor::from_slice(&weights).to_kind(Kind::Float).to_device(sums.device());
        ((&sums * weights).sum(Kind::Float), sums.detach())
    }

    /// The clipped surrogate of each decision (eq. 16), and 1 where the ratio is clipped.
    fn surrogate(&self, log_ratio: &Tensor, advantage: &Tensor) -> (Tensor, Tensor) {
        let clip = self.config.clip;
        let ratio = log_ratio.exp();
        let clipped = ratio.clamp(1.0 - clip, 1.0 + clip);
        let outside = (ratio.detach() - 1.0).abs().gt(clip).to_kind(Kind::Float);
        ((ratio * advantage).minimum(&(clipped * advantage)), outside)
    }
}

impl Batch {
    fn new(network: &Network, segments: &[Segment], device: Device) -> Result<Self> {
        let ObservationShape { tokens, features } = network.shape();
        let join = |part: fn(&Segment) -> &[f32]| {
            let joined: Vec<f32> = segments.iter().flat_map(part).copied().collect();
            Tensor::from_slice(&joined).to_device(device)
        };
        let valid: Vec<bool> = segments.iter().flat_map(|it| &it.valid).copied().collect();
        let choice: Vec<i64> = segments.iter().flat_map(|it| &it.choice).copied().collect();
        let shape = [-1, tokens as i64, features as i64];
        let padded = !valid.iter().all(|&valid| valid);
        let observations = Observations {
            features: join(|it| &it.features).view(shape),
            valid: padded.then(|| Tensor::from_slice(&valid).view([-1, tokens as i64]).to_device(device)),
        };
        let logits = join(|it| &it.logits).view([-1, network.choices() as i64]);
        let latent = join(|it| &it.latent);
        let gaussian = SquashedGaussian::from_outputs(&join(|it| &it.gaussian).view([-1, 2]));
        let (advantage, value) = (join(|it| &it.advantage), join(|it| &it.value));
        Ok(Self {
            observations,
            choice: Tensor::from_slice(&choice).to_device(device),
            log_probabilities: distribution::log_probabilities(&logits),
            log_density: gaussian.log_density(&latent),
            value: &advantage + value,
            advantage: standardised(&advantage),
            gaussian,
            latent,
        })
    }

    fn len(&self) -> usize {
        self.choice.size()[0] as usize
    }

    fn rows(&self, rows: &[i64]) -> Self {
        let index = Tensor::from_slice(rows).to_device(self.choice.device());
        let pick = |tensor: &Tensor| tensor.index_select(0, &index);
        Self {
            observations: Observations {
                features: pick(&self.observations.features),
                valid: self.observations.valid.as_ref().map(pick),
            },
            choice: pick(&self.choice),
            latent: pick(&self.latent),
            log_probabilities: pick(&self.log_probabilities),
            gaussian: SquashedGaussian {
                mean: pick(&self.gaussian.mean),
                log_deviation: pick(&self.gaussian.log_deviation),
            },
            log_density: pick(&self.log_density),
            advantage: pick(&self.advantage),
            value: pick(&self.value),
        }
    }
}

/// To mean 0 and deviation 1.
fn standardised(x: &Tensor) -> Tensor {
    let centred = x - x.mean(Kind::Float);
    let deviation = centred.square().mean(Kind::Float).sqrt();
    centred / (deviation + 1e-8)
}

/// 1 − variance of (return − value) / variance of the returns; 0 when all returns are equal.
fn explained_variance(segments: &[Segment]) -> f64 {
    let errors = || segments.iter().flat_map(|it| &it.advantage).map(|&x| f64::from(x));
    let values = segments.iter().flat_map(|it| &it.value).map(|&x| f64::from(x));
    let returns: Vec<f64> = errors().zip(values).map(|(error, value)| error + value).collect();
    let spread = variance(returns.iter().copied());
    if spread > 0.0 { 1.0 - variance(errors()) / spread } else { 0.0 }
}

fn variance(numbers: impl Iterator<Item = f64> + Clone) -> f64 {
    let count = numbers.clone().count() as f64;
    let mean = numbers.clone().sum::<f64>() / count;
    numbers.map(|x| (x - mean).powi(2)).sum::<f64>() / count
}
