//! The processes of a mission: started, listened to, and started again when they are lost.

use std::io::{BufRead, BufReader};
use std::os::unix::process::ExitStatusExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use swath_ros::Sign;

use swath_mission::outcome::NodeProcess;
use swath_mission::supervision::{Step, SupervisionConfig, Watch};

/// How long a process may take to end after it was asked to.
const STOP_TIMEOUT: Duration = Duration::from_secs(20);
/// How long what a process has said before it ended may take to be read.
const LAST_WORDS: Duration = Duration::from_millis(200);

/// Child processes; whatever still runs is killed when this is dropped.
pub struct Fleet {
    members: Vec<Member>,
    config: SupervisionConfig,
    began: Instant,
    /// Simulated time as the nodes know it [ns].
    now_ns: u64,
}

/// What has become of a process.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// Name of its node.
    pub node: String,
    /// What.
    pub what: Happened,
}

/// What has become of a process.
#[derive(Clone, Debug, PartialEq)]
pub enum Happened {
    /// It gives no sign of life for so long.
    Silent(Duration),
    /// It has ended, as told in words, for the so-manieth time of late, and is started again.
    Lost {
        /// How.
        how: String,
        /// How often of late.
        times: u32,
        /// Whether that was ordered.
        by_order: bool,
    },
    /// Another one is there.
    Back {
        /// Whether the loss before was ordered.
        by_order: bool,
    },
    /// It was lost too often: it is not started again.
    GivenUp {
        /// How it was lost last.
        how: String,
    },
}

struct Member {
    name: String,
    program: PathBuf,
    /// Words of its command line, the last ones ROS's.
    args: Vec<String>,
    /// Parameters of the next start.
    extra: Vec<String>,
    running: Option<Running>,
    watch: Watch,
    /// How often it was started again.
    epoch: u64,
    /// How often what was ordered has befallen it.
    struck: u64,
    /// Whether it has been struck since its last sign of life.
    by_order: bool,
    lost: bool,
    /// Whether the mission goes on without it.
    beside: bool,
}

struct Running {
    child: Child,
    lines: Receiver<String>,
}

impl Fleet {
    /// No processes yet.
    pub fn new(config: &SupervisionConfig) -> Self {
        Self { members: Vec::new(), config: config.clone(), began: Instant::now(), now_ns: 0 }
    }

    /// Starts a program of this suite: the one beside this executable, or else the one on the PATH. The words end with
    /// those of ROS.
    pub fn start(&mut self, name: &str, program: &str, args: &[String]) -> Result<()> {
        let mut member = self.member(name, program, args);
        member.start(&self.config)?;
        self.members.push(member);
        Ok(())
    }

    /// As [`Self::start`], a process without which the mission goes on, and which gives no sign of life. It is started
    /// again when it is killed.
    pub fn start_beside(&mut self, name: &str, program: &str, args: &[String]) -> Result<()> {
        let mut member = self.member(name, program, args);
        member.beside = true;
        member.start(&self.config)?;
        self.members.push(member);
        Ok(())
    }

    fn member(&self, name: &str, program: &str, args: &[String]) -> Member {
        Member {
            name: name.to_owned(),
            program: program_path(program),
            args: args.to_vec(),
            extra: Vec::new(),
            running: None,
            watch: Watch::new(self.config.clone(), self.began.elapsed()),
            epoch: 0,
            struck: 0,
            by_order: false,
            lost: false,
            beside: false,
        }
    }

    /// Parameters besides those given at first, for the next starts of a node.
    pub fn set_extra(&mut self, node: &str, parameters: &[String]) {
        for member in self.members.iter_mut().filter(|member| member.name == node) {
            member.extra = parameters.iter().flat_map(|it| ["-p".to_owned(), it.clone()]).collect();
        }
    }

    /// A node that was given up is started once more.
    pub fn pardon(&mut self, node: &str) {
        let now = self.began.elapsed();
        self.members.iter_mut().filter(|member| member.name == node).for_each(|member| member.watch.pardon(now));
    }

    /// Kills a node by order; it is started again.
    pub fn kill(&mut self, node: &str) -> Result<()> {
        for member in self.members.iter_mut().filter(|member| member.name == node) {
            member.by_order = true;
            member.kill()?;
        }
        Ok(())
    }

    /// Stops a node, which goes on existing.
    pub fn freeze(&mut self, node: &str) -> Result<()> {
        for member in self.members.iter_mut().filter(|member| member.name == node) {
            member.by_order = true;
            let pid = member.running.as_ref().and_then(|it| rustix::process::Pid::from_raw(it.child.id() as i32));
            if let Some(pid) = pid {
                rustix::process::kill_process(pid, rustix::process::Signal::STOP)?;
            }
        }
        Ok(())
    }

    /// Whether every process that is not given up is there.
    pub fn is_whole(&self) -> bool {
        self.members.iter().all(|member| member.watch.given_up() || (member.running.is_some() && !member.lost))
    }

    /// Simulated time as the nodes know it [ns].
    pub fn now_ns(&self) -> u64 {
        self.now_ns
    }

    /// Waits for the first line of its own that a member prints on stdout.
    pub fn wait_for_line(&mut self, name: &str, timeout: Duration) -> Result<String> {
        let deadline = Instant::now() + timeout;
        loop {
            let member = self.members.iter().find(|member| member.name == name);
            let running = member
                .and_then(|member| member.running.as_ref())
                .with_context(|| format!("{name} has ended, and has said why"))?;
            match running.lines.recv_timeout(Duration::from_millis(50)) {
                Ok(line) if Sign::parse(&line).is_none() => return Ok(line),
                _ => {}
            }
            self.check()?;
            if Instant::now() > deadline {
                bail!("{name} is not ready after {} s", timeout.as_secs());
            }
        }
    }

    /// Fails when a process has ended: so it is before the mission has begun.
    pub fn check(&mut self) -> Result<()> {
        for member in self.members.iter_mut().filter(|member| !member.beside) {
            if let Some(status) = member.ended()? {
                bail!("{} before the mission was over", ending(&member.name, status));
            }
        }
        Ok(())
    }

    /// Listens to all processes, kills those that hang, starts those that were lost again, and tells of it.
    pub fn supervise(&mut self) -> Result<Vec<Event>> {
        let mut events = Vec::new();
        for member in &mut self.members {
            let name = member.name.clone();
            let mut tell = |what| events.push(Event { node: name.clone(), what });
            let now = self.began.elapsed();
            let back = member.listen(now, &mut self.now_ns);
            if back && std::mem::take(&mut member.lost) {
                tell(Happened::Back { by_order: std::mem::take(&mut member.by_order) });
            }
            if let Some(status) = member.ended()? {
                member.hear_out(now, &mut self.now_ns);
                member.running = None;
                member.lost = true;
                let how = ending(&member.name, status);
                let by_order = member.by_order;
                // One that ends by itself has said why, and would do so again.
                let leaves = member.beside && status.signal().is_none();
                let step = if leaves { member.watch.give_up() } else { member.watch.lost(now) };
                tracing::warn!("{how}");
                tell(match step {
                    Step::GiveUp => Happened::GivenUp { how },
                    _ => Happened::Lost { how, times: member.watch.losses(), by_order },
                });
                continue;
            }
            if member.beside && member.running.is_some() {
                member.watch.sign(now);
                if std::mem::take(&mut member.lost) {
                    tell(Happened::Back { by_order: std::mem::take(&mut member.by_order) });
                }
            }
            match member.watch.step(now) {
                Step::Warn => tell(Happened::Silent(Duration::from_secs_f64(self.config.warn_s))),
                Step::Kill => {
                    tracing::warn!("node {} gives no sign of life and is killed", member.name);
                    member.kill()?;
                }
                Step::Start => {
                    member.epoch += 1;
                    member.start(&self.config)?;
                    member.watch.started(now);
                    tracing::info!("node {} is started again", member.name);
                }
                Step::Nothing | Step::GiveUp => {}
            }
        }
        Ok(events)
    }

    /// Names and process numbers.
    pub fn processes(&self) -> Vec<NodeProcess> {
        let of = |member: &Member| {
            let running = member.running.as_ref()?;
            Some(NodeProcess { name: member.name.clone(), pid: running.child.id() })
        };
        self.members.iter().filter_map(of).collect()
    }

    /// Asks the members of these names to end, in this order, and waits until each has.
    pub fn stop(&mut self, names: &[&str]) -> Result<()> {
        for name in names {
            let Some(at) = self.members.iter().position(|member| member.name == *name) else { continue };
            let member = self.members.swap_remove(at);
            let Some(mut running) = member.running else { bail!("node {name} was lost and is not there again") };
            let status = stop(&mut running.child)?;
            if !status.success() {
                bail!("{}", ending(name, status));
            }
        }
        Ok(())
    }
}

impl Member {
    fn start(&mut self, config: &SupervisionConfig) -> Result<()> {
        let mut own = vec![format!("epoch:={}", self.epoch), format!("orphaned_s:={:?}", config.orphaned_s)];
        if self.beside {
            own.clear();
        } else if self.struck > 0 {
            own.push(format!("struck:={}", self.struck));
        }
        let mut child = Command::new(&self.program)
            .args(&self.args)
            .args(own.iter().flat_map(|it| ["-p", it]))
            .args(&self.extra)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .with_context(|| format!("cannot start node {}: {}", self.name, self.program.display()))?;
        let (sender, lines) = channel();
        if let Some(stdout) = child.stdout.take() {
            std::thread::spawn(move || {
                for line in BufReader::new(stdout).lines().map_while(Result::ok) {
                    if sender.send(line).is_err() {
                        break;
                    }
                }
            });
        }
        self.running = Some(Running { child, lines });
        Ok(())
    }

    /// How its process has ended, if it has.
    fn ended(&mut self) -> Result<Option<ExitStatus>> {
        let Some(running) = &mut self.running else { return Ok(None) };
        Ok(running.child.try_wait()?)
    }

    /// Takes in what it has said; returns whether it gives its first sign of life since its start.
    fn listen(&mut self, now: Duration, now_ns: &mut u64) -> bool {
        let Some(running) = &self.running else { return false };
        let lines: Vec<String> = running.lines.try_iter().collect();
        let mut first = false;
        for line in lines {
            first |= self.hear(&line, now, now_ns);
        }
        first
    }

    fn hear(&mut self, line: &str, now: Duration, now_ns: &mut u64) -> bool {
        match Sign::parse(line) {
            Some(Sign::Alive(theirs)) => {
                *now_ns = theirs.max(*now_ns);
                self.watch.sign(now)
            }
            Some(Sign::Struck(number)) => {
                self.struck = number + 1;
                self.by_order = true;
                false
            }
            None => false,
        }
    }

    /// What it has said up to its end.
    fn hear_out(&mut self, now: Duration, now_ns: &mut u64) {
        let Some(running) = self.running.take() else { return };
        let deadline = Instant::now() + LAST_WORDS;
        while let Ok(line) = running.lines.recv_timeout(deadline.saturating_duration_since(Instant::now())) {
            self.hear(&line, now, now_ns);
        }
    }

    fn kill(&mut self) -> Result<()> {
        match &mut self.running {
            Some(running) => running.child.kill().with_context(|| format!("cannot kill node {}", self.name)),
            None => Ok(()),
        }
    }
}

impl Drop for Fleet {
    fn drop(&mut self) {
        let running = || self.members.iter().filter_map(|member| member.running.as_ref());
        running().for_each(|running| interrupt(&running.child));
        for running in self.members.iter_mut().filter_map(|member| member.running.as_mut()) {
            // Nothing more can be done for a process that cannot be ended.
            let _ = stop(&mut running.child);
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
