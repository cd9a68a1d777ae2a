//! What the tests have in common.

use std::path::PathBuf;
use std::process::Command;
use std::time::{Duration, Instant};

use swath_ros::{Environment, Mapping, Node, RosArgs, RosError};

pub const PATIENCE: Duration = Duration::from_secs(20);

/// A domain and a namespace that one test has for itself, even while the same tests run elsewhere on this host.
pub struct Trial {
    pub domain: u16,
    pub namespace: String,
}

impl Trial {
    pub fn new(number: u16) -> Self {
        let process = std::process::id();
        // Domains 10 to 99: their ports lie below those that the system hands out.
        let domain = 10 + (process as u16 % 9 * 10 + number) % 90;
        Self { domain, namespace: format!("/p{process}_{number}") }
    }

    /// Starts a node on this host only, with words after `--ros-args`.
    pub fn start(&self, name: &str, words: &str) -> Result<Node, RosError> {
        self.start_mapped(name, words, Mapping::Cyclone)
    }

    pub fn start_mapped(&self, name: &str, words: &str, mapping: Mapping) -> Result<Node, RosError> {
        // Many nodes share the memory of this process.
        let unbounded = if words.contains("memory_limit_mb") { "" } else { "-p memory_limit_mb:=0" };
        let line = format!("--ros-args -r __ns:={} {unbounded} {words}", self.namespace);
        let args = RosArgs::split(line.split_whitespace().map(str::to_owned))?.1;
        let environment = Environment { domain: self.domain, localhost_only: true, mapping };
        Node::start_in(environment, name, &args)
    }

    /// The name in this trial's namespace.
    pub fn full(&self, name: &str) -> String {
        format!("{}/{name}", self.namespace)
    }
}

/// Tries until there is something or patience is over.
pub fn eventually<T>(mut attempt: impl FnMut() -> Option<T>) -> T {
    let deadline = Instant::now() + PATIENCE;
    loop {
        if let Some(found) = attempt() {
            return found;
        }
        assert!(Instant::now() < deadline, "it did not happen in {PATIENCE:?}");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// A Python program beside these tests, in `.venv` or where `SWATH_PYTHON` says.
pub fn python(program: &str) -> Command {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let interpreter = std::env::var_os("SWATH_PYTHON").map_or(root.join("../../.venv/bin/python"), PathBuf::from);
    assert!(interpreter.exists(), "no Python for the tests: run `cargo xtask test`, which makes .venv");
    let mut command = Command::new(interpreter);
    command.arg("-u").arg(root.join("tests/python").join(program));
    command
}
