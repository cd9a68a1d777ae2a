//! The processes of a mission.

use std::io::{BufRead, BufReader};
use std::os::unix::process::ExitStatusExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};

use swath_mission::outcome::NodeProcess;

/// How long a process may take to end after it was asked to.
const STOP_TIMEOUT: Duration = Duration::from_secs(20);

/// Child processes; whatever still runs is killed when this is dropped.
#[derive(Default)]
pub struct Fleet {
    members: Vec<Member>,
}

struct Member {
    name: String,
    child: Child,
    lines: Option<Receiver<String>>,
    /// How to start it again when it is killed.
    revive: Option<(PathBuf, Vec<String>)>,
    /// Whether the mission goes on without it.
    beside: bool,
}

impl Fleet {
    /// Starts a program of this suite: the one beside this executable, or else the one on the PATH.
    pub fn start(&mut self, name: &str, program: &str, args: &[String], listen: bool) -> Result<()> {
        let path = program_path(program);
        let stdout = if listen { Stdio::piped() } else { Stdio::null() };
        let mut child = Command::new(&path)
            .args(args)
            .stdin(Stdio::null())
            .stdout(stdout)
            .spawn()
            .with_context(|| format!("cannot start node {name}: {}", path.display()))?;
        let lines = child.stdout.take().map(|stdout| {
            let (sender, receiver) = channel();
            std::thread::spawn(move || {
                for line in BufReader::new(stdout).lines().map_while(Result::ok) {
                    if sender.send(line).is_err() {
                        break;
                    }
                }
            });
            receiver
        });
        self.members.push(Member { name: name.to_owned(), child, lines, revive: None, beside: false });
        Ok(())
    }

    /// As [`Self::start_and_keep`] and listened to, for a process without which the mission goes on.
    pub fn start_beside(&mut self, name: &str, program: &str, args: &[String]) -> Result<()> {
        self.start(name, program, args, true)?;
        if let Some(member) = self.members.last_mut() {
            member.revive = Some((program_path(program), args.to_vec()));
            member.beside = true;
        }
        Ok(())
    }

    /// As [`Self::start`], and again whenever the process is killed: it takes up its work where it was.
    pub fn start_and_keep(&mut self, name: &str, program: &str, args: &[String]) -> Result<()> {
        self.start(name, program, args, false)?;
        if let Some(member) = self.members.last_mut() {
            member.revive = Some((program_path(program), args.to_vec()));
        }
        Ok(())
    }

    /// Waits for the first line that a member prints on stdout.
    pub fn wait_for_line(&mut self, name: &str, timeout: Duration) -> Result<String> {
        let deadline = Instant::now() + timeout;
        loop {
            let member = self.members.iter().find(|member| member.name == name);
            let lines = member
                .and_then(|member| member.lines.as_ref())
                .with_context(|| format!("{name} has ended, and has said why"))?;
            if let Ok(line) = lines.recv_timeout(Duration::from_millis(50)) {
                return Ok(line);
            }
            self.check()?;
            if Instant::now() > deadline {
                bail!("{name} is not ready after {} s", timeout.as_secs());
            }
        }
    }

    /// Fails when a process has ended that the mission needs; starts it again when it was killed and can go on.
    pub fn check(&mut self) -> Result<()> {
        let mut left = None;
        for (at, member) in self.members.iter_mut().enumerate() {
            let Some(status) = member.child.try_wait()? else { continue };
            match &member.revive {
                // One that ends by itself has said why, and would do so again.
                Some((path, args)) if status.signal().is_some() => {
                    tracing::warn!("node {} has ended ({status}) and is started again", member.name);
                    let start = Command::new(path).args(args).stdin(Stdio::null()).stdout(Stdio::null()).spawn();
                    member.child = start.with_context(|| format!("cannot start node {} again", member.name))?;
                }
                _ if member.beside => {
                    tracing::warn!("{}; the mission goes on", ending(&member.name, status));
                    left = Some(at);
                }
                _ => bail!("{} before the mission was over", ending(&member.name, status)),
            }
        }
        // Another one that has ended is looked at the next time.
        if let Some(at) = left {
            self.members.swap_remove(at);
        }
        Ok(())
    }

    /// Names and process numbers.
    pub fn processes(&self) -> Vec<NodeProcess> {
        self.members.iter().map(|member| NodeProcess { name: member.name.clone(), pid: member.child.id() }).collect()
    }

    /// Asks the members of these names to end, in this order, and waits until each has.
    pub fn stop(&mut self, names: &[&str]) -> Result<()> {
        for name in names {
            let Some(at) = self.members.iter().position(|member| member.name == *name) else { continue };
            let mut member = self.members.swap_remove(at);
            let status = stop(&mut member.child)?;
            if !status.success() {
                bail!("{}", ending(name, status));
            }
        }
        Ok(())
    }
}

impl Drop for Fleet {
    fn drop(&mut self) {
        for member in &self.members {
            interrupt(&member.child);
        }
        for member in &mut self.members {
            // Nothing more can be done for a process that cannot be ended.
            let _ = stop(&mut member.child);
        }
    }
}

/// How a process has ended, in words. One that fails says why by itself; one that is killed cannot.
fn ending(name: &str, status: ExitStatus) -> String {
    match (status.code(), status.signal()) {
        (Some(0), _) => format!("node {name} has ended"),
        (Some(code), _) => format!("node {name} has failed (exit code {code}; it has said why)"),
        (None, Some(signal)) => format!("node {name} was killed by signal {signal}"),
        (None, None) => format!("node {name} has ended ({status})"),
    }
}

fn interrupt(child: &Child) {
    if let Some(pid) = rustix::process::Pid::from_raw(child.id() as i32) {
        // It may have ended by itself.
        let _ = rustix::process::kill_process(pid, rustix::process::Signal::INT);
    }
}

fn stop(child: &mut Child) -> Result<ExitStatus> {
    if let Some(status) = child.try_wait()? {
        return Ok(status);
    }
    interrupt(child);
    let deadline = Instant::now() + STOP_TIMEOUT;
    while Instant::now() < deadline {
        if let Some(status) = child.try_wait()? {
            return Ok(status);
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    child.kill()?;
    Ok(child.wait()?)
}

fn program_path(program: &str) -> PathBuf {
    let beside = std::env::current_exe().ok().and_then(|exe| Some(exe.parent()?.join(program)));
    beside.filter(|path| path.is_file()).unwrap_or_else(|| Path::new(program).to_owned())
}
