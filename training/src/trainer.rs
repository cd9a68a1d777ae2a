//! A run in progress: environments, weights and learner, advanced one update at a time.

use std::path::Path;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use tch::Device;

use crate::adam::Adam;
use crate::checkpoint;
use crate::config::{EnvironmentConfig, RunConfig};
use crate::environment::Environment;
use crate::error::{Result, TrainingError};
use crate::network::Network;
use crate::parameters::{Layout, Parameters};
use crate::ppo::{Aim, Lesson, Ppo, UpdateStatistics};
use crate::rollout::{Actor, Discount, Group, Lead, Segment, Slot, SlotState, Tally};
use crate::strips::Strips;
use crate::toy::Toy;

/// Random streams of one seed: weights and shuffling, one for each environment, one for each that a teacher leads.
const STREAM_LEARNER: u64 = 0;
const STREAM_ENVIRONMENTS: u64 = 1;
const STREAM_LESSONS: u64 = 1 << 32;

/// Everything that a run consists of at one moment.
pub struct Trainer {
    run: RunConfig,
    network: Network,
    layout: Layout,
    parameters: Parameters,
    ppo: Ppo,
    groups: Vec<Group>,
    rng: ChaCha8Rng,
    steps: u64,
    reporting_period_s: f64,
    parameter_scale_s: f64,
}

/// What is needed besides the configuration to go on with a run exactly.
#[derive(Debug)]
pub struct TrainerState {
    /// Weights, as one vector.
    pub weights: Vec<f32>,
    /// Adam's running means.
    pub first: Vec<f32>,
    /// Adam's running squares.
    pub second: Vec<f32>,
    /// Adam's steps.
    pub adam_steps: u64,
    /// Weight of the KL penalty.
    pub kl_coefficient: f64,
    /// Environment steps taken.
    pub steps: u64,
    /// The learner's generator.
    pub rng: ChaCha8Rng,
    /// The environments.
    pub slots: Vec<SlotState>,
}

/// One update, for people and for plots.
#[derive(Debug, Clone, Copy)]
pub struct Report {
    /// Environment steps taken so far.
    pub steps: u64,
    /// Episodes that ended during the update.
    pub episodes: usize,
    /// Mean reward of these episodes; NaN when there was none.
    pub episode_return: f64,
    /// Reward per orbit over all decisions of the update.
    pub reward_per_orbit: f64,
    /// Share of the attempts that succeeded.
    pub success_rate: f64,
    /// Mean transition time [s].
    pub t_pre_s: f64,
    /// Adam's step.
    pub learning_rate: f64,
    /// Weight of the KL penalty.
    pub kl_coefficient: f64,
    /// What the learner says.
    pub update: UpdateStatistics,
}

impl Trainer {
    /// A fresh run.
    ///
    /// # Errors
    /// A network that cannot be built, or an environment that cannot be made.
    pub fn new(run: RunConfig, device: Device) -> Result<Trainer> {
        let (network, layout, first) = build(&run)?;
        let mut rng = ChaCha8Rng::seed_from_u64(run.seed);
        rng.set_stream(STREAM_LEARNER);
        let parameters = Parameters::initial(&layout, &mut rng, device)?;
        let ppo = Ppo::new(run.ppo.clone(), layout.count(), device);
        Ok(Trainer {
            groups: groups(&run, &network, STREAM_ENVIRONMENTS, || environment(&run))?,
            reporting_period_s: first.reporting_period_s(),
            parameter_scale_s: first.parameter_scale_s(),
            run,
            network,
            layout,
            parameters,
            ppo,
            rng,
            steps: 0,
        })
    }

    /// A run at a saved state.
    ///
    /// # Errors
    /// As [`Trainer::new`]; a state whose sizes are not the run's is a programming error of the
    /// caller, which [`crate::checkpoint`] rules out.
    pub fn restore(run: RunConfig, device: Device, state: TrainerState) -> Result<Trainer> {
        let (network, layout, first) = build(&run)?;
        let tensor = |numbers: &[f32]| tch::Tensor::from_slice(numbers).to_device(device);
        let parameters = Parameters::from_flat(&layout, tensor(&state.weights))?;
        let mut ppo = Ppo::new(run.ppo.clone(), layout.count(), device);
        ppo.adam.first = tensor(&state.first);
        ppo.adam.second = tensor(&state.second);
        ppo.adam.steps = state.adam_steps;
        ppo.kl_coefficient = state.kl_coefficient;
        let slots: Vec<Slot> =
            state.slots.into_par_iter().map(|slot| Slot::restore(environment(&run)?, slot)).collect::<Result<_>>()?;
        Ok(Trainer {
            groups: grouped(slots, &run, &network),
            reporting_period_s: first.reporting_period_s(),
            parameter_scale_s: first.parameter_scale_s(),
            run,
            network,
            layout,
            parameters,
            ppo,
            rng: state.rng,
            steps: state.steps,
        })
    }

    /// A run as a checkpoint has it.
    ///
    /// # Errors
    /// As [`checkpoint::load`] and [`Trainer::restore`].
    pub fn resume(run: RunConfig, path: &Path, device: Device) -> Result<Trainer> {
        let (_, layout, _) = build(&run)?;
        let state = checkpoint::load(path, &run, &layout)?;
        Trainer::restore(run, device, state)
    }

    /// Takes the weights of a policy or checkpoint of the same network and observation, and nothing else of it.
    ///
    /// # Errors
    /// A file that is damaged or holds another network or observation.
    pub fn adopt(&mut self, path: &Path) -> Result<()> {
        let weights = checkpoint::load_weights(path, &self.run, &self.layout)?;
        let flat = tch::Tensor::from_slice(&weights).to_device(self.parameters.flat.device());
        self.parameters = Parameters::from_flat(&self.layout, flat)?;
        Ok(())
    }

    /// Learns from the teacher, if the run has one, before PPO begins: `each` is given every batch's report, whose
    /// `surrogate` is the mean log-likelihood of the teacher's actions. Environments of their own are used, so what PPO
    /// experiences afterwards does not depend on how long this took.
    ///
    /// # Errors
    /// As [`Trainer::advance`]; a teacher that cannot be made.
    pub fn warm_start(&mut self, mut each: impl FnMut(&Report)) -> Result<()> {
        let Some(config) = self.run.warm_start.clone() else {
            return Ok(());
        };
        let mut groups = groups(&self.run, &self.network, STREAM_LESSONS, || {
            Ok(match &self.run.environment {
                EnvironmentConfig::Toy(toy) => Box::new(Toy::new(toy.tokens)),
                EnvironmentConfig::Strips(strips) => {
                    Box::new(Strips::new(strips)?.with_teacher(config.teacher.clone())?)
                }
            })
        })?;
        let mut shown = 0;
        while shown < config.decisions {
            let segments = self.collect(&mut groups, Lead::Teacher)?;
            let learning_rate = config.learning_rate * (1.0 - 0.9 * shown as f64 / config.decisions as f64);
            let update = self.update(&segments, Aim::Imitate, learning_rate)?;
            shown += segments.iter().map(|it| it.choice.len() as u64).sum::<u64>();
            each(&Report { steps: shown, ..self.report(&segments, learning_rate, update) });
        }
        self.ppo.adam = Adam::new(self.layout.count(), self.parameters.flat.device());
        Ok(())
    }

    /// What must be saved to go on later.
    pub fn state(&self) -> Result<TrainerState> {
        let slots = self.groups.iter().flat_map(|group| group.slots());
        Ok(TrainerState {
            weights: crate::rollout::to_vec(&self.parameters.flat)?,
            first: crate::rollout::to_vec(&self.ppo.adam.first)?,
            second: crate::rollout::to_vec(&self.ppo.adam.second)?,
            adam_steps: self.ppo.adam.steps,
            kl_coefficient: self.ppo.kl_coefficient,
            steps: self.steps,
            rng: self.rng.clone(),
            slots: slots.map(Slot::state).collect(),
        })
    }

    /// The run.
    pub fn run(&self) -> &RunConfig {
        &self.run
    }

    /// Names and shapes of the weights.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// The network's structure.
    pub fn network(&self) -> &Network {
        &self.network
    }

    /// Environment steps taken.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Whether the run has taken all its steps.
    pub fn is_finished(&self) -> bool {
        self.steps >= self.run.steps
    }

    /// Gathers one batch and learns from it.
    ///
    /// # Errors
    /// Numbers that are not finite, with the step; an environment that fails.
    pub fn advance(&mut self) -> Result<Report> {
        let segments = self.gather()?;
        let learning_rate = self.learning_rate();
        let update = self.learn(&segments)?;
        self.steps += segments.iter().map(|it| it.choice.len() as u64).sum::<u64>();
        Ok(self.report(&segments, learning_rate, update))
    }

    /// Adam's present step.
    fn learning_rate(&self) -> f64 {
        let progress = (self.steps as f64 / self.run.steps as f64).min(1.0);
        let (start, end) = (self.run.ppo.learning_rate, self.run.ppo.learning_rate_end);
        start + progress * (end - start)
    }

    /// Learns from one batch.
    pub fn learn(&mut self, segments: &[Segment]) -> Result<UpdateStatistics> {
        self.update(segments, Aim::Improve, self.learning_rate())
    }

    fn update(&mut self, segments: &[Segment], aim: Aim, learning_rate: f64) -> Result<UpdateStatistics> {
        let (network, parameters) = (&self.network, &mut self.parameters);
        let lesson = Lesson { segments, aim, learning_rate };
        self.ppo.update(network, parameters, lesson, &mut self.rng, self.steps)
    }

    /// Steps all environments for one batch.
    pub fn gather(&mut self) -> Result<Vec<Segment>> {
        let mut groups = std::mem::take(&mut self.groups);
        let segments = self.collect(&mut groups, Lead::Policy);
        self.groups = groups;
        segments
    }

    fn collect(&self, groups: &mut [Group], lead: Lead) -> Result<Vec<Segment>> {
        let steps = self.run.steps_per_environment();
        let discount = Discount { gamma: self.run.ppo.gamma, lambda: self.run.ppo.lambda };
        let device = self.parameters.flat.device();
        let network = &self.network;
        let actors: Vec<Actor> =
            groups.iter().map(|_| Actor { network, parameters: self.parameters.share(), device }).collect();
        groups
            .par_iter_mut()
            .zip(actors)
            .map(|(group, actor)| group.collect(&actor, steps, discount, lead))
            .collect::<Result<_>>()
            .map_err(|error| match error {
                TrainingError::PolicyNotFinite { quantity } => TrainingError::NotFinite { quantity, step: self.steps },
                error => error,
            })
    }

    /// Reward per orbit, success and mean transition of segments.
    fn report(&self, segments: &[Segment], learning_rate: f64, update: UpdateStatistics) -> Report {
        let mut all = Tally::default();
        segments.iter().for_each(|segment| all += segment.tally);
        let finished: Vec<f64> =
            segments.iter().flat_map(|segment| segment.finished.iter().map(|tally| tally.reward)).collect();
        let attempts = all.attempts as f64;
        Report {
            steps: self.steps,
            episodes: finished.len(),
            episode_return: finished.iter().sum::<f64>() / finished.len() as f64,
            reward_per_orbit: all.reward / all.duration_s * self.reporting_period_s,
            success_rate: all.successes as f64 / attempts,
            t_pre_s: all.parameters / attempts * self.parameter_scale_s,
            learning_rate,
            kl_coefficient: self.ppo.kl_coefficient,
            update,
        }
    }
}

impl Report {
    /// Everything but the steps under the names of plots; `speed` is in environment steps a second.
    pub fn scalars(&self, speed: f64) -> [(&'static str, f64); 17] {
        let update = &self.update;
        [
            ("return", self.episode_return),
            ("reward_per_orbit", self.reward_per_orbit),
            ("success_rate", self.success_rate),
            ("t_pre_mean_s", self.t_pre_s),
            ("kl", update.kl),
            ("clip_fraction", update.clip_fraction),
            ("entropy", update.entropy),
            ("transition_entropy", update.transition_entropy),
            ("explained_variance", update.explained_variance),
            ("gradient_norm", update.gradient_norm),
            ("surrogate", update.surrogate),
            ("value_loss", update.value_loss),
            ("epochs", update.epochs),
            ("learning_rate", self.learning_rate),
            ("kl_coefficient", self.kl_coefficient),
            ("episodes", self.episodes as f64),
            ("steps_per_s", speed),
        ]
    }
}

/// An environment of a run.
pub fn environment(run: &RunConfig) -> Result<Box<dyn Environment>> {
    Ok(match &run.environment {
        EnvironmentConfig::Toy(toy) => Box::new(Toy::new(toy.tokens)),
        EnvironmentConfig::Strips(strips) => Box::new(Strips::new(strips)?),
    })
}

/// The network of a run, and one of its environments.
fn build(run: &RunConfig) -> Result<(Network, Layout, Box<dyn Environment>)> {
    let first = environment(run)?;
    let (network, layout) = Network::new(&run.network, first.shape(), first.parameter_scale_s())?;
    Ok((network, layout, first))
}

/// Fresh environments in groups, with a random stream each.
fn groups(
    run: &RunConfig,
    network: &Network,
    first_stream: u64,
    environment: impl Fn() -> Result<Box<dyn Environment>> + Sync,
) -> Result<Vec<Group>> {
    let streams = first_stream..first_stream + run.rollout.environments as u64;
    let slot = |stream| Slot::new(environment()?, run.seed, stream, run.rollout.stagger);
    let slots = streams.into_par_iter().map(slot).collect::<Result<_>>()?;
    Ok(grouped(slots, run, network))
}

fn grouped(slots: Vec<Slot>, run: &RunConfig, network: &Network) -> Vec<Group> {
    let mut slots = slots.into_iter();
    let count = run.rollout.environments / run.rollout.group;
    (0..count).map(|_| Group::new(slots.by_ref().take(run.rollout.group).collect(), network.shape())).collect()
}
