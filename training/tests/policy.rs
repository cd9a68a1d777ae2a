//! A policy file flies as it was trained: same observation, same action.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use swath_sim::config::SimConfig;
use swath_sim::learn::episode::{Env, EpisodeConfig};
use swath_sim::planner::{Decision, Planner};
use swath_sim::task::Totals;
use swath_sim::vehicle::model::Model;
use swath_training::config::{EnvironmentConfig, RunConfig};
use swath_training::distribution::{best_choice, squash};
use swath_training::environment::{Action, Environment};
use swath_training::network::Observations;
use swath_training::policy::{LearnedPlanner, Policy};
use swath_training::rollout::{observations, to_vec};
use swath_training::store::Content;
use swath_training::strips::{Strips, decision};
use swath_training::trainer::Trainer;
use swath_training::{TrainingError, checkpoint, planners};
use tch::{Device, Tensor};

fn run(file: &str) -> RunConfig {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/compact").join(file);
    let mut run = RunConfig::load(&path).unwrap();
    run.rollout.environments = 2;
    run.rollout.group = 1;
    if let EnvironmentConfig::Strips(strips) = &mut run.environment {
        strips.episode.orbits = 1.0;
        strips.episode.scenario.count = [800, 800];
    }
    run
}

fn saved(trainer: &Trainer, folder: &Path) -> PathBuf {
    let path = folder.join("policy.safetensors");
    checkpoint::save_policy(trainer, &path).unwrap();
    path
}

/// What the trainer's own network makes of observations: the most probable actions.
fn greedy(trainer: &Trainer, seen: &Observations) -> Vec<Action> {
    let state = trainer.state().unwrap();
    let flat = Tensor::from_slice(&state.weights);
    let parameters = swath_training::parameters::Parameters::from_flat(trainer.layout(), flat).unwrap();
    let network = trainer.network();
    let assessment = network.assess(&parameters, seen);
    let logits = to_vec(&assessment.logits).unwrap();
    let choices: Vec<usize> = logits.chunks(network.choices()).map(best_choice).collect();
    let index: Vec<i64> = choices.iter().map(|&choice| choice as i64).collect();
    let transition = network.transition(&parameters, seen, &assessment, &Tensor::from_slice(&index));
    let means = transition.map(|gaussian| to_vec(&gaussian.mean).unwrap());
    let actions = choices.iter().enumerate().map(|(row, &choice)| {
        let (token, fixed) = network.decode(choice);
        let parameter = fixed.unwrap_or_else(|| squash(means.as_ref().unwrap()[row]));
        Action { token, parameter }
    });
    actions.collect()
}

#[test]
fn the_same_observation_gives_the_same_action_in_trainer_and_planner() {
    let folder = tempfile::tempdir().unwrap();
    tch::set_num_threads(1);
    for file in ["hop_ppo.toml", "hop_ppo_mlp.toml", "h_ppo.toml", "discrete_ppo_60.toml", "hop_ppo_momentum.toml"] {
        let run = run(file);
        let trainer = Trainer::new(run.clone(), Device::Cpu).unwrap();
        let policy = Policy::load(&saved(&trainer, folder.path())).unwrap();
        let (shape, set) = (policy.shape(), policy.observation_set());
        let mut planner = LearnedPlanner::new(policy);
        let EnvironmentConfig::Strips(strips) = &run.environment else { unreachable!() };
        let model = Arc::new(Model::new(strips.simulation.clone()).unwrap());
        let mut env = Env::episode(model.clone(), &strips.episode, 5);
        let mut environment = Strips::new(strips).unwrap();
        environment.reset(5).unwrap();
        for _ in 0..8 {
            let (mut features, mut valid) = (vec![0.0; shape.len()], vec![false; shape.tokens]);
            environment.observe(&mut features, &mut valid).unwrap();
            let (mut flown, mut mask) = (features.clone(), valid.clone());
            env.observe(set, &mut flown, &mut mask);
            assert_eq!((&features, &valid), (&flown, &mask), "{file}");
            let action = greedy(&trainer, &observations(&features, &valid, shape, Device::Cpu))[0];
            let decided = planner.decide(&env.context()).unwrap();
            assert_eq!(decided, decision(&model, action), "{file}");
            let judgement = planner.judgement().unwrap();
            assert!((judgement.probabilities.iter().sum::<f32>() - 1.0).abs() < 1e-5);
            assert_eq!(judgement.action, action);
            environment.step(action).unwrap();
            env.step(decided).unwrap();
        }
    }
}

#[test]
fn a_policy_that_produces_nan_is_noticed_at_the_decision() {
    let folder = tempfile::tempdir().unwrap();
    let trainer = Trainer::new(run("hop_ppo.toml"), Device::Cpu).unwrap();
    let path = saved(&trainer, folder.path());
    let mut content = Content::read(&path).unwrap();
    content.insert("discrete.output.bias", &[1], &[f32::NAN]);
    std::fs::write(&path, content.to_bytes().unwrap()).unwrap();
    let mut planner = LearnedPlanner::new(Policy::load(&path).unwrap());
    let model = Arc::new(Model::new(Default::default()).unwrap());
    let mut episode = EpisodeConfig::default();
    episode.scenario.count = [500, 500];
    let env = Env::episode(model, &episode, 1);
    let error = planner.decide(&env.context()).unwrap_err().to_string();
    assert!(error.contains("not finite"), "{error}");
    assert!(planner.judgement().is_none());
}

#[test]
fn damaged_policies_and_other_observations_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let trainer = Trainer::new(run("hop_ppo.toml"), Device::Cpu).unwrap();
    let path = saved(&trainer, folder.path());
    let policy = Policy::load(&path).unwrap();
    let again = Policy::load(&path).unwrap();
    assert_eq!(policy.digest(), again.digest());
    assert!(matches!(policy.judge(&[0.0; 13], &[true]), Err(TrainingError::Shape { .. })));
    assert!(policy.judge(&[0.0; 520], &[false; 40]).is_err());
    let bytes = std::fs::read(&path).unwrap();
    assert!(bytes.len() < 2_000_000, "a shipped policy has at most 2 MB");
    std::fs::write(&path, &bytes[..bytes.len() - 1]).unwrap();
    assert!(Policy::load(&path).unwrap_err().to_string().contains("policy.safetensors is damaged"));
    std::fs::write(&path, b"").unwrap();
    assert!(Policy::load(&path).is_err());
    assert!(Policy::load(&folder.path().join("none")).unwrap_err().to_string().contains("cannot read"));
}

#[test]
fn a_planner_waits_when_there_is_nothing_to_choose() {
    let folder = tempfile::tempdir().unwrap();
    let trainer = Trainer::new(run("hop_ppo.toml"), Device::Cpu).unwrap();
    let mut planner = LearnedPlanner::new(Policy::load(&saved(&trainer, folder.path())).unwrap());
    let model = Arc::new(Model::new(Default::default()).unwrap());
    let mut episode = EpisodeConfig::default();
    episode.scenario.count = [0, 0];
    let env = Env::episode(model, &episode, 1);
    assert!(matches!(planner.decide(&env.context()).unwrap(), Decision::Wait { ticks } if ticks > 0));
}

#[test]
fn every_shipped_configuration_is_valid_and_every_compact_policy_is_small() {
    let configs = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs");
    let mut count = 0;
    for folder in ["compact", "paper"] {
        for entry in std::fs::read_dir(configs.join(folder)).unwrap() {
            let run = RunConfig::load(&entry.unwrap().path()).unwrap();
            let EnvironmentConfig::Strips(strips) = &run.environment else { unreachable!() };
            let shape = Strips::new(strips).unwrap().shape();
            let (_, layout) = swath_training::network::Network::new(&run.network, shape, 120.0).unwrap();
            assert!(folder == "paper" || layout.count() < 490_000, "{}: {}", run.name, layout.count());
            count += 1;
        }
    }
    assert!(count >= 14);
}

#[test]
fn a_policy_whose_proposals_are_flown_in_the_head_never_fails_and_earns_more() {
    let model = Arc::new(Model::new(SimConfig::default()).unwrap());
    let episode = EpisodeConfig { orbits: 2.0, ..EpisodeConfig::evaluation() };
    let fly = |name: &str| {
        let mut planner = planners::make(&name.parse().unwrap(), 0).unwrap();
        let mut totals = Totals::default();
        let mut env = Env::episode(model.clone(), &episode, 3);
        env.run(planner.as_mut(), |record| totals.add(record)).unwrap();
        totals
    };
    let (alone, in_head) = (fly("hop-ppo"), fly("hop-ppo+lookahead"));
    assert_eq!((in_head.failed_attitude, in_head.failed_elevation), (0, 0));
    assert!(in_head.reward > alone.reward, "{in_head:?} {alone:?}");
}
