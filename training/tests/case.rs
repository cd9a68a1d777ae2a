//! `swath-train` in a folder of its own.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

use serde_json::Value;
use tempfile::TempDir;

pub const TOY: &str = r#"
name = "toy"
steps = 400
checkpoint_every = 100
environment = { kind = "toy", tokens = 4 }
network = { kind = "hop-ppo-mlp", encoder = [8], discrete = [8], continuous = [8], critic = [8] }
rollout = { environments = 4, group = 2, stagger = 15 }
ppo = { batch = 40, minibatch = 20, epochs = 2, learning_rate = 1e-3, learning_rate_end = 1e-4 }
"#;

pub const STRIPS: &str = r#"
name = "strips"
steps = 60
[environment]
kind = "strips"
episode = { orbits = 0.5, scenario = { count = [300, 300] } }
[network]
kind = "hop-ppo"
dim = 8
heads = 2
layers = 1
feed_forward = 8
head = "pointer"
discrete = [8]
continuous = [8]
critic = [8]
[rollout]
environments = 2
group = 1
[ppo]
batch = 30
minibatch = 30
epochs = 1
"#;

/// A folder with a run's TOML.
pub struct Case {
    pub folder: TempDir,
}

impl Case {
    pub fn new(run: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("run.toml"), run).unwrap();
        Self { folder }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn train(&self, more: &[&str]) -> Output {
        let mut args = vec!["train", "--config", "run.toml", "--out", "out", "--threads", "1"];
        args.extend(more);
        self.run(&args)
    }

    pub fn run(&self, args: &[&str]) -> Output {
        self.command(args).output().unwrap()
    }

    pub fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_swath-train"));
        command.args(args).current_dir(self.folder.path());
        command
    }

    pub fn refused(&self, output: &Output, texts: &[&str]) {
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{error}");
        for text in texts {
            assert!(error.contains(text), "{text} is not in: {error}");
        }
    }
}

pub fn succeeded(output: &Output) {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

pub fn checkpoints(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries.map(|it| it.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// The `steps` of every line of a progress file.
pub fn progress_steps(path: &Path) -> Vec<u64> {
    let text = std::fs::read_to_string(path).unwrap_or_default();
    text.lines().map(|line| serde_json::from_str::<Value>(line).unwrap()["steps"].as_u64().unwrap()).collect()
}

/// A run that goes on while the test does something else; it is killed when the test fails.
pub struct Running(Child);

impl Case {
    /// Starts a run and waits until `begun` says that it is where it is wanted.
    pub fn start(&self, more: &[&str], begun: impl Fn(&Path) -> bool) -> Running {
        let mut args = vec!["train", "--config", "run.toml", "--out", "out", "--threads", "1"];
        args.extend(more);
        let stderr = std::fs::File::create(self.path("stderr")).unwrap();
        let mut running = Running(self.command(&args).stderr(stderr).stdout(Stdio::null()).spawn().unwrap());
        while !begun(&self.path("")) {
            assert!(running.0.try_wait().unwrap().is_none(), "it ended by itself: {}", self.stderr());
            std::thread::sleep(Duration::from_millis(20));
        }
        running
    }

    /// What the run that was started has said.
    pub fn stderr(&self) -> String {
        std::fs::read_to_string(self.path("stderr")).unwrap()
    }
}

impl Running {
    /// Its process.
    pub fn id(&self) -> u32 {
        self.0.id()
    }

    /// Sends a signal.
    pub fn signal(&self, signal: i32) {
        // SAFETY: the process is ours and has not been waited for.
        unsafe { libc::kill(libc::pid_t::try_from(self.0.id()).unwrap(), signal) };
    }

    /// Its exit code when it ends within a time.
    pub fn ends_within(&mut self, patience: Duration) -> Option<i32> {
        let step = Duration::from_millis(20);
        for _ in 0..patience.as_millis() / step.as_millis() {
            if let Some(status) = self.0.try_wait().unwrap() {
                return status.code();
            }
            std::thread::sleep(step);
        }
        None
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // It has ended where the test went as it should.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}
