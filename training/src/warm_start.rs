//! Behaviour cloning: before PPO, the policy learns to do what the environment's teacher does.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use tch::{Kind, Tensor};

use crate::adam::Adam;
use crate::config::RunConfig;
use crate::distribution::{chosen, log_probabilities, unsquash};
use crate::environment::{Environment, Progress};
use crate::error::{Result, TrainingError};
use crate::network::Network;
use crate::parameters::Parameters;
use crate::rollout::observations;

/// Decisions of one gradient step.
const MINIBATCH: usize = 256;

/// What the teacher did at some observations.
#[derive(Default)]
struct Lesson {
    features: Vec<f32>,
    valid: Vec<bool>,
    choice: Vec<i64>,
    latent: Vec<f32>,
}

/// Makes the policy's actions likely ones of the teacher; the critic is left alone. Returns the
/// mean log-likelihood of the last tenth.
///
/// # Errors
/// An environment without a teacher, or numbers that are not finite.
pub fn clone_teacher(
    run: &RunConfig,
    network: &Network,
    parameters: &mut Parameters,
    mut environment: Box<dyn Environment>,
    decisions: u64,
    learning_rate: f64,
) -> Result<f64> {
    let mut adam = Adam::new(parameters.flat.size()[0] as usize, parameters.flat.device());
    let mut seeds = ChaCha8Rng::seed_from_u64(run.seed);
    seeds.set_stream(u64::MAX);
    environment.reset(rand::RngExt::random(&mut seeds))?;
    let minibatches = decisions.div_ceil(MINIBATCH as u64);
    let (mut sum, mut count) = (0.0, 0.0);
    for index in 0..minibatches {
        let lesson = watch(network, environment.as_mut(), &mut seeds)?;
        let likelihood = learn(network, parameters, &mut adam, &lesson, learning_rate)?;
        if !likelihood.is_finite() {
            let quantity = "the likelihood of the teacher's actions";
            return Err(TrainingError::NotFinite { quantity, step: 0 });
        }
        if index * 10 >= minibatches * 9 {
            sum += likelihood;
            count += 1.0;
        }
    }
    Ok(sum / count)
}

fn watch(network: &Network, environment: &mut dyn Environment, seeds: &mut ChaCha8Rng) -> Result<Lesson> {
    let shape = network.shape();
    let mut lesson = Lesson::default();
    let mut idle = 0;
    while lesson.choice.len() < MINIBATCH {
        let action = environment.teach()?;
        let (numbers, tokens) = (lesson.features.len(), lesson.valid.len());
        if let Some(action) = action {
            lesson.features.resize(numbers + shape.len(), 0.0);
            lesson.valid.resize(tokens + shape.tokens, false);
            environment.observe(&mut lesson.features[numbers..], &mut lesson.valid[tokens..])?;
            lesson.choice.push(network.encode(action.token, action.parameter) as i64);
            lesson.latent.push(unsquash(action.parameter));
            idle = 0;
        } else {
            idle += 1;
        }
        if idle > 1000 {
            return Err(TrainingError::Environment("there is no teacher to learn from".into()));
        }
        // Where the teacher would wait, the first token with no transition moves time on.
        let action = action.unwrap_or(crate::environment::Action { token: 0, parameter: 0.0 });
        if environment.step(action)?.progress != Progress::Continues {
            environment.reset(rand::RngExt::random(seeds))?;
        }
    }
    Ok(lesson)
}

fn learn(
    network: &Network,
    parameters: &mut Parameters,
    adam: &mut Adam,
    lesson: &Lesson,
    learning_rate: f64,
) -> Result<f64> {
    let device = parameters.flat.device();
    let seen = observations(&lesson.features, &lesson.valid, network.shape(), device);
    let choice = Tensor::from_slice(&lesson.choice).to_device(device);
    let latent = Tensor::from_slice(&lesson.latent).to_device(device);
    let assessment = network.assess(parameters, &seen);
    let mut likelihood = chosen(&log_probabilities(&assessment.logits), &choice);
    if let Some(gaussian) = network.transition(parameters, &seen, &assessment, &choice) {
        likelihood += gaussian.log_density(&latent);
    }
    let mean = likelihood.mean(Kind::Float);
    let gradient = parameters.gradient(&-&mean)?;
    let length = gradient.norm().double_value(&[]);
    let scale = (1.0 / (length + 1e-6)).min(1.0);
    adam.step(parameters, &(gradient * scale), learning_rate);
    Ok(mean.double_value(&[]))
}
