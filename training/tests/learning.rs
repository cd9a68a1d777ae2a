//! Learning reaches the known optimum of a tiny problem.

use swath_training::config::RunConfig;
use swath_training::distribution::{best_choice, squash};
use swath_training::environment::{Action, Environment, Progress};
use swath_training::network::Network;
use swath_training::parameters::{Layout, Parameters};
use swath_training::rollout::{observations, to_vec};
use swath_training::toy::Toy;
use swath_training::trainer::Trainer;
use tch::{Device, Tensor};

const TOKENS: usize = 3;
const GAMMA: f64 = 0.999;

fn run(network: &str, warm_start: &str) -> RunConfig {
    let text = format!(
        r#"
name = "toy"
steps = 30000
environment = {{ kind = "toy", tokens = {TOKENS} }}
network = {network}
rollout = {{ environments = 32, group = 16 }}
ppo = {{ batch = 1024, minibatch = 128, epochs = 6, learning_rate = 5e-3, learning_rate_end = 2e-4 }}
{warm_start}"#
    );
    toml::from_str(&text).unwrap()
}

/// Reward per second of a way to act over 100 episodes.
fn rate(mut act: impl FnMut(&Toy) -> Action) -> f64 {
    let mut toy = Toy::new(TOKENS);
    let (mut reward, mut seconds) = (0.0, 0.0);
    for seed in 0..100 {
        toy.reset(seed).unwrap();
        loop {
            let outcome = toy.step(act(&toy)).unwrap();
            reward += outcome.reward;
            seconds += outcome.duration_s;
            if outcome.progress != Progress::Continues {
                break;
            }
        }
    }
    reward / seconds
}

fn optimum() -> f64 {
    let value = Toy::optimal_value(TOKENS, GAMMA, 20_000);
    rate(|toy| toy.best(GAMMA, value))
}

/// The most probable action of a network.
fn greedy(network: &Network, parameters: &Parameters, toy: &Toy) -> Action {
    let shape = toy.shape();
    let (mut features, mut valid) = (vec![0.0; shape.len()], vec![false; shape.tokens]);
    toy.observe(&mut features, &mut valid).unwrap();
    let seen = observations(&features, &valid, shape, Device::Cpu);
    let assessment = network.assess(parameters, &seen);
    let choice = best_choice(&to_vec(&assessment.logits).unwrap());
    let (token, fixed) = network.decode(choice);
    let index = Tensor::from_slice(&[choice as i64]);
    let transition = network.transition(parameters, &seen, &assessment, &index);
    let parameter = fixed.unwrap_or_else(|| squash(to_vec(&transition.unwrap().mean).unwrap()[0]));
    Action { token, parameter }
}

fn weights(layout: &Layout, trainer: &Trainer) -> Parameters {
    let flat = Tensor::from_slice(&trainer.state().unwrap().weights);
    Parameters::from_flat(layout, flat).unwrap()
}

fn learned(network: &str) -> f64 {
    let mut trainer = Trainer::new(run(network, ""), Device::Cpu).unwrap();
    while !trainer.is_finished() {
        trainer.advance().unwrap();
    }
    let parameters = weights(trainer.layout(), &trainer);
    rate(|toy| greedy(trainer.network(), &parameters, toy))
}

#[test]
fn hop_ppo_reaches_the_optimum_of_the_toy() {
    let network = r#"{ kind = "hop-ppo", dim = 16, heads = 2, layers = 1, feed_forward = 16, head = "pointer", discrete = [16], continuous = [32], critic = [16] }"#;
    let (found, optimum) = (learned(network), optimum());
    assert!(found > 0.95 * optimum && found <= 1.01 * optimum, "{found} of {optimum}");
}

#[test]
fn discrete_ppo_learns_what_its_grid_allows() {
    let network = r#"{ kind = "discrete-ppo", granularity_s = 20.0, discrete = [64], critic = [32] }"#;
    let (found, optimum) = (learned(network), optimum());
    assert!(found > 0.75 * optimum && found <= 1.01 * optimum, "{found} of {optimum}");
}

#[test]
fn h_ppo_learns_with_an_objective_for_each_actor() {
    let network = r#"{ kind = "h-ppo", encoder = [64], discrete = [32], continuous = [32], critic = [32] }"#;
    let (found, optimum) = (learned(network), optimum());
    assert!(found > 0.75 * optimum && found <= 1.01 * optimum, "{found} of {optimum}");
}

#[test]
fn behaviour_cloning_makes_the_policy_do_what_the_teacher_does() {
    let network = r#"{ kind = "hop-ppo-mlp", encoder = [64], discrete = [32], continuous = [32], critic = [16] }"#;
    let warm_start = "warm_start = { decisions = 40000, learning_rate = 3e-3 }";
    let mut trainer = Trainer::new(run(network, warm_start), Device::Cpu).unwrap();
    let fresh = weights(trainer.layout(), &trainer);
    let mut reports = Vec::new();
    trainer.warm_start(|report| reports.push((report.steps, report.update))).unwrap();
    let ((_, first), (shown, last)) = (reports[0], reports[reports.len() - 1]);
    assert_eq!((reports.len(), shown), (40, 40_960), "40 000 decisions in batches of 1024");
    assert!(last.surrogate > first.surrogate + 1.0, "likelihood {} to {}", first.surrogate, last.surrogate);
    assert!(last.explained_variance > first.explained_variance + 0.1, "{first:?} {last:?}");
    let cloned = weights(trainer.layout(), &trainer);
    let mut agreement = [0, 0];
    let mut toy = Toy::new(TOKENS);
    for seed in 0..500 {
        toy.reset(seed).unwrap();
        let wanted = toy.teach().unwrap();
        for (count, parameters) in agreement.iter_mut().zip([&fresh, &cloned]) {
            let action = greedy(trainer.network(), parameters, &toy);
            let near = (action.parameter - wanted.parameter).abs() < 0.1;
            *count += usize::from(action.token == wanted.token && near);
        }
    }
    assert!(agreement[1] > 350 && agreement[1] > 2 * agreement[0], "{agreement:?}");
}
