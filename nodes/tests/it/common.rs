//! Launching missions in tests.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::atomic::{AtomicU16, Ordering};

/// A DDS domain of this test's own, from 100 to 229, in which nobody is yet: tests run side by side, and so do those of
/// other checkouts.
pub fn domain() -> String {
    static NEXT: AtomicU16 = AtomicU16::new(0);
    let first = std::process::id() % 13 * 10;
    let domains = std::iter::repeat_with(|| NEXT.fetch_add(1, Ordering::Relaxed)).take(130);
    let domain = domains.map(|next| 100 + (first + u32::from(next)) % 130).find(|domain| !is_used(*domain));
    domain.expect("there are participants in every domain").to_string()
}

/// Whether somebody listens where participants of a domain announce themselves.
fn is_used(domain: u32) -> bool {
    let table = std::fs::read_to_string("/proc/self/net/udp").unwrap();
    let port = format!(":{:04X}", 7400 + 250 * domain);
    table.lines().filter_map(|line| line.split_whitespace().nth(1)).any(|address| address.ends_with(&port))
}

/// An address of this machine that nobody uses.
pub fn address() -> String {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    listener.local_addr().unwrap().to_string()
}

/// A program of this suite: cargo puts those of all its packages beside `swath`, but builds for a test only those of the
/// test's own package.
pub fn program(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_BIN_EXE_swath")).with_file_name(name);
    let profile = if cfg!(debug_assertions) { "" } else { " --release" };
    assert!(path.is_file(), "{} is missing: run `cargo build{profile} --workspace --bins`", path.display());
    path
}

/// A command of this suite on a domain.
pub fn command(program: &str, domain: &str) -> Command {
    let mut command = Command::new(self::program(program));
    command.env("ROS_DOMAIN_ID", domain).env("ROS_LOCALHOST_ONLY", "1");
    command
}

/// Writes a mission file.
pub fn write_mission(folder: &Path, text: &str) -> PathBuf {
    let path = folder.join("mission.toml");
    std::fs::write(&path, text).unwrap();
    path
}

/// A mission with little else to do than what it is asked for.
pub const QUIET: &str = r#"
name = "quiet"
seed = 11
orbits = 60.0
pace = 40.0
planner = "lookahead"

[requests.random]
count = [80, 80]

[approval]
deadline_s = 1800.0
at_deadline = "skip"
"#;

/// Runs a command to its end.
pub fn run(command: &mut Command) -> Output {
    command.output().unwrap()
}

/// Runs a command that must succeed.
pub fn succeed(command: &mut Command) -> String {
    let output = run(command);
    let (stdout, stderr) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{command:?} failed: {}\n{stdout}\n{stderr}", output.status);
    stdout.into_owned()
}

/// Runs a command that must fail with an exit code, and returns what it says on stderr.
pub fn fail(command: &mut Command) -> String {
    let output = run(command);
    assert_eq!(output.status.code(), Some(1), "{command:?}: {}", output.status);
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A script of `tests/python` in the Python environment that `cargo xtask test` makes.
pub fn python(script: &str, domain: &str) -> Command {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let interpreter = std::env::var_os("SWATH_PYTHON").map_or(root.join("../.venv/bin/python"), PathBuf::from);
    assert!(interpreter.exists(), "no Python at {}: run `cargo xtask setup --test`", interpreter.display());
    let mut command = Command::new(interpreter);
    command.arg(root.join("tests/python").join(script)).arg(domain);
    command.env(
        "CYCLONEDDS_URI",
        "<General><Interfaces><NetworkInterface name=\"lo\" multicast=\"true\"/></Interfaces></General>",
    );
    command
}

/// A process that is ended with the test.
pub struct Running(std::process::Child);

impl Running {
    /// Starts it.
    pub fn start(command: &mut Command) -> Self {
        Self(command.spawn().unwrap())
    }

    /// Interrupts it as Ctrl-C does, and waits until it has ended.
    pub fn stop(&mut self) {
        let pid = rustix::process::Pid::from_raw(self.0.id() as i32).unwrap();
        let _ = rustix::process::kill_process(pid, rustix::process::Signal::INT);
        self.0.wait().unwrap();
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        if self.0.try_wait().unwrap().is_none() {
            self.stop();
        }
    }
}

/// `swath` with some words on a domain.
pub fn swath(domain: &str, words: &[&str]) -> Command {
    let mut swath = command("swath", domain);
    swath.args(words);
    swath
}

/// The JSON values that a command prints, one a line.
pub fn json_lines(text: &str) -> Vec<serde_json::Value> {
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

/// Looks again and again until something is found; tests give up after two minutes.
pub fn until<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let begin = std::time::Instant::now();
    while begin.elapsed() < std::time::Duration::from_secs(120) {
        if let Some(found) = look() {
            return found;
        }
        std::thread::sleep(std::time::Duration::from_millis(100));
    }
    panic!("{what} did not come within two minutes");
}
