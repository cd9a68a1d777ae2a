//! A process of a mission: a child of this launcher, or one that a launcher before has left.

use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, Read};
use std::os::unix::process::ExitStatusExt as _;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use rustix::io::Errno;
use rustix::process::{Pid, Signal, kill_process};
use serde::{Deserialize, Serialize};

/// How long a process may take to end after it was asked to.
const STOP_TIMEOUT: Duration = Duration::from_secs(20);
/// How long it may take to end once it is killed.
const KILL_TIMEOUT: Duration = Duration::from_secs(2);

/// Names a process for as long as the machine runs: numbers are used again, with another start.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Name {
    /// Its number.
    pub pid: u32,
    /// When it was started [ticks of the kernel's clock since the machine was started].
    pub started: u64,
}

/// How a process has ended.
#[derive(Clone, Copy, Debug)]
pub enum Ending {
    /// As the kernel tells its parent.
    Known(ExitStatus),
    /// It is not there any more; only its parent, which is gone, could know more.
    Gone,
}

/// A process that runs, and the lines that it says.
pub struct Running {
    /// Its number. It is kept here for both kinds: where `pid` matched on them, rustc 1.95 made code that looked for the
    /// number of a process that was not there, and the launcher crashed.
    pid: u32,
    process: Process,
    /// What it says on its stdout, or to whoever listens after that.
    pub lines: Receiver<String>,
}

enum Process {
    Child(Child),
    Left(Name),
}

impl Running {
    /// Starts a program.
    pub fn start(command: &mut Command) -> std::io::Result<Self> {
        let mut child = command.stdin(Stdio::null()).stdout(Stdio::piped()).spawn()?;
        let lines = match child.stdout.take() {
            Some(stdout) => listen(stdout),
            None => channel().1,
        };
        Ok(Self { pid: child.id(), process: Process::Child(child), lines })
    }

    /// Takes over a process that a launcher before has started, if it is there; it speaks at `signs`.
    pub fn take_over(name: Name, signs: &Path) -> Result<Option<Self>> {
        if started(name.pid) != Some(name.started) {
            return Ok(None);
        }
        // Open for writing too, it has no end when the process ends, and opening it waits for nobody.
        let signs = OpenOptions::new().read(true).write(true).open(signs);
        let signs: File = signs.with_context(|| format!("cannot listen to process {}", name.pid))?;
        Ok(Some(Self { pid: name.pid, process: Process::Left(name), lines: listen(signs) }))
    }

    /// Its number.
    pub fn pid(&self) -> u32 {
        self.pid
    }

    /// Its name, if it runs.
    pub fn name(&self) -> Option<Name> {
        let pid = self.pid();
        Some(Name { pid, started: started(pid)? })
    }

    /// How it has ended, if it has.
    pub fn ended(&mut self) -> Result<Option<Ending>> {
        Ok(match &mut self.process {
            Process::Child(child) => child.try_wait()?.map(Ending::Known),
            Process::Left(name) => (started(name.pid) != Some(name.started)).then_some(Ending::Gone),
        })
    }

    /// Sends it a signal; it may have ended by itself.
    pub fn send(&self, signal: Signal) -> Result<()> {
        let Some(pid) = i32::try_from(self.pid()).ok().and_then(Pid::from_raw) else { return Ok(()) };
        if let Process::Left(name) = &self.process
            && started(name.pid) != Some(name.started)
        {
            return Ok(());
        }
        match kill_process(pid, signal) {
            Ok(()) | Err(Errno::SRCH) => Ok(()),
            Err(error) => Err(error).with_context(|| format!("cannot signal process {}", self.pid())),
        }
    }

    /// Listens to it no longer: should it speak again, it finds that it has no launcher.
    pub fn leave(&mut self) {
        self.lines = channel().1;
    }

    /// Asks it to end and waits until it has; one that does not end is killed. One that does not end even then is an
    /// error.
    pub fn stop(&mut self) -> Result<Ending> {
        self.send(Signal::INT)?;
        let deadline = Instant::now() + STOP_TIMEOUT;
        loop {
            if let Some(ending) = self.ended()? {
                return Ok(ending);
            }
            if Instant::now() > deadline + KILL_TIMEOUT {
                bail!("process {} does not end though it was killed", self.pid());
            }
            if Instant::now() > deadline {
                self.send(Signal::KILL)?;
            }
            std::thread::sleep(Duration::from_millis(10));
        }
    }
}

impl Ending {
    /// Whether all is well, as far as can be known.
    pub fn is_well(self) -> bool {
        match self {
            Self::Known(status) => status.success(),
            Self::Gone => true,
        }
    }

    /// Its exit code, if it is known.
    pub fn code(self) -> Option<i32> {
        match self {
            Self::Known(status) => status.code(),
            Self::Gone => None,
        }
    }

    /// Whether it was ended by a signal, or may have been.
    pub fn is_killed(self) -> bool {
        match self {
            Self::Known(status) => status.signal().is_some(),
            Self::Gone => true,
        }
    }

    /// In words. One that fails says why by itself; one that is killed cannot.
    pub fn of(self, name: &str) -> String {
        let Self::Known(status) = self else { return format!("node {name} is not there any more") };
        match (status.code(), status.signal()) {
            (Some(0), _) => format!("node {name} has ended"),
            (Some(code), _) => format!("node {name} has failed (exit code {code}; it has said why)"),
            (None, Some(signal)) => format!("node {name} was killed by signal {signal}"),
            (None, None) => format!("node {name} has ended ({status})"),
        }
    }
}

/// When a process was started, as the kernel tells; nothing for one that is not there or has ended.
fn started(pid: u32) -> Option<u64> {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    // The name, in parentheses, may hold anything; the state follows it, and the start is the twentieth word from there.
    let mut words = stat.rsplit_once(')')?.1.split_ascii_whitespace();
    let state = words.next()?;
    if state == "Z" || state == "X" {
        return None;
    }
    words.nth(18)?.parse().ok()
}

/// The lines of a pipe, read by a thread of their own.
fn listen(pipe: impl Read + Send + 'static) -> Receiver<String> {
    let (sender, lines) = channel();
    std::thread::spawn(move || {
        for line in BufReader::new(pipe).lines().map_while(std::result::Result::ok) {
            if sender.send(line).is_err() {
                break;
            }
        }
    });
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_process_that_was_left_is_known_by_its_start_and_is_gone_when_it_ends() {
        let folder = tempfile::tempdir().unwrap();
        let signs = folder.path().join("signs");
        std::fs::write(&signs, "").unwrap();
        let mut child = Running::start(Command::new("sleep").arg("600")).unwrap();
        let name = child.name().unwrap();
        assert!(Running::take_over(Name { started: name.started + 1, ..name }, &signs).unwrap().is_none());
        let mut left = Running::take_over(name, &signs).unwrap().unwrap();
        assert!(left.ended().unwrap().is_none());
        left.send(Signal::TERM).unwrap();
        let Ending::Known(status) = child.stop().unwrap() else { panic!("a child's end is known") };
        assert_eq!(status.signal(), Some(15));
        assert!(matches!(left.ended().unwrap(), Some(Ending::Gone)));
        left.send(Signal::KILL).unwrap();
        assert!(Running::take_over(name, &signs).unwrap().is_none());
    }

    #[test]
    fn one_that_is_left_cannot_speak_any_more() {
        let speaks = "while true; do echo alive 1; sleep 0.05; done";
        let mut child = Running::start(Command::new("sh").args(["-c", speaks])).unwrap();
        assert_eq!(child.lines.recv_timeout(Duration::from_secs(20)).unwrap(), "alive 1");
        child.leave();
        let deadline = Instant::now() + Duration::from_secs(20);
        let ending = loop {
            if let Some(ending) = child.ended().unwrap() {
                break ending;
            }
            assert!(Instant::now() < deadline, "it speaks on");
            std::thread::sleep(Duration::from_millis(10));
        };
        // As a broken pipe ends a program that does not mind it.
        assert!(ending.is_killed());
    }

    #[test]
    fn endings_have_words() {
        assert_eq!(Ending::Gone.of("planner"), "node planner is not there any more");
        assert_eq!(Ending::Known(ExitStatus::from_raw(9)).of("planner"), "node planner was killed by signal 9");
        assert!(Ending::Known(ExitStatus::from_raw(0)).is_well());
    }
}
