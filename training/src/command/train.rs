//! `swath-train train`: runs, resumes and records one training run.

use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::Args;
use swath_training::config::{EnvironmentConfig, RunConfig};
use swath_training::{planners, process};

use super::output::tell_other_satellite;
use super::run_folder::RunFolder;
use super::session::{Session, Signalled};

/// Options of `swath-train train`.
#[derive(Debug, Args)]
pub struct TrainArgs {
    /// The run's TOML file
    #[arg(long, value_name = "FILE")]
    config: PathBuf,
    /// Environment steps in all, instead of the file's
    #[arg(long)]
    steps: Option<u64>,
    /// Seed, instead of the file's
    #[arg(long)]
    seed: Option<u64>,
    /// Folder that the run's own folder is made in
    #[arg(long, value_name = "FOLDER", default_value = "out/training")]
    out: PathBuf,
    /// Where the networks compute: cpu or cuda
    #[arg(long, default_value = "cpu")]
    device: String,
    /// Threads; results do not depend on it
    #[arg(long, default_value_t = super::cores())]
    threads: usize,
    /// Go on from the newest checkpoint of the run's folder, or from a given one
    #[arg(long, value_name = "CHECKPOINT", num_args = 0..=1)]
    resume: Option<Option<PathBuf>>,
    /// Begin with the weights of this policy or checkpoint instead of random ones
    #[arg(long, value_name = "POLICY", conflicts_with = "resume")]
    from: Option<PathBuf>,
    /// Save and leave after this many environment steps, as Ctrl-C would
    #[arg(long, value_name = "STEPS")]
    stop_after: Option<u64>,
}

/// Runs the command.
pub fn train(args: &TrainArgs) -> Result<()> {
    let signalled = Signalled::listen()?;
    let mut run = RunConfig::load(&args.config)?;
    run.steps = args.steps.unwrap_or(run.steps);
    run.seed = args.seed.unwrap_or(run.seed);
    run.validate()?;
    if let (EnvironmentConfig::Strips(strips), Some(warm_start)) = (&run.environment, &run.warm_start) {
        let teacher = planners::origin(&warm_start.teacher, &strips.simulation).context("cannot make the teacher")?;
        teacher.iter().for_each(tell_other_satellite);
    }
    process::make_threads(args.threads)?;
    let device = process::device(&args.device)?;
    let path = args.out.join(format!("{}-seed{}", run.name, run.seed));
    let (folder, mut trainer) = match &args.resume {
        Some(from) => RunFolder::resume(path, run, from.as_deref(), device)?,
        None => RunFolder::begin(path, run, args.from.as_deref(), device)?,
    };
    let mut session = Session::new(&folder, &mut trainer, signalled)?;
    let outcome = session.run(&mut trainer, args.stop_after.unwrap_or(u64::MAX)).with_context(|| folder.last_good());
    // The process ends, and whoever stopped it waits: what the environments hold need not be freed piece by piece.
    std::mem::forget(trainer);
    outcome
}
