//! Launching missions in tests.

use std::fs::File;
use std::io::{Read, Seek};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, ExitStatus, Output};
use std::sync::atomic::{AtomicU16, Ordering};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal};

/// How long a process may take; one that hangs is told of, and not waited for.
const LIMIT: Duration = Duration::from_secs(400);
/// How long one may take that was interrupted.
const STOP_LIMIT: Duration = Duration::from_secs(90);

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
///
/// What it prints goes to files: a process that it leaves behind cannot keep the test waiting.
pub fn run(command: &mut Command) -> Output {
    let mut printed = [tempfile::tempfile().unwrap(), tempfile::tempfile().unwrap()];
    let [stdout, stderr] = [0, 1].map(|number: usize| printed[number].try_clone().unwrap());
    let mut child = Running::start(command.stdout(stdout).stderr(stderr));
    let status = child.end();
    let [stdout, stderr] = printed.each_mut().map(read);
    let told = || format!("{}\n{}", String::from_utf8_lossy(&stdout), String::from_utf8_lossy(&stderr));
    let status = status.unwrap_or_else(|| panic!("{command:?} has not ended within {LIMIT:?}\n{}", told()));
    Output { status, stdout, stderr }
}

fn read(file: &mut File) -> Vec<u8> {
    let mut bytes = Vec::new();
    file.rewind().unwrap();
    file.read_to_end(&mut bytes).unwrap();
    bytes
}

/// Waits until a process has ended; nothing if that takes too long.
fn end(child: &mut Child, limit: Duration) -> Option<ExitStatus> {
    let begin = Instant::now();
    while begin.elapsed() < limit {
        if let Some(status) = child.try_wait().unwrap() {
            return Some(status);
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    None
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
    // It announces itself more often than every eight seconds: some missions do not take much longer.
    command.env(
        "CYCLONEDDS_URI",
        "<General><Interfaces><NetworkInterface name=\"lo\" multicast=\"true\"/></Interfaces></General>\
         <Discovery><SPDPInterval>0.5s</SPDPInterval></Discovery>",
    );
    command
}

/// A process that is ended with the test.
pub struct Running(Child);

impl Running {
    /// Starts it.
    pub fn start(command: &mut Command) -> Self {
        Self(command.spawn().unwrap())
    }

    /// Its process.
    pub fn pid(&self) -> Pid {
        Pid::from_raw(self.0.id() as i32).unwrap()
    }

    /// Whether it is still there.
    pub fn runs(&mut self) -> bool {
        self.0.try_wait().unwrap().is_none()
    }

    /// What it prints, if that goes to a pipe.
    pub fn stdout(&mut self) -> ChildStdout {
        self.0.stdout.take().unwrap()
    }

    /// Waits until it has ended, which it must in time.
    pub fn wait(&mut self) -> ExitStatus {
        let id = self.0.id();
        self.end().unwrap_or_else(|| panic!("process {id} has not ended within {LIMIT:?}"))
    }

    /// Waits until it has ended; nothing, and it is ended, if that takes too long.
    fn end(&mut self) -> Option<ExitStatus> {
        let ended = end(&mut self.0, LIMIT);
        if ended.is_none() {
            self.interrupt();
        }
        ended
    }

    /// Sends it a signal.
    pub fn signal(&self, signal: Signal) {
        let _ = rustix::process::kill_process(self.pid(), signal);
    }

    /// Kills it, as `kill -9` does.
    pub fn kill(&mut self) {
        self.signal(Signal::KILL);
        self.wait();
    }

    /// Interrupts it as Ctrl-C does, and waits until it has ended.
    pub fn stop(&mut self) {
        assert!(self.interrupt(), "process {} has not ended within {STOP_LIMIT:?} of SIGINT", self.0.id());
    }

    /// Interrupts it; whether it has ended in time, if not, it is killed.
    fn interrupt(&mut self) -> bool {
        self.signal(Signal::INT);
        let ended = end(&mut self.0, STOP_LIMIT).is_some();
        if !ended {
            let _ = self.0.kill();
        }
        ended
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        if self.runs() {
            self.interrupt();
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
    let begin = Instant::now();
    while begin.elapsed() < Duration::from_secs(120) {
        if let Some(found) = look() {
            return found;
        }
        std::thread::sleep(Duration::from_millis(100));
    }
    panic!("{what} did not come within two minutes");
}
