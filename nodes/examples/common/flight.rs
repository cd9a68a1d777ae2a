//! Missions flown by the programs of this suite, for measurements.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use swath_mission::outcome::Summary;

/// The program `swath` that was built with this example.
pub fn swath() -> Result<PathBuf> {
    let exe = std::env::current_exe()?;
    let release = exe.parent().and_then(Path::parent).context("this example lies in no target folder")?;
    let swath = release.join("swath");
    ensure!(swath.is_file(), "{} is missing: cargo build --release --workspace --bins", swath.display());
    Ok(swath)
}

/// Python with the packages of the tests.
pub fn python() -> Result<PathBuf> {
    let own = Path::new(env!("CARGO_MANIFEST_DIR")).join("../.venv/bin/python");
    let python = std::env::var_os("SWATH_PYTHON").map_or(own, PathBuf::from);
    ensure!(python.exists(), "no Python at {}: run `cargo xtask setup --test`", python.display());
    Ok(python)
}

/// A mission that flies; dropping it ends it.
pub struct Flight {
    launch: Child,
    out: PathBuf,
}

impl Flight {
    /// Launches a mission with some words in a domain.
    pub fn launch(mission: &Path, out: &Path, domain: u16, words: &[&str]) -> Result<Self> {
        let mut command = Command::new(swath()?);
        command.env("ROS_DOMAIN_ID", domain.to_string()).env("ROS_LOCALHOST_ONLY", "1");
        Self::start(command, mission, out, words)
    }

    /// As [`Self::launch`], by a command that becomes `swath` in surroundings of its own.
    pub fn start(mut command: Command, mission: &Path, out: &Path, words: &[&str]) -> Result<Self> {
        command.arg("launch").arg(mission).arg("--out").arg(out).args(words);
        let said = std::fs::File::create(out.with_extension("log"))?;
        let launch = command.stdout(Stdio::null()).stderr(said).spawn()?;
        Ok(Self { launch, out: out.to_owned() })
    }

    /// Waits until so many tasks are over.
    pub fn wait_for_tasks(&mut self, count: usize) -> Result<()> {
        let deadline = Instant::now() + Duration::from_secs(60);
        while self.tasks().lines().count() < count {
            ensure!(Instant::now() < deadline && self.flies()?, "the mission has not begun: {}", self.said());
            std::thread::sleep(Duration::from_millis(5));
        }
        Ok(())
    }

    /// Whether it has not ended.
    pub fn flies(&mut self) -> Result<bool> {
        Ok(self.launch.try_wait()?.is_none())
    }

    /// The launcher's process.
    pub fn pid(&self) -> u32 {
        self.launch.id()
    }

    /// Waits for the end; the launcher's exit code.
    pub fn code(&mut self) -> Result<Option<i32>> {
        Ok(self.launch.wait()?.code())
    }

    /// `tasks.jsonl` as far as it is written.
    pub fn tasks(&self) -> String {
        std::fs::read_to_string(self.out.join("tasks.jsonl")).unwrap_or_default()
    }

    /// What the mission said on stderr.
    pub fn said(&self) -> String {
        std::fs::read_to_string(self.out.with_extension("log")).unwrap_or_default()
    }

    /// Waits for the end; whether it went well, the summary and the tasks.
    pub fn end(&mut self) -> Result<(bool, Summary, String)> {
        let status = self.launch.wait()?;
        let text = std::fs::read_to_string(self.out.join("summary.json"));
        let text = text.with_context(|| format!("no summary: {}", self.said()))?;
        Ok((status.success(), serde_json::from_str(&text)?, self.tasks()))
    }
}

impl Drop for Flight {
    fn drop(&mut self) {
        if matches!(self.launch.try_wait(), Ok(None)) {
            signal(self.launch.id(), "-INT");
            // It has ended or was killed by somebody else.
            let _ = self.launch.wait();
        }
    }
}

/// Sends a signal such as `-STOP` to a process.
pub fn signal(process: u32, signal: &str) {
    // One that has ended needs none.
    let _ = Command::new("kill").args([signal, &process.to_string()]).stderr(Stdio::null()).status();
}
