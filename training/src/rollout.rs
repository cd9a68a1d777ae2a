//! Experience: environments stepped in lockstep groups, one batched inference a step.
//!
//! Groups are fixed by the configuration and each environment draws from its own generator, so
//! what comes out does not depend on how many threads share the groups.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tch::{Device, Tensor};

use crate::distribution::{sample_choice, sample_latent, squash, unsquash};
use crate::environment::{Action, Environment, ObservationShape, Progress};
use crate::error::{Result, TrainingError};
use crate::gae::{self, Next};
use crate::network::{Network, Observations};
use crate::parameters::Parameters;
use crate::stop::Stop;

/// What an episode has brought so far.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Tally {
    /// Sum of rewards.
    pub reward: f64,
    /// Time flown [s].
    pub duration_s: f64,
    /// Decisions taken.
    pub attempts: u64,
    /// Attempts that succeeded.
    pub successes: u64,
    /// Sum of the parameters of all actions.
    pub parameters: f64,
}

impl std::ops::AddAssign for Tally {
    fn add_assign(&mut self, other: Self) {
        self.reward += other.reward;
        self.duration_s += other.duration_s;
        self.attempts += other.attempts;
        self.successes += other.successes;
        self.parameters += other.parameters;
    }
}

/// One environment with its generator and the history that reproduces its present state.
pub struct Slot {
    environment: Box<dyn Environment>,
    rng: ChaCha8Rng,
    seed: u64,
    actions: Vec<Action>,
    /// Decisions after which the present episode is cut off before its end.
    limit: Option<u64>,
    tally: Tally,
}

/// What is saved of a [`Slot`]: replaying the actions from the seed gives its state back exactly.
#[derive(Debug, Clone, PartialEq)]
pub struct SlotState {
    /// The generator.
    pub rng: ChaCha8Rng,
    /// Seed of the present episode.
    pub seed: u64,
    /// Actions taken in it.
    pub actions: Vec<Action>,
    /// Decisions after which it is cut off before its end.
    pub limit: Option<u64>,
}

impl Slot {
    /// Begins a first episode, cut off after at most `stagger` decisions if that is not 0; streams of one seed are
    /// independent of each other.
    ///
    /// # Errors
    /// Those of the environment.
    pub fn new(mut environment: Box<dyn Environment>, seed: u64, stream: u64, stagger: u64) -> Result<Self> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(stream);
        let first = rng.random();
        environment.reset(first)?;
        let limit = (stagger > 0).then(|| rng.random_range(1..=stagger));
        Ok(Self { environment, rng, seed: first, actions: Vec::new(), limit, tally: Tally::default() })
    }

    /// Brings an environment back to a saved state. Where a teacher leads it is asked again before each step, because time
    /// may pass meanwhile and because it may remember what it flew. Should an environment that has changed since end the
    /// episode sooner, the next one begins.
    ///
    /// # Errors
    /// Those of the environment.
    pub fn restore(environment: Box<dyn Environment>, state: SlotState, lead: Lead) -> Result<Self> {
        let mut slot = Self {
            environment,
            rng: state.rng,
            seed: state.seed,
            actions: Vec::with_capacity(state.actions.len()),
            limit: state.limit,
            tally: Tally::default(),
        };
        slot.environment.reset(slot.seed)?;
        for action in state.actions {
            if lead == Lead::Teacher {
                slot.environment.teach()?;
            }
            if slot.step(action)?.progress != Progress::Continues {
                slot.begin()?;
                break;
            }
        }
        Ok(slot)
    }

    /// What must be saved.
    #[must_use]
    pub fn state(&self) -> SlotState {
        SlotState { rng: self.rng.clone(), seed: self.seed, actions: self.actions.clone(), limit: self.limit }
    }

    fn step(&mut self, action: Action) -> Result<crate::environment::Outcome> {
        let mut outcome = self.environment.step(action)?;
        self.actions.push(action);
        if outcome.progress == Progress::Continues && self.limit == Some(self.actions.len() as u64) {
            outcome.progress = Progress::Truncated;
        }
        self.tally += Tally {
            reward: outcome.reward,
            duration_s: outcome.duration_s,
            attempts: 1,
            successes: u64::from(outcome.success),
            parameters: action.parameter,
        };
        Ok(outcome)
    }

    /// Begins the next episode and returns what the last one brought, unless it was cut off before its end.
    fn begin(&mut self) -> Result<Option<Tally>> {
        self.seed = self.rng.random();
        self.environment.reset(self.seed)?;
        self.actions.clear();
        let tally = std::mem::take(&mut self.tally);
        Ok(self.limit.take().is_none().then_some(tally))
    }
}

/// Environments that are stepped together.
pub struct Group {
    slots: Vec<Slot>,
    shape: ObservationShape,
}

/// What a group experienced: `steps` × environments entries, in the order of time.
#[derive(Debug, Default)]
pub struct Segment {
    /// Entries × tokens × features.
    pub features: Vec<f32>,
    /// Entries × tokens.
    pub valid: Vec<bool>,
    /// Logits of all choices at the time: entries × choices.
    pub logits: Vec<f32>,
    /// The choice taken.
    pub choice: Vec<i64>,
    /// The latent of the transition; 0 without a continuous actor.
    pub latent: Vec<f32>,
    /// Mean and log-deviation that the latent was drawn with: entries × 2.
    pub gaussian: Vec<f32>,
    /// The critic's value.
    pub value: Vec<f32>,
    /// Advantage estimate (eq. 23).
    pub advantage: Vec<f32>,
    /// Episodes that ended.
    pub finished: Vec<Tally>,
    /// Sums over all entries.
    pub tally: Tally,
}

impl Segment {
    /// The action of an entry.
    fn action(&self, entry: usize, network: &Network) -> Action {
        let (token, fixed) = network.decode(self.choice[entry] as usize);
        Action { token, parameter: fixed.unwrap_or_else(|| squash(self.latent[entry])) }
    }
}

/// Discount per second and λ of the advantage estimate.
#[derive(Debug, Clone, Copy)]
pub struct Discount {
    /// γ, per second.
    pub gamma: f64,
    /// λ.
    pub lambda: f64,
}

/// Whose actions the environments carry out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lead {
    /// The policy's, drawn from its distributions.
    Policy,
    /// The teacher's.
    Teacher,
}

/// How experience is gathered.
#[derive(Debug, Clone, Copy)]
pub struct Course<'a> {
    /// Steps of every environment.
    pub steps: usize,
    /// Discount of the advantages.
    pub discount: Discount,
    /// Whose actions are carried out.
    pub lead: Lead,
    /// Ends it before its time.
    pub stop: &'a Stop,
}

/// The policy as rollouts use it.
pub struct Actor<'a> {
    /// Structure.
    pub network: &'a Network,
    /// Weights.
    pub parameters: Parameters,
    /// Where the weights are.
    pub device: Device,
}

impl Group {
    /// Environments of the same shape.
    #[must_use]
    pub fn new(slots: Vec<Slot>, shape: ObservationShape) -> Self {
        Self { slots, shape }
    }

    /// The environments.
    #[must_use]
    pub fn slots(&self) -> &[Slot] {
        &self.slots
    }

    /// Steps every environment as often as the course says.
    ///
    /// # Errors
    /// Those of the environments, outputs of the policy that are not finite, and [`TrainingError::Stopped`].
    pub fn collect(&mut self, actor: &Actor, course: &Course<'_>) -> Result<Segment> {
        let Course { steps, discount, .. } = *course;
        let _guard = tch::no_grad_guard();
        let mut segment = Segment::default();
        let mut decisions: Vec<Vec<gae::Decision>> = vec![Vec::with_capacity(steps); self.slots.len()];
        let mut last = Ends::default();
        for _ in 0..steps {
            self.step_all(actor, course, &mut segment, &mut decisions, &mut last)?;
        }
        for (index, slot) in self.slots.iter().enumerate() {
            if decisions[index].last().is_some_and(|it| it.next == Next::Decision) {
                last.note(slot, self.shape, (index, steps - 1))?;
            }
        }
        last.evaluate(actor, self.shape, &mut decisions)?;
        segment.advantage = vec![0.0; steps * self.slots.len()];
        for (index, sequence) in decisions.iter().enumerate() {
            let advantages = gae::advantages(sequence, discount.gamma, discount.lambda);
            for (step, advantage) in advantages.into_iter().enumerate() {
                segment.advantage[step * self.slots.len() + index] = advantage as f32;
            }
        }
        Ok(segment)
    }

    fn step_all(
        &mut self,
        actor: &Actor,
        course: &Course<'_>,
        segment: &mut Segment,
        decisions: &mut [Vec<gae::Decision>],
        last: &mut Ends,
    ) -> Result<()> {
        let taught = self.taught(course)?;
        let (features, valid) = self.observe(segment)?;
        let seen = observations(features, valid, self.shape, actor.device);
        let first = segment.choice.len();
        self.act(actor, taught.as_deref(), &seen, segment)?;
        for (index, slot) in self.slots.iter_mut().enumerate() {
            let entry = first + index;
            let action = taught.as_ref().map_or_else(|| segment.action(entry, actor.network), |taught| taught[index]);
            let parameter = action.parameter;
            let outcome = slot.step(action)?;
            segment.tally += Tally {
                reward: outcome.reward,
                duration_s: outcome.duration_s,
                attempts: 1,
                successes: u64::from(outcome.success),
                parameters: parameter,
            };
            decisions[index].push(gae::Decision {
                reward: outcome.reward,
                duration_s: outcome.duration_s,
                value: f64::from(segment.value[entry]),
                next: match outcome.progress {
                    Progress::Continues => Next::Decision,
                    Progress::Terminated => Next::Terminated,
                    Progress::Truncated => Next::Cut { value: 0.0 },
                },
            });
            if outcome.progress == Progress::Truncated {
                last.note(slot, self.shape, (index, decisions[index].len() - 1))?;
            }
            if outcome.progress != Progress::Continues {
                segment.finished.extend(slot.begin()?);
            }
        }
        Ok(())
    }

    /// Appends every environment's observation to the segment and returns the appended part.
    fn observe<'s>(&self, segment: &'s mut Segment) -> Result<(&'s [f32], &'s [bool])> {
        let (numbers, tokens) = (self.shape.len(), self.shape.tokens);
        let first = segment.choice.len();
        let end = first + self.slots.len();
        segment.features.resize(end * numbers, 0.0);
        segment.valid.resize(end * tokens, false);
        for (slot, entry) in self.slots.iter().zip(first..) {
            let features = &mut segment.features[entry * numbers..][..numbers];
            let valid = &mut segment.valid[entry * tokens..][..tokens];
            slot.environment.observe(features, valid)?;
        }
        Ok((&segment.features[first * numbers..], &segment.valid[first * tokens..]))
    }

    /// What the teachers do next, where they lead. Teachers may let time pass, so observations come after this.
    fn taught(&mut self, course: &Course<'_>) -> Result<Option<Vec<Action>>> {
        course.stop.check()?;
        if course.lead == Lead::Policy {
            return Ok(None);
        }
        let taught = self.slots.iter_mut().map(|slot| {
            // A teacher may think long.
            course.stop.check()?;
            slot.environment.teach()
        });
        taught.collect::<Result<_>>().map(Some)
    }

    /// Appends a choice and a latent for every environment: those that were taught, or else drawn ones; and what the
    /// policy says.
    fn act(
        &mut self,
        actor: &Actor,
        taught: Option<&[Action]>,
        seen: &Observations,
        segment: &mut Segment,
    ) -> Result<()> {
        let assessment = actor.network.assess(&actor.parameters, seen);
        let choices = actor.network.choices();
        let logits = finite(to_vec(&assessment.logits)?, "choice")?;
        let first = segment.choice.len();
        for (index, (slot, row)) in self.slots.iter_mut().zip(logits.chunks(choices)).enumerate() {
            let choice = taught.map_or_else(
                || sample_choice(row, &mut slot.rng),
                |taught| actor.network.encode(taught[index].token, taught[index].parameter),
            );
            segment.choice.push(choice as i64);
        }
        segment.logits.extend(logits);
        segment.value.extend(finite(to_vec(&assessment.value)?, "value")?);
        let choice = Tensor::from_slice(&segment.choice[first..]).to_device(actor.device);
        let transition = actor.network.transition(&actor.parameters, seen, &assessment, &choice);
        let Some(gaussian) = transition else {
            segment.latent.extend(std::iter::repeat_n(0.0, self.slots.len()));
            segment.gaussian.extend(std::iter::repeat_n(0.0, 2 * self.slots.len()));
            return Ok(());
        };
        let means = finite(to_vec(&gaussian.mean)?, "transition")?;
        let deviations = finite(to_vec(&gaussian.log_deviation)?, "transition")?;
        for (index, (slot, (mean, deviation))) in self.slots.iter_mut().zip(means.iter().zip(&deviations)).enumerate() {
            segment.latent.push(taught.map_or_else(
                || sample_latent(*mean, *deviation, &mut slot.rng),
                |taught| unsquash(taught[index].parameter),
            ));
            segment.gaussian.extend([mean, deviation]);
        }
        Ok(())
    }
}

/// Observations at which sequences were cut off, whose values are asked for in one batch.
#[derive(Default)]
struct Ends {
    features: Vec<f32>,
    valid: Vec<bool>,
    /// (slot, index of its decision).
    places: Vec<(usize, usize)>,
}

impl Ends {
    fn note(&mut self, slot: &Slot, shape: ObservationShape, place: (usize, usize)) -> Result<()> {
        let (numbers, tokens) = (self.features.len(), self.valid.len());
        self.features.resize(numbers + shape.len(), 0.0);
        self.valid.resize(tokens + shape.tokens, false);
        slot.environment.observe(&mut self.features[numbers..], &mut self.valid[tokens..])?;
        self.places.push(place);
        Ok(())
    }

    fn evaluate(&self, actor: &Actor, shape: ObservationShape, decisions: &mut [Vec<gae::Decision>]) -> Result<()> {
        if self.places.is_empty() {
            return Ok(());
        }
        let seen = observations(&self.features, &self.valid, shape, actor.device);
        let assessment = actor.network.assess(&actor.parameters, &seen);
        for (value, &(slot, index)) in to_vec(&assessment.value)?.iter().zip(&self.places) {
            decisions[slot][index].next = Next::Cut { value: f64::from(*value) };
        }
        Ok(())
    }
}

/// Tensors of a batch of observations given as rows.
#[must_use]
pub fn observations(features: &[f32], valid: &[bool], shape: ObservationShape, device: Device) -> Observations {
    let (tokens, width) = (shape.tokens as i64, shape.features as i64);
    let features = Tensor::from_slice(features).view([-1, tokens, width]);
    // Skipping the mask where nothing is padded changes no number and saves time.
    let valid =
        (!valid.iter().all(|&valid| valid)).then(|| Tensor::from_slice(valid).view([-1, tokens]).to_device(device));
    Observations { features: features.to_device(device), valid }
}

/// The same numbers if all are finite.
pub(crate) fn finite(numbers: Vec<f32>, quantity: &'static str) -> Result<Vec<f32>> {
    if numbers.iter().all(|number| number.is_finite()) {
        return Ok(numbers);
    }
    Err(TrainingError::PolicyNotFinite { quantity })
}

/// The numbers of a tensor in row order.
///
/// # Errors
/// A tensor of another kind of number.
pub fn to_vec(tensor: &Tensor) -> Result<Vec<f32>> {
    Ok(Vec::<f32>::try_from(tensor.detach().reshape(-1))?)
}
