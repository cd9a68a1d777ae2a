//! Measures training, rollouts and decisions; prints one JSON object.

use std::path::Path;
use std::time::Instant;

use anyhow::Result;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use swath_training::config::RunConfig;
use swath_training::process;
use swath_training::trainer::Trainer;
use tch::Device;

fn main() -> Result<()> {
    process::prepare();
    let threads = std::env::args().nth(1).map_or(2, |n| n.parse().unwrap_or(2));
    process::make_threads(threads)?;
    let config = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/compact/hop_ppo.toml");
    let mut trainer = Trainer::new(RunConfig::load(&config)?, Device::Cpu)?;
    let t = Instant::now();
    let segments = trainer.gather()?;
    let n: usize = segments.iter().map(|s| s.choice.len()).sum();
    eprintln!("rollout {:.0} steps/s", n as f64 / t.elapsed().as_secs_f64());
    let t = Instant::now();
    let segments = trainer.gather()?;
    eprintln!("rollout {:.0} steps/s", n as f64 / t.elapsed().as_secs_f64());
    let t = Instant::now();
    let report = trainer.advance()?;
    eprintln!("advance {:.2} s {report:?}", t.elapsed().as_secs_f64());
    let t = Instant::now();
    let _ = trainer.learn(&segments)?;
    eprintln!("train {:.0} samples/s", 10.0 * n as f64 / t.elapsed().as_secs_f64());
    let _ = ChaCha8Rng::seed_from_u64(0);
    Ok(())
}
