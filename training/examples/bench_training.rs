//! Measures training, rollouts and single decisions of the compact HOP-PPO; prints one JSON object, whose `training`
//! says of what.

use std::io::Write;
use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result};
use swath_sim::learn::episode::{Env, EpisodeConfig};
use swath_sim::planner::Planner;
use swath_sim::vehicle::model::Model;
use swath_training::checkpoint;
use swath_training::config::{EnvironmentConfig, RunConfig};
use swath_training::policy::{LearnedPlanner, Policy};
use swath_training::process;
use swath_training::program::Program;
use swath_training::trainer::Trainer;
use tch::Device;

/// Decisions whose time is taken.
const DECISIONS: usize = 3000;

fn main() -> Result<()> {
    process::prepare();
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    process::make_threads(threads)?;
    let config = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/compact/hop_ppo.toml");
    let mut run = RunConfig::load(&config)?;
    run.ppo.minibatch = 128;
    run.ppo.kl_stop = None;
    let mut trainer = Trainer::new(run.clone(), Device::Cpu)?;
    // The first batch warms caches and the allocator up.
    let segments = trainer.gather()?;
    let decisions: usize = segments.iter().map(|segment| segment.choice.len()).sum();
    let began = Instant::now();
    let segments_timed = [trainer.gather()?, trainer.gather()?, trainer.gather()?];
    let rollout_s = began.elapsed().as_secs_f64() / segments_timed.len() as f64;
    let began = Instant::now();
    let update = trainer.learn(&segments)?;
    let train_s = began.elapsed().as_secs_f64();
    let (policy, p50, p99) = decision_ms(&trainer, &run)?;
    let measured = serde_json::json!({
        "train_samples_per_s": (decisions as f64 * update.epochs / train_s).round(),
        "rollout_steps_per_s": (decisions as f64 / rollout_s).round(),
        "decision_p50_ms": p50,
        "decision_p99_ms": p99,
        "training": { "program": Program::THIS, "configuration": run, "policies": [{ "sha256": policy }] },
    });
    writeln!(std::io::stdout(), "{measured}").context("cannot print the measurements")
}

/// Digest of the policy, median and 99th percentile of a decision with its observation, one at a time [ms].
fn decision_ms(trainer: &Trainer, run: &RunConfig) -> Result<(String, f64, f64)> {
    let EnvironmentConfig::Strips(strips) = &run.environment else {
        anyhow::bail!("the compact run is not about strips");
    };
    let file = std::env::temp_dir().join(format!("swath-bench-{}.safetensors", std::process::id()));
    checkpoint::save_policy(trainer, &file)?;
    let mut planner = LearnedPlanner::new(Policy::load(&file)?);
    std::fs::remove_file(&file).context("cannot remove the policy that was measured")?;
    let model = std::sync::Arc::new(Model::new(strips.simulation.clone())?);
    let mut env = Env::episode(model, &EpisodeConfig::evaluation(), 0);
    let mut times = Vec::with_capacity(DECISIONS);
    while times.len() < DECISIONS {
        let began = Instant::now();
        let decision = planner.decide(&env.context())?;
        times.push(began.elapsed().as_secs_f64() * 1e3);
        if env.step(decision)?.truncated {
            env = Env::episode(env.model().clone(), &EpisodeConfig::evaluation(), times.len() as u64);
        }
    }
    times.sort_by(f64::total_cmp);
    Ok((planner.policy().digest().to_owned(), times[DECISIONS / 2], times[DECISIONS * 99 / 100]))
}
