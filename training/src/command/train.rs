//! `swath-train train`: runs, resumes and records one training run.

use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use anyhow::{Context, Result, bail};
use clap::Args;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use swath_training::checkpoint::{self, REVISION};
use swath_training::config::RunConfig;
use swath_training::process;
use swath_training::store::Content;
use swath_training::tensorboard::EventWriter;
use swath_training::trainer::{Report, Trainer};

/// Checkpoints that are kept.
const KEPT: usize = 2;

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
    let mut run = RunConfig::load(&args.config)?;
    run.steps = args.steps.unwrap_or(run.steps);
    run.seed = args.seed.unwrap_or(run.seed);
    run.validate()?;
    process::make_threads(args.threads)?;
    let device = process::device(&args.device)?;
    let folder = Folder::new(args.out.join(format!("{}-seed{}", run.name, run.seed)));
    let mut trainer = match &args.resume {
        Some(from) => folder.resume(run, from.as_deref(), device)?,
        None => folder.begin(run, args.from.as_deref(), device)?,
    };
    let mut session = Session::new(&folder, &trainer)?;
    session.catch_signals().context("cannot catch Ctrl-C")?;
    let stop_at = args.stop_after.unwrap_or(u64::MAX);
    let outcome = session.run(&mut trainer, stop_at);
    outcome.with_context(|| match checkpoint::newest(&folder.checkpoints()) {
        Ok(last) => format!("the last good checkpoint is {}", last.display()),
        Err(_) => "there is no checkpoint yet".into(),
    })
}

/// Where a run keeps its files.
struct Folder {
    path: PathBuf,
}

impl Folder {
    fn new(path: PathBuf) -> Folder {
        Folder { path }
    }

    fn checkpoints(&self) -> PathBuf {
        self.path.join("checkpoints")
    }

    fn progress(&self) -> PathBuf {
        self.path.join("progress.jsonl")
    }

    fn begin(&self, run: RunConfig, from: Option<&Path>, device: tch::Device) -> Result<Trainer> {
        if let Ok(checkpoint) = checkpoint::newest(&self.checkpoints()) {
            bail!("{} exists: go on with --resume, or choose another --out or seed", checkpoint.display());
        }
        let mut trainer = Trainer::new(run, device)?;
        if let Some(policy) = from {
            trainer.adopt(policy)?;
        }
        fs::create_dir_all(self.checkpoints())
            .with_context(|| format!("cannot make {}", self.checkpoints().display()))?;
        let text = toml::to_string(trainer.run()).context("cannot write the run as TOML")?;
        fs::write(self.path.join("run.toml"), text)
            .with_context(|| format!("cannot write to {}", self.path.display()))?;
        fs::write(self.progress(), "").with_context(|| format!("cannot write {}", self.progress().display()))?;
        trainer.warm_start(|report| {
            eprintln!(
                "warm start: {} decisions shown, log-likelihood {:.3}, critic explains {:.2}",
                report.steps, report.update.surrogate, report.update.explained_variance
            );
        })?;
        Ok(trainer)
    }

    fn resume(&self, run: RunConfig, from: Option<&Path>, device: tch::Device) -> Result<Trainer> {
        let path = match from {
            Some(path) if path.is_dir() => checkpoint::newest(path)?,
            Some(path) => path.to_path_buf(),
            None => checkpoint::newest(&self.checkpoints())?,
        };
        let trainer = Trainer::resume(run, &path, device)?;
        eprintln!("going on from {} at step {}", path.display(), trainer.steps());
        let revision = checkpoint::header(&Content::read(&path)?, &path)?.revision;
        if revision != REVISION {
            eprintln!("warning: it was made by revision {revision}, this is {REVISION}: going on may not be exact");
        }
        fs::create_dir_all(self.checkpoints())
            .with_context(|| format!("cannot make {}", self.checkpoints().display()))?;
        self.forget_progress_after(trainer.steps())?;
        Ok(trainer)
    }

    /// Drops the lines of updates that the checkpoint does not know.
    fn forget_progress_after(&self, steps: u64) -> Result<()> {
        let text = fs::read_to_string(self.progress()).unwrap_or_default();
        let known = text.lines().filter(|line| {
            let report = serde_json::from_str::<serde_json::Value>(line);
            report.is_ok_and(|report| report["steps"].as_u64().is_some_and(|it| it <= steps))
        });
        let kept: String = known.flat_map(|line| [line, "\n"]).collect();
        fs::write(self.progress(), kept).with_context(|| format!("cannot write {}", self.progress().display()))
    }
}

/// One process's part of a run.
struct Session<'a> {
    folder: &'a Folder,
    events: EventWriter,
    began: Instant,
    first_step: u64,
    saved_at: u64,
    last_return: f64,
    /// Set by Ctrl-C: finish the update, save, leave.
    stop: Arc<AtomicBool>,
}

impl<'a> Session<'a> {
    fn new(folder: &'a Folder, trainer: &Trainer) -> Result<Session<'a>> {
        Ok(Session {
            folder,
            events: EventWriter::create(&folder.path)?,
            began: Instant::now(),
            first_step: trainer.steps(),
            saved_at: trainer.steps(),
            last_return: f64::NAN,
            stop: Arc::default(),
        })
    }

    /// The first Ctrl-C asks the run to stop and save; a second one ends the process at once.
    fn catch_signals(&self) -> std::io::Result<()> {
        for signal in [SIGINT, SIGTERM] {
            flag::register_conditional_shutdown(signal, 130, self.stop.clone())?;
            flag::register(signal, self.stop.clone())?;
        }
        Ok(())
    }

    fn run(&mut self, trainer: &mut Trainer, stop_at: u64) -> Result<()> {
        let every = trainer.run().checkpoint_every;
        loop {
            let due = trainer.steps() >= self.saved_at + every;
            let stopping = self.stop.load(Ordering::Relaxed) || trainer.steps() >= stop_at;
            if trainer.is_finished() || stopping {
                eprintln!();
                return self.save(trainer);
            }
            if due && let Err(error) = self.save(trainer) {
                // The last good checkpoint is still there; there may be room again later.
                eprintln!("\nwarning: {error:#}");
                self.saved_at = trainer.steps();
            }
            let report = trainer.advance()?;
            self.record(trainer, &report)?;
        }
    }

    fn save(&mut self, trainer: &Trainer) -> Result<()> {
        let folder = self.folder.checkpoints();
        checkpoint::save(trainer, &folder.join(checkpoint::file_name(trainer.steps())))?;
        checkpoint::save_policy(trainer, &self.folder.path.join("policy.safetensors"))?;
        self.saved_at = trainer.steps();
        let all = checkpoint::list(&folder)?;
        for old in all.iter().rev().skip(KEPT) {
            fs::remove_file(old).with_context(|| format!("cannot remove {}", old.display()))?;
        }
        Ok(())
    }

    fn record(&mut self, trainer: &Trainer, report: &Report) -> Result<()> {
        let elapsed = self.began.elapsed().as_secs_f64();
        let speed = (report.steps - self.first_step) as f64 / elapsed;
        let left_s = trainer.run().steps.saturating_sub(report.steps) as f64 / speed;
        if report.episode_return.is_finite() {
            self.last_return = report.episode_return;
        }
        let scalars = report.scalars(speed);
        self.events.scalars(report.steps, &scalars, &self.folder.path)?;
        let mut line = serde_json::Map::from_iter([("steps".to_owned(), report.steps.into())]);
        line.extend(scalars.iter().map(|(name, value)| ((*name).to_owned(), (*value).into())));
        let text = serde_json::Value::Object(line).to_string();
        let path = self.folder.progress();
        let file = OpenOptions::new().create(true).append(true).open(&path);
        file.and_then(|mut file| writeln!(file, "{text}"))
            .with_context(|| format!("cannot write {}", path.display()))?;
        eprint!(
            "\r{:>9} of {} steps  {speed:5.0} steps/s  return {:7.2}  {:5.2}/orbit  success {:4.1} %  T_pre {:5.1} s  {} left   ",
            report.steps,
            trainer.run().steps,
            self.last_return,
            report.reward_per_orbit,
            report.success_rate * 100.0,
            report.t_pre_s,
            hours_minutes(left_s),
        );
        Ok(())
    }
}

fn hours_minutes(seconds: f64) -> String {
    let minutes = (seconds / 60.0).round() as u64;
    format!("{}:{:02} h", minutes / 60, minutes % 60)
}
