//! The processes of a mission: started, listened to, and started again when they are lost.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, anyhow, bail};
use rustix::process::Signal;
use swath_bags::cli::NO_ROOM;
use swath_ros::{Sign, graph};

use swath_mission::outcome::NodeProcess;
use swath_mission::supervision::{Heard, Step, SupervisionConfig, Watch};

use super::kept::{Keeping, KeptMember};
use super::process::{Ending, Running};

/// How long what a process has said before it ended may take to be read.
const LAST_WORDS: Duration = Duration::from_millis(200);

/// Child processes; whatever still runs is killed when this is dropped.
pub struct Fleet {
    members: Vec<Member>,
    config: SupervisionConfig,
    began: Instant,
    /// Simulated time as the nodes know it [ns].
    now_ns: u64,
    keeping: Keeping,
    /// Whether there was no room to keep who flies.
    unkept: bool,
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
    Silent {
        /// How long.
        time: Duration,
        /// Whether that was ordered.
        by_order: bool,
    },
    /// It gives signs of life again, after it was silent.
    Heard,
    /// It has ended, as told in words, for the so-manieth time of late, and is started again.
    Lost {
        /// How.
        how: String,
        /// How often of late.
        times: u32,
        /// Whether that was ordered.
        by_order: bool,
    },
    /// It has ended because there is no room on the disk, and is started again.
    NoRoom,
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
    program: String,
    /// Words of its command line, the last ones ROS's.
    args: Vec<String>,
    /// Parameters of the next start.
    extra: Vec<String>,
    running: Option<Running>,
    /// Those that were killed and did not end: they count no more, and may end some time.
    abandoned: Vec<Running>,
    watch: Watch,
    /// How often it was started again.
    epoch: u64,
    /// How often what was ordered has befallen it.
    struck: u64,
    /// Whether it has been struck since its last sign of life.
    by_order: bool,
    lost: bool,
    /// Whether it was lost for want of room.
    no_room: bool,
    /// Whether the mission goes on without it.
    beside: bool,
}

impl Fleet {
    /// No processes yet.
    pub fn new(config: &SupervisionConfig, keeping: Keeping) -> Self {
        Self { members: Vec::new(), config: config.clone(), began: Instant::now(), now_ns: 0, keeping, unkept: false }
    }

    /// The processes that a launcher before has left; those that have ended meanwhile are started again.
    pub fn take_over(config: &SupervisionConfig, keeping: Keeping) -> Result<Self> {
        let mut fleet = Self::new(config, keeping);
        for kept in fleet.keeping.fleet()? {
            let signs = fleet.keeping.signs(&kept.name);
            let running = kept.process.map_or(Ok(None), |process| Running::take_over(process, &signs))?;
            let mut member = fleet.member(&kept.name, &kept.program, &kept.args);
            member.lost = running.is_none();
            if member.lost {
                let _ = member.watch.lost(fleet.began.elapsed());
            }
            let KeptMember { extra, epoch, struck, beside, .. } = kept;
            fleet.members.push(Member { extra, epoch, struck, beside, running, ..member });
        }
        Ok(fleet)
    }

    /// Keeps who flies.
    fn keep(&mut self) -> Result<()> {
        let members: Vec<KeptMember> = self.members.iter().map(Member::kept).collect();
        self.unkept = !self.keeping.keep_fleet(&members)?;
        Ok(())
    }

    /// Starts a program of this suite: the one beside this executable, or else the one on the PATH. The words end with
    /// those of ROS.
    pub fn start(&mut self, name: &str, program: &str, args: &[String]) -> Result<()> {
        let mut member = self.member(name, program, args);
        member.start(&self.config, &self.keeping)?;
        self.members.push(member);
        self.keep()
    }

    /// As [`Self::start`], a process without which the mission goes on, and which gives no sign of life. It is started
    /// again when it is killed.
    pub fn start_beside(&mut self, name: &str, program: &str, args: &[String]) -> Result<()> {
        let mut member = self.member(name, program, args);
        member.beside = true;
        member.start(&self.config, &self.keeping)?;
        self.members.push(member);
        self.keep()
    }

    fn member(&self, name: &str, program: &str, args: &[String]) -> Member {
        Member {
            name: name.to_owned(),
            program: program.to_owned(),
            args: args.to_vec(),
            extra: Vec::new(),
            running: None,
            abandoned: Vec::new(),
            watch: Watch::new(self.config.clone(), self.began.elapsed()),
            epoch: 0,
            struck: 0,
            by_order: false,
            lost: false,
            no_room: false,
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
            if let Some(running) = &member.running {
                running.send(Signal::STOP)?;
            }
        }
        Ok(())
    }

    /// Whether every process that is not given up is there.
    pub fn is_whole(&self) -> bool {
        let there = |member: &Member| member.running.is_some() && !member.lost;
        let waits_for_room = |member: &Member| member.running.is_none() && member.no_room;
        self.members.iter().all(|member| member.watch.given_up() || waits_for_room(member) || there(member))
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
            if let Some(ending) = member.ended()? {
                bail!("{} before the mission was over", ending.of(&member.name));
            }
        }
        Ok(())
    }

    /// Listens to all processes, kills those that hang, starts those that were lost again, and tells of it.
    pub fn supervise(&mut self) -> Result<Vec<Event>> {
        let mut events = Vec::new();
        let before: Vec<_> = self.members.iter().map(Member::marks).collect();
        for member in &mut self.members {
            let now = self.began.elapsed();
            let happened = member.supervise(now, &mut self.now_ns, &self.config, &self.keeping)?;
            events.extend(happened.into_iter().map(|what| Event { node: member.name.clone(), what }));
        }
        if self.unkept || self.members.iter().map(Member::marks).ne(before) {
            self.keep()?;
        }
        Ok(events)
    }

    /// Names and process numbers.
    pub fn processes(&self) -> Vec<NodeProcess> {
        let of = |member: &Member| {
            let running = member.running.as_ref()?;
            Some(NodeProcess { name: member.name.clone(), pid: running.pid() })
        };
        self.members.iter().filter_map(of).collect()
    }

    /// Asks the members of these names to end, in this order, and waits until each has. The first failure is told.
    ///
    /// A node that is killed on the way costs nothing: the mission is over, and what it keeps is kept. The recorder is
    /// no such node, it has a bag to close.
    pub fn stop(&mut self, names: &[&str]) -> Result<()> {
        let mut outcome = Ok(());
        for name in names {
            let Some(at) = self.members.iter().position(|member| member.name == *name) else { continue };
            let stopped = self.members.swap_remove(at).stop();
            outcome = outcome.and(stopped);
        }
        outcome
    }
}

impl Member {
    fn start(&mut self, config: &SupervisionConfig, keeping: &Keeping) -> Result<()> {
        let signs = keeping.make_signs(&self.name)?;
        let mut own = vec![
            format!("epoch:={}", self.epoch),
            format!("orphaned_s:={:?}", config.orphaned_s),
            format!("signs:={}", signs.display()),
        ];
        if self.beside {
            own.clear();
        } else if self.struck > 0 {
            own.push(format!("struck:={}", self.struck));
        }
        let program = program_path(&self.program);
        let mut command = Command::new(&program);
        command.args(&self.args).args(own.iter().flat_map(|it| ["-p", it])).args(&self.extra);
        let failed = || format!("cannot start node {}: {}", self.name, program.display());
        self.running = Some(Running::start(&mut command).with_context(failed)?);
        Ok(())
    }

    fn stop(self) -> Result<()> {
        let (name, records) = (&self.name, self.name == graph::RECORDER);
        let Some(mut running) = self.running else {
            return match (records, self.no_room) {
                (_, true) => Ok(()),
                (true, _) => Err(anyhow!("node {name} was lost and is not there again")),
                (false, _) => {
                    tracing::warn!("node {name} was lost and is not there again: the mission is over");
                    Ok(())
                }
            };
        };
        let ending = running.stop()?;
        let no_room = records && ending.code() == Some(i32::from(NO_ROOM));
        if ending.is_well() || no_room {
            return Ok(());
        }
        if ending.is_killed() && !records {
            tracing::warn!("{}: the mission is over", ending.of(name));
            return Ok(());
        }
        Err(anyhow!("{}", ending.of(name)))
    }

    fn kept(&self) -> KeptMember {
        KeptMember {
            name: self.name.clone(),
            program: self.program.clone(),
            args: self.args.clone(),
            extra: self.extra.clone(),
            epoch: self.epoch,
            struck: self.struck,
            beside: self.beside,
            process: self.running.as_ref().and_then(Running::name),
        }
    }

    /// What changes whenever something has to be kept.
    fn marks(&self) -> (u64, u64, usize, Option<u32>) {
        (self.epoch, self.struck, self.extra.len(), self.running.as_ref().map(Running::pid))
    }

    /// What has become of it since the last call.
    fn supervise(
        &mut self,
        now: Duration,
        now_ns: &mut u64,
        config: &SupervisionConfig,
        keeping: &Keeping,
    ) -> Result<Vec<Happened>> {
        let (first, heard) = self.listen(now, now_ns);
        let mut told: Vec<Happened> = heard.then_some(Happened::Heard).into_iter().collect();
        if first {
            told.extend(self.back());
        }
        if let Some(ending) = self.ended()? {
            told.push(self.over(ending, now, now_ns));
            return Ok(told);
        }
        if self.beside && self.running.is_some() {
            self.watch.sign(now);
            told.extend(self.back());
        }
        match self.watch.step(now) {
            Step::Warn => {
                told.push(Happened::Silent { time: Duration::from_secs_f64(config.warn_s), by_order: self.by_order })
            }
            Step::Kill => {
                tracing::warn!("node {} gives no sign of life and is killed", self.name);
                self.kill()?;
            }
            Step::Abandon => told.push(self.abandon(now, now_ns)),
            Step::Start => {
                self.epoch += 1;
                self.start(config, keeping)?;
                self.watch.started(now);
                tracing::info!("node {} is started again", self.name);
            }
            Step::Nothing | Step::GiveUp => {}
        }
        Ok(told)
    }

    /// It is there; tells of it when it was lost.
    fn back(&mut self) -> Option<Happened> {
        if !std::mem::take(&mut self.lost) {
            return None;
        }
        self.no_room = false;
        Some(Happened::Back { by_order: std::mem::take(&mut self.by_order) })
    }

    /// Its process does not end though it was killed: it is left to itself.
    fn abandon(&mut self, now: Duration, now_ns: &mut u64) -> Happened {
        // Which of them have ended meanwhile is of no account, but that they are waited for.
        self.abandoned.retain_mut(|old| !matches!(old.ended(), Ok(Some(_))));
        self.hear_out(now, now_ns);
        if let Some(mut running) = self.running.take() {
            running.leave();
            self.abandoned.push(running);
        }
        let how = format!("node {} gives no sign of life and does not end though it was killed", self.name);
        self.is_lost(how, now, false)
    }

    /// Its process has ended.
    fn over(&mut self, ending: Ending, now: Duration, now_ns: &mut u64) -> Happened {
        self.hear_out(now, now_ns);
        self.running = None;
        let how = ending.of(&self.name);
        self.no_room = self.name == graph::RECORDER && ending.code() == Some(i32::from(NO_ROOM));
        if self.no_room {
            self.lost = true;
            tracing::warn!("{how}: there is no room for the bag");
            self.watch.wants(now);
            return Happened::NoRoom;
        }
        // One that ends by itself has said why, and would do so again.
        self.is_lost(how, now, self.beside && !ending.is_killed())
    }

    /// It is gone, and is started again unless it leaves for good.
    fn is_lost(&mut self, how: String, now: Duration, leaves: bool) -> Happened {
        self.lost = true;
        let step = if leaves { self.watch.give_up() } else { self.watch.lost(now) };
        tracing::warn!("{how}");
        match step {
            Step::GiveUp => Happened::GivenUp { how },
            _ => Happened::Lost { how, times: self.watch.losses(), by_order: self.by_order },
        }
    }

    /// How its process has ended, if it has.
    fn ended(&mut self) -> Result<Option<Ending>> {
        self.running.as_mut().map_or(Ok(None), Running::ended)
    }

    /// Takes in what it has said; returns whether it gives its first sign of life since its start, and whether one came
    /// after it was warned of.
    fn listen(&mut self, now: Duration, now_ns: &mut u64) -> (bool, bool) {
        let Some(running) = &self.running else { return (false, false) };
        let lines: Vec<String> = running.lines.try_iter().collect();
        let heard: Vec<Heard> = lines.iter().map(|line| self.hear(line, now, now_ns)).collect();
        (heard.contains(&Heard::First), heard.contains(&Heard::AfterWarning))
    }

    fn hear(&mut self, line: &str, now: Duration, now_ns: &mut u64) -> Heard {
        match Sign::parse(line) {
            Some(Sign::Alive(theirs)) => {
                *now_ns = theirs.max(*now_ns);
                self.watch.sign(now)
            }
            Some(Sign::Struck(number)) => {
                self.struck = number + 1;
                self.by_order = true;
                Heard::AsBefore
            }
            None => Heard::AsBefore,
        }
    }

    /// What it has said up to its end.
    fn hear_out(&mut self, now: Duration, now_ns: &mut u64) {
        let Some(running) = self.running.take() else { return };
        let deadline = Instant::now() + LAST_WORDS;
        while let Ok(line) = running.lines.recv_timeout(deadline.saturating_duration_since(Instant::now())) {
            self.hear(&line, now, now_ns);
        }
        self.running = Some(running);
    }

    fn kill(&mut self) -> Result<()> {
        self.running.as_ref().map_or(Ok(()), |running| running.send(Signal::KILL))
    }
}

impl Drop for Fleet {
    fn drop(&mut self) {
        let running = || self.members.iter().filter_map(|member| member.running.as_ref());
        // Nothing more can be done for a process that cannot be ended.
        running().for_each(|running| _ = running.send(Signal::INT));
        for running in self.members.iter_mut().filter_map(|member| member.running.as_mut()) {
            let _ = running.stop();
        }
        let abandoned = self.members.iter_mut().flat_map(|member| &mut member.abandoned);
        abandoned.for_each(|running| _ = (running.send(Signal::KILL), running.ended()));
    }
}

fn program_path(program: &str) -> PathBuf {
    let beside = std::env::current_exe().ok().and_then(|exe| Some(exe.parent()?.join(program)));
    beside.filter(|path| path.is_file()).unwrap_or_else(|| Path::new(program).to_owned())
}
