//! A run in progress: environments, weights and learner, advanced one update at a time.

use std::borrow::Cow;
use std::path::Path;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use tch::Device;

use crate::adam::Adam;
use crate::config::{EnvironmentConfig, RunConfig, WarmStartConfig};
use crate::environment::Environment;
use crate::error::{Result, TrainingError};
use crate::network::Network;
use crate::parameters::{Layout, Parameters};
use crate::ppo::{Aim, Lesson, Ppo, UpdateStatistics};
use crate::rollout::{Actor, Course, Discount, Group, Lead, Segment, Slot, SlotState, Tally};
use crate::stop::Stop;
use crate::strips::Strips;
use crate::tensorboard::scalars::Report;
use crate::toy::Toy;
use crate::weights;

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
    /// The warm start, while it is not over.
    lessons: Option<Lessons>,
    rng: ChaCha8Rng,
    steps: u64,
    reporting_period_s: f64,
    parameter_scale_s: f64,
    stop: Stop,
    /// The state before an update that is under way, or that was given up.
    before: Option<TrainerState>,
}

/// A warm start under way.
#[derive(Default)]
struct Lessons {
    /// Environments that the teacher leads; none before the first lesson.
    groups: Vec<Group>,
    /// Decisions shown.
    shown: u64,
}

/// What is needed besides the configuration to go on with a run exactly.
#[derive(Debug, Clone)]
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
    /// The warm start, while it is not over.
    pub lessons: Option<LessonsState>,
}

/// How far a warm start has come.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LessonsState {
    /// Decisions shown.
    pub shown: u64,
    /// The environments that the teacher leads; none before the first lesson.
    pub slots: Vec<SlotState>,
}

impl Trainer {
    /// A fresh run.
    ///
    /// # Errors
    /// A network that cannot be built, or an environment that cannot be made.
    pub fn new(run: RunConfig, device: Device) -> Result<Self> {
        let (network, layout, first) = build(&run)?;
        let mut rng = ChaCha8Rng::seed_from_u64(run.seed);
        rng.set_stream(STREAM_LEARNER);
        let parameters = Parameters::initial(&layout, &mut rng, device)?;
        let ppo = Ppo::new(run.ppo.clone(), layout.count(), device);
        let stop = Stop::default();
        Ok(Self {
            groups: groups(&run, &network, STREAM_ENVIRONMENTS, &stop, || environment(&run))?,
            lessons: run.warm_start.as_ref().map(|_| Lessons::default()),
            reporting_period_s: first.reporting_period_s(),
            parameter_scale_s: first.parameter_scale_s(),
            run,
            network,
            layout,
            parameters,
            ppo,
            rng,
            steps: 0,
            stop,
            before: None,
        })
    }

    /// A run at a saved state.
    ///
    /// # Errors
    /// As [`Trainer::new`]; a state whose sizes are not the run's is a programming error of the
    /// caller, which [`crate::checkpoint`] rules out.
    pub fn restore(run: RunConfig, device: Device, state: TrainerState) -> Result<Self> {
        let (network, layout, first) = build(&run)?;
        let tensor = |numbers: &[f32]| tch::Tensor::from_slice(numbers).to_device(device);
        let parameters = Parameters::from_flat(&layout, tensor(&state.weights))?;
        let mut ppo = Ppo::new(run.ppo.clone(), layout.count(), device);
        ppo.adam.first = tensor(&state.first);
        ppo.adam.second = tensor(&state.second);
        ppo.adam.steps = state.adam_steps;
        ppo.kl_coefficient = state.kl_coefficient;
        let restored = |slots: Vec<SlotState>, lead: Lead| -> Result<Vec<Group>> {
            let slots = slots.into_par_iter().map(|slot| Slot::restore(led(&run, lead)?, slot, lead));
            Ok(grouped(slots.collect::<Result<_>>()?, &run, &network))
        };
        let groups = restored(state.slots, Lead::Policy)?;
        let lessons = state.lessons.map(|it| {
            let groups = if it.slots.is_empty() { Vec::new() } else { restored(it.slots, Lead::Teacher)? };
            Ok::<_, TrainingError>(Lessons { groups, shown: it.shown })
        });
        let lessons = lessons.transpose()?;
        Ok(Self {
            groups,
            lessons,
            reporting_period_s: first.reporting_period_s(),
            parameter_scale_s: first.parameter_scale_s(),
            run,
            network,
            layout,
            parameters,
            ppo,
            rng: state.rng,
            steps: state.steps,
            stop: Stop::default(),
            before: None,
        })
    }

    /// Names and shapes of a run's weights.
    ///
    /// # Errors
    /// As [`Trainer::new`].
    pub fn layout_of(run: &RunConfig) -> Result<Layout> {
        build(run).map(|(_, layout, _)| layout)
    }

    /// Takes the weights of a policy or checkpoint of the same network and observation, and nothing else of it.
    ///
    /// # Errors
    /// A file that is damaged or holds another network or observation.
    pub fn adopt(&mut self, path: &Path) -> Result<()> {
        let weights = weights::load_weights(path, &self.run, &self.layout)?;
        let flat = tch::Tensor::from_slice(&weights).to_device(self.parameters.flat.device());
        self.parameters = Parameters::from_flat(&self.layout, flat)?;
        Ok(())
    }

    /// Updates end with [`TrainingError::Stopped`] soon after this wish is uttered; [`Trainer::state`] stays what it was
    /// before the update.
    pub fn stop_on(&mut self, stop: Stop) {
        self.stop = stop;
    }

    /// Learns from the teacher to the end of the warm start, if the run has one: `each` is given every batch's report.
    ///
    /// # Errors
    /// As [`Trainer::lesson`].
    pub fn warm_start(&mut self, mut each: impl FnMut(&Report)) -> Result<()> {
        while let Some(report) = self.lesson()? {
            each(&report);
        }
        Ok(())
    }

    /// Shows one batch of the teacher's decisions and learns from it; `None` when the warm start is over or there is
    /// none. The report's `steps` are the decisions shown, its `surrogate` is the mean log-likelihood of the teacher's
    /// actions. Environments of their own are used, so what PPO experiences afterwards does not depend on how long this
    /// took.
    ///
    /// # Errors
    /// As [`Trainer::advance`]; a teacher that cannot be made.
    pub fn lesson(&mut self) -> Result<Option<Report>> {
        let (Some(_), Some(config)) = (&self.lessons, self.run.warm_start.clone()) else {
            return Ok(None);
        };
        self.as_one(|trainer| trainer.teach(&config)).map(Some)
    }

    fn teach(&mut self, config: &WarmStartConfig) -> Result<Report> {
        let Lessons { mut groups, shown } = self.lessons.take().unwrap_or_default();
        if groups.is_empty() {
            groups =
                self::groups(&self.run, &self.network, STREAM_LESSONS, &self.stop, || led(&self.run, Lead::Teacher))?;
        }
        let segments = self.collect(&mut groups, Lead::Teacher)?;
        let learning_rate = config.learning_rate * (1.0 - 0.9 * shown as f64 / config.decisions as f64);
        let update = self.update(&segments, Aim::Imitate, learning_rate)?;
        let shown = shown + decisions(&segments);
        if shown < config.decisions {
            self.lessons = Some(Lessons { groups, shown });
        } else {
            self.ppo.adam = Adam::new(self.layout.count(), self.parameters.flat.device());
        }
        Ok(Report { steps: shown, ..self.report(&segments, learning_rate, update) })
    }

    /// Does all of something or leaves the state what it was.
    fn as_one<T>(&mut self, act: impl FnOnce(&mut Self) -> Result<T>) -> Result<T> {
        if self.before.is_some() {
            return Err(TrainingError::Stopped);
        }
        self.before = Some(self.state()?);
        let outcome = act(self)?;
        self.before = None;
        Ok(outcome)
    }

    /// What must be saved to go on later. While an update is under way, and after one that failed or was stopped, this is
    /// the state before it; such a trainer does not go on, one restored from this state does.
    ///
    /// # Errors
    /// What libtorch refuses.
    pub fn state(&self) -> Result<TrainerState> {
        self.present().map(Cow::into_owned)
    }

    /// As [`Trainer::state`], without a copy where there is one already.
    pub(crate) fn present(&self) -> Result<Cow<'_, TrainerState>> {
        if let Some(before) = &self.before {
            return Ok(Cow::Borrowed(before));
        }
        Ok(Cow::Owned(TrainerState {
            weights: crate::rollout::to_vec(&self.parameters.flat)?,
            first: crate::rollout::to_vec(&self.ppo.adam.first)?,
            second: crate::rollout::to_vec(&self.ppo.adam.second)?,
            adam_steps: self.ppo.adam.steps,
            kl_coefficient: self.ppo.kl_coefficient,
            steps: self.steps,
            rng: self.rng.clone(),
            slots: slot_states(&self.groups),
            lessons: self.lessons.as_ref().map(|it| LessonsState { shown: it.shown, slots: slot_states(&it.groups) }),
        }))
    }

    /// The run.
    #[must_use]
    pub fn run(&self) -> &RunConfig {
        &self.run
    }

    /// Names and shapes of the weights.
    #[must_use]
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// The network's structure.
    #[must_use]
    pub fn network(&self) -> &Network {
        &self.network
    }

    /// Environment steps taken.
    #[must_use]
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Decisions that the warm start has shown; `None` once it is over, and without one.
    #[must_use]
    pub fn lessons_shown(&self) -> Option<u64> {
        match &self.before {
            Some(before) => before.lessons.as_ref().map(|it| it.shown),
            None => self.lessons.as_ref().map(|it| it.shown),
        }
    }

    /// Whether the run has taken all its steps.
    #[must_use]
    pub fn is_finished(&self) -> bool {
        self.steps >= self.run.steps
    }

    /// Gathers one batch and learns from it. A warm start is over then.
    ///
    /// # Errors
    /// Numbers that are not finite, with the step; an environment that fails; [`TrainingError::Stopped`].
    pub fn advance(&mut self) -> Result<Report> {
        self.lessons = None;
        self.as_one(|trainer| {
            let segments = trainer.gather()?;
            let learning_rate = trainer.learning_rate();
            let update = trainer.learn(&segments)?;
            trainer.steps += decisions(&segments);
            Ok(trainer.report(&segments, learning_rate, update))
        })
    }

    /// Adam's present step.
    fn learning_rate(&self) -> f64 {
        let progress = (self.steps as f64 / self.run.steps as f64).min(1.0);
        let (start, end) = (self.run.ppo.learning_rate, self.run.ppo.learning_rate_end);
        start + progress * (end - start)
    }

    /// Learns from one batch.
    ///
    /// # Errors
    /// As [`Ppo::update`].
    pub fn learn(&mut self, segments: &[Segment]) -> Result<UpdateStatistics> {
        self.update(segments, Aim::Improve, self.learning_rate())
    }

    fn update(&mut self, segments: &[Segment], aim: Aim, learning_rate: f64) -> Result<UpdateStatistics> {
        let (network, parameters) = (&self.network, &mut self.parameters);
        let lesson = Lesson { segments, aim, learning_rate, step: self.steps, stop: &self.stop };
        self.ppo.update(network, parameters, lesson, &mut self.rng)
    }

    /// Steps all environments for one batch.
    ///
    /// # Errors
    /// As [`Group::collect`].
    pub fn gather(&mut self) -> Result<Vec<Segment>> {
        let mut groups = std::mem::take(&mut self.groups);
        let segments = self.collect(&mut groups, Lead::Policy);
        self.groups = groups;
        segments
    }

    fn collect(&self, groups: &mut [Group], lead: Lead) -> Result<Vec<Segment>> {
        let course = Course {
            steps: self.run.steps_per_environment(),
            discount: Discount { gamma: self.run.ppo.gamma, lambda: self.run.ppo.lambda },
            lead,
            stop: &self.stop,
        };
        let device = self.parameters.flat.device();
        let network = &self.network;
        let actors: Vec<Actor> =
            groups.iter().map(|_| Actor { network, parameters: self.parameters.share(), device }).collect();
        groups
            .par_iter_mut()
            .zip(actors)
            .map(|(group, actor)| group.collect(&actor, &course))
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

fn decisions(segments: &[Segment]) -> u64 {
    segments.iter().map(|it| it.choice.len() as u64).sum()
}

fn slot_states(groups: &[Group]) -> Vec<SlotState> {
    groups.iter().flat_map(Group::slots).map(Slot::state).collect()
}

/// An environment of a run.
///
/// # Errors
/// A setting that is out of range.
pub fn environment(run: &RunConfig) -> Result<Box<dyn Environment>> {
    led(run, Lead::Policy)
}

/// An environment of a run, with the teacher of its warm start where that leads.
fn led(run: &RunConfig, lead: Lead) -> Result<Box<dyn Environment>> {
    Ok(match (&run.environment, &run.warm_start) {
        (EnvironmentConfig::Toy(toy), _) => Box::new(Toy::new(toy.tokens)),
        (EnvironmentConfig::Strips(strips), Some(warm_start)) if lead == Lead::Teacher => {
            Box::new(Strips::new(strips)?.with_teacher(warm_start.teacher.clone())?)
        }
        (EnvironmentConfig::Strips(strips), _) => Box::new(Strips::new(strips)?),
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
    stop: &Stop,
    environment: impl Fn() -> Result<Box<dyn Environment>> + Sync,
) -> Result<Vec<Group>> {
    let streams = first_stream..first_stream + run.rollout.environments as u64;
    let slot = |stream| {
        stop.check()?;
        Slot::new(environment()?, run.seed, stream, run.rollout.stagger)
    };
    let slots = streams.into_par_iter().map(slot).collect::<Result<_>>()?;
    Ok(grouped(slots, run, network))
}

fn grouped(slots: Vec<Slot>, run: &RunConfig, network: &Network) -> Vec<Group> {
    let mut slots = slots.into_iter();
    let count = run.rollout.environments / run.rollout.group;
    (0..count).map(|_| Group::new(slots.by_ref().take(run.rollout.group).collect(), network.shape())).collect()
}
