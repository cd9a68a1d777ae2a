//! Where a training run keeps its files, one process at a time.

use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use swath_training::checkpoint;
use swath_training::config::RunConfig;
use swath_training::lock::RunLock;
use swath_training::program::Program;
use swath_training::store::{self, Content};
use swath_training::trainer::Trainer;
use swath_training::weights::{self, REVISION};
use tch::Device;

use super::output::say;

/// Checkpoints that are kept.
const KEPT: usize = 2;

/// A run's folder, held by this process.
pub struct RunFolder {
    path: PathBuf,
    _lock: RunLock,
}

impl RunFolder {
    /// Begins a run in a folder that has none yet.
    ///
    /// # Errors
    /// A folder with checkpoints, or one that another process holds.
    pub fn begin(path: PathBuf, run: RunConfig, from: Option<&Path>, device: Device) -> Result<(Self, Trainer)> {
        // A folder that is there may be another run's.
        let held = if path.is_dir() { Some(Self::take(path.clone())?) } else { None };
        refuse_another(&path)?;
        let mut trainer = Trainer::new(run, device)?;
        if let Some(policy) = from {
            trainer.adopt(policy)?;
        }
        let folder = held.map_or_else(|| Self::take(path), Ok)?;
        refuse_another(&folder.path)?;
        folder.describe(&trainer)?;
        fs::write(folder.progress(), "").with_context(|| format!("cannot write {}", folder.progress().display()))?;
        Ok((folder, trainer))
    }

    /// Goes on from a checkpoint, the folder's newest unless another is named.
    ///
    /// # Errors
    /// No checkpoint, one of another run, or a folder that another process holds.
    pub fn resume(path: PathBuf, run: RunConfig, from: Option<&Path>, device: Device) -> Result<(Self, Trainer)> {
        let find = || match from {
            Some(folder) if folder.is_dir() => checkpoint::newest(folder),
            Some(file) => Ok(file.to_path_buf()),
            None => checkpoint::newest(&checkpoints(&path)),
        };
        find()?;
        let folder = Self::take(path.clone())?;
        // Whoever held the folder until now may have saved and removed some.
        let checkpoint = find()?;
        let trainer = checkpoint::resume(run, &checkpoint, device)?;
        let at = match trainer.lessons_shown() {
            Some(shown) => format!("within the warm start, after {shown} decisions"),
            None => format!("at step {}", trainer.steps()),
        };
        say(&format!("going on from {} {at}", checkpoint.display()));
        let revision = weights::header(&Content::read(&checkpoint)?, &checkpoint)?.revision;
        if revision != REVISION {
            say(&format!("warning: it was made by revision {revision}, this is {REVISION}: going on may not be exact"));
        }
        folder.describe(&trainer)?;
        folder.forget_progress_after(trainer.steps())?;
        Ok((folder, trainer))
    }

    fn take(path: PathBuf) -> Result<Self> {
        let checkpoints = checkpoints(&path);
        fs::create_dir_all(&checkpoints).with_context(|| format!("cannot make {}", checkpoints.display()))?;
        let _lock = RunLock::take(&path)?;
        Ok(Self { path, _lock })
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes the run as it is trained from now on.
    fn describe(&self, trainer: &Trainer) -> Result<()> {
        let text = toml::to_string(trainer.run()).context("cannot write the run as TOML")?;
        let text = format!("# As {} trains it.\n{text}", Program::THIS);
        Ok(store::write_atomically(&self.path.join("run.toml"), text.as_bytes())?)
    }

    /// Saves a checkpoint and the policy, and removes old checkpoints.
    ///
    /// # Errors
    /// Files that cannot be written; the last good checkpoint is still there then.
    pub fn save(&self, trainer: &Trainer) -> Result<PathBuf> {
        let folder = checkpoints(&self.path);
        let saved = folder.join(checkpoint::file_name(trainer));
        checkpoint::save(trainer, &saved)?;
        checkpoint::save_policy(trainer, &self.path.join("policy.safetensors"))?;
        let all = checkpoint::list(&folder)?;
        for old in all.iter().rev().skip(KEPT) {
            fs::remove_file(old).with_context(|| format!("cannot remove {}", old.display()))?;
        }
        Ok(saved)
    }

    /// What to tell whoever's run has failed.
    pub fn last_good(&self) -> String {
        match checkpoint::newest(&checkpoints(&self.path)) {
            Ok(last) => format!("the last good checkpoint is {}", last.display()),
            Err(_) => "there is no checkpoint yet".into(),
        }
    }

    /// Appends a line about an update.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn record(&self, line: &str) -> Result<()> {
        let path = self.progress();
        let file = OpenOptions::new().create(true).append(true).open(&path);
        file.and_then(|mut file| file.write_all(format!("{line}\n").as_bytes()))
            .with_context(|| format!("cannot write {}", path.display()))
    }

    fn progress(&self) -> PathBuf {
        self.path.join("progress.jsonl")
    }

    /// Drops the lines of updates that the checkpoint does not know, and torn ones.
    fn forget_progress_after(&self, steps: u64) -> Result<()> {
        let text = fs::read(self.progress()).unwrap_or_default();
        let text = String::from_utf8_lossy(&text);
        let known = text.lines().filter(|line| {
            let report = serde_json::from_str::<serde_json::Value>(line);
            report.is_ok_and(|report| report["steps"].as_u64().is_some_and(|it| it <= steps))
        });
        let kept: String = known.flat_map(|line| [line, "\n"]).collect();
        Ok(store::write_atomically(&self.progress(), kept.as_bytes())?)
    }
}

fn checkpoints(folder: &Path) -> PathBuf {
    folder.join("checkpoints")
}

fn refuse_another(folder: &Path) -> Result<()> {
    if let Ok(checkpoint) = checkpoint::newest(&checkpoints(folder)) {
        bail!("{} exists: go on with --resume, or choose another --out or seed", checkpoint.display());
    }
    Ok(())
}
