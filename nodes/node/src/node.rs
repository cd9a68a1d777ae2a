//! What every node of a mission starts with: its ROS node, its mission, its alarms.

use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::path::PathBuf;
use std::process::ExitCode;
use std::rc::Rc;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use swath_msgs::builtin_interfaces::Time;
use swath_msgs::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus};
use swath_ros::{Dropping, Managed, Node, Publisher, RosArgs, RosError, Shutdown, Spec, graph};
use swath_sim::time::Tick;
use swath_sim::vehicle::faults::FOR_GOOD;
use swath_sim::vehicle::model::Model;

use crate::error::MessageError;
use crate::health::{HEALTH, Health, Known};
use crate::orders_heard::FaultOrders;
use crate::out;
use crate::program::{AUTOSTART, MISSION, Program, RECORDED};
use crate::stamp::Stamper;
use swath_mission::alarms;
use swath_mission::alarms::conditions::Report;
use swath_mission::alarms::definitions::definition;
use swath_mission::faults::grammar::{Failure, Process};
use swath_mission::faults::plan::Scheduled;
use swath_mission::file::Mission;

/// A started node and the mission that it flies.
pub struct MissionNode {
    /// The ROS node.
    pub node: Node,
    /// Ctrl-C and SIGTERM.
    pub shutdown: Shutdown,
    /// The mission.
    pub mission: Mission,
    /// Its constants.
    pub model: Arc<Model>,
    /// Tick at which it ends.
    pub horizon: Tick,
    /// Stamps of its ticks.
    pub stamper: Stamper,
    /// Where it stands in its life.
    pub lifecycle: Rc<Managed>,
    /// Whether it is configured and activated by itself.
    pub autostart: bool,
    /// Whether it was configured before in this process.
    again: Cell<bool>,
    diagnostics: Publisher<DiagnosticArray>,
    health: Mutex<Health>,
    /// Who is missing, as it was told last; nothing once everybody was there.
    missing: RefCell<Option<Vec<String>>>,
    /// What was told of alarms, for another launcher, and to how many that was told.
    told: RefCell<VecDeque<DiagnosticArray>>,
    told_to: Cell<u64>,
    keep: Option<PathBuf>,
    /// What is ordered to befall this node, the next first, and how often something has already.
    ordered: VecDeque<(Scheduled, Failure)>,
    struck: u64,
    /// Whether the mission is recorded.
    recorded: bool,
    /// As which it can be made to fail.
    process: Option<Process>,
    pub(crate) fault_orders: FaultOrders,
}

/// So much of what was told of alarms is told again to a launcher that takes over.
const TOLD: usize = 1000;

/// How long the last messages before a fault by order may take to arrive.
const FLUSH_TIMEOUT: Duration = Duration::from_secs(5);

/// How long a node that was started again waits for the recorder: that may have been lost too.
const RECORDER_TIMEOUT: Duration = Duration::from_secs(3);

/// How grave an alarm is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    /// Worth knowing.
    Warn,
    /// Something did not work.
    Error,
}

impl MissionNode {
    /// Starts a node with the mission that its parameter `mission` names.
    ///
    /// # Errors
    /// When the command line or the mission is not valid, or the node cannot come up.
    pub fn start(program: &Program) -> Result<Self> {
        let (own, args) = RosArgs::split(std::env::args())?;
        program.parse(own);
        Self::start_with(program.node, &args)
    }

    fn start_with(name: &'static str, args: &RosArgs) -> Result<Self> {
        let node = Node::start(name, args)?;
        let shutdown = Shutdown::on_signals(node.signal())?;
        let spec = Spec::new(MISSION.name, String::new(), MISSION.about).read_only();
        let path = PathBuf::from(node.parameters().declare(spec)?);
        if path.as_os_str().is_empty() {
            bail!("parameter `mission` is not set: give --ros-args -p mission:=FILE");
        }
        let mission = Mission::read(&path)?;
        let model = Arc::new(mission.model()?);
        let autostart = Spec::new(AUTOSTART.name, true, AUTOSTART.about).read_only();
        let autostart = node.parameters().declare(autostart)?;
        let lifecycle = Rc::new(node.managed()?);
        let keep =
            Spec::new("keep", String::new(), "Folder for what the node needs to go on when it is started again.");
        let keep = PathBuf::from(node.parameters().declare(keep.read_only())?);
        let struck = Spec::new("struck", 0_i64, "Faults ordered for this node that have befallen it already.");
        let struck = node.parameters().declare(struck.in_range(0.0..=1e6).read_only())?.unsigned_abs();
        let recorded = node.parameters().declare(Spec::new(RECORDED.name, false, RECORDED.about).read_only())?;
        let diagnostics = node.publisher(&graph::DIAGNOSTICS)?;
        let fault_orders = FaultOrders::new(&node, name, mission.tells_truth_apart(model.period))?;
        let health = Mutex::new(Health::new(Instant::now(), tick_of(&mission, &model)));
        let mut base = Self {
            shutdown,
            horizon: mission.horizon(&model),
            stamper: Stamper::new(mission.epoch_unix_s, model.period).in_namespace(node.names().namespace()),
            model,
            mission,
            lifecycle,
            autostart,
            again: Cell::new(false),
            diagnostics,
            health,
            missing: RefCell::new(Some(Vec::new())),
            told: RefCell::default(),
            told_to: Cell::new(0),
            keep: (!keep.as_os_str().is_empty()).then_some(keep),
            ordered: VecDeque::new(),
            struck,
            recorded,
            process: Process::ALL.into_iter().find(|process| process.name() == name),
            fault_orders,
            node,
        };
        base.mind_own_faults();
        base.take_up_fault_orders()?;
        Ok(base)
    }

    /// What is ordered to befall this node follows from the mission anew.
    pub(crate) fn mind_own_faults(&mut self) {
        let ordered = self.process.map(|process| self.mission.faults.of(process, self.model.period));
        self.ordered = ordered.unwrap_or_default().into_iter().skip(self.struck as usize).collect();
        let end_ns = |tick: Tick| if tick == FOR_GOOD { u64::MAX } else { self.stamper.nanoseconds(tick) };
        let dropping = |(it, share): (Scheduled, f64)| Dropping {
            from_ns: self.stamper.nanoseconds(it.from),
            until_ns: end_ns(it.until),
            share,
        };
        let drops = self.mission.faults.drops(self.model.period);
        self.node.set_drops(self.mission.seed, drops.into_iter().map(dropping).collect());
    }

    /// A node that was started again in a recorded mission says nothing before the recorder hears it; it waits for it at
    /// most [`RECORDER_TIMEOUT`].
    ///
    /// # Errors
    /// When the node may not go on.
    pub(crate) fn wait_for_recorder(&self) -> Result<()> {
        // A sign of life: from now on it is missed when there is none.
        self.node.check()?;
        if self.node.epoch() == 0 || !self.recorded {
            return Ok(());
        }
        match self.node.wait_for_peers(&[graph::RECORDER], RECORDER_TIMEOUT) {
            Err(RosError::MissingPeers { .. }) => {
                tracing::warn!("goes on although the recorder does not hear it");
                Ok(())
            }
            outcome => Ok(outcome?),
        }
    }

    /// A file in which this node keeps what it needs to go on when it is started again; nothing where nobody would.
    #[must_use]
    pub fn keeps(&self, name: &str) -> Option<PathBuf> {
        self.keep.as_ref().map(|folder| folder.join(name))
    }

    /// Whether there is a place for what it needs to go on.
    #[must_use]
    pub fn keeps_something(&self) -> bool {
        self.keep.is_some()
    }

    /// From now on this node goes on where it was when it is configured again.
    pub fn goes_on_from_here(&self) {
        self.again.set(true);
    }

    /// Whether this node goes on where it was before, in this process or in one before it.
    #[must_use]
    pub fn goes_on(&self) -> bool {
        self.node.epoch() > 0 || self.again.get()
    }

    /// What this node kept in a file before it was started again; nothing if this is its first start.
    ///
    /// # Errors
    /// When the file is there and cannot be read.
    pub fn kept(&self, name: &str) -> Result<Option<String>> {
        let Some(path) = self.keeps(name).filter(|path| self.goes_on() && path.exists()) else {
            return Ok(None);
        };
        std::fs::read_to_string(&path).map(Some).with_context(|| format!("cannot read {}", path.display()))
    }

    /// Tick at which the next fault that was ordered for this node befalls it.
    #[must_use]
    pub fn strikes_at(&self) -> Option<Tick> {
        self.ordered.front().map(|(it, _)| it.from)
    }

    /// The fault that was ordered for this node befalls it now, once what it has sent has arrived.
    pub fn strike(&self) -> ! {
        // Told first: whoever does not acknowledge must not have it befall the next one again.
        self.node.tell_struck(self.struck);
        let _ = self.node.flush(FLUSH_TIMEOUT);
        match self.ordered.front() {
            Some((_, Failure::Hang)) => loop {
                std::thread::sleep(Duration::from_secs(3600));
            },
            _ => std::process::abort(),
        }
    }

    /// The fault that befell this node last, if it was started again because of one.
    #[must_use]
    pub fn struck(&self) -> Option<Scheduled> {
        if self.again.get() {
            return None;
        }
        let last = usize::try_from(self.struck.checked_sub(1)?).ok()?;
        self.mission.faults.of(self.process?, self.model.period).get(last).map(|(it, _)| *it)
    }

    /// Waits for news, and tells whether there are any; what went wrong with the messages of others is an alarm.
    ///
    /// # Errors
    /// When the node may not go on, or an alarm cannot be sent.
    pub fn wait(&self, timeout: Duration) -> Result<bool> {
        self.tell_of_itself()?;
        Ok(self.node.wait(timeout)?)
    }

    /// Tells what is due of its health and of the messages of others; for those who wait in another way.
    ///
    /// # Errors
    /// When it cannot be sent.
    pub fn tell_of_itself(&self) -> Result<()> {
        if self.told_to.replace(self.node.taken_over()) != self.node.taken_over() {
            self.told.borrow().iter().try_for_each(|array| self.diagnostics.publish(array))?;
        }
        for notice in self.node.notices() {
            self.alarm(Severity::Warn, notice.trouble.name(), &notice.to_string())?;
            self.health().count_more(notice.trouble.name(), notice.count);
        }
        self.tell_health()
    }

    /// Something that this node's health tells of went wrong so often since it was started.
    pub fn count(&self, what: &'static str, total: u64) {
        self.health().count(what, total);
    }

    fn health(&self) -> MutexGuard<'_, Health> {
        self.health.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Says for whom this node waits, when that has changed, until everybody was there once.
    pub fn tell_missing(&self, missing: Vec<String>) {
        let mut told = self.missing.borrow_mut();
        let Some(before) = told.as_mut() else { return };
        if missing.is_empty() {
            *told = None;
        } else if *before != missing {
            tracing::info!("waits: {}", missing.join(", "));
            *before = missing;
        }
    }

    /// The other nodes that fly, as far as this one sees them. Time's own node knows best for whom it waits.
    fn look_around(&self) {
        let name = self.node.names().name();
        if name != graph::SPACECRAFT && self.missing.borrow().is_some() {
            let others: Vec<&str> = graph::FLIGHT_NODES.into_iter().filter(|it| *it != name).collect();
            self.tell_missing(self.node.missing_peers(&others));
        }
    }

    fn tell_health(&self) -> Result<()> {
        let mut health = self.health();
        let now = Instant::now();
        if !health.turn(now) {
            return Ok(());
        }
        self.look_around();
        let node = &self.node;
        let known = Known {
            now_ns: node.clock().now_ns(),
            state: self.lifecycle.state(),
            restarts: node.epoch(),
            orphaned: node.orphaned(),
            inputs: node.inputs(),
        };
        self.publish(node.clock().stamp(), HEALTH, health.tell(now, &known))
    }

    /// A tick of this mission.
    ///
    /// # Errors
    /// When it lies after the mission's end.
    pub fn tick(&self, tick: u64) -> Result<Tick, MessageError> {
        if tick > self.horizon.0 {
            return Err(MessageError::Tick { tick, end: self.horizon.0 });
        }
        Ok(Tick(tick))
    }

    /// Sets this node's idea of simulated time.
    pub fn set_now(&self, now: Tick) {
        self.node.clock().set_ns(self.stamper.nanoseconds(now));
    }

    /// Raises an alarm: on `/diagnostics`, and as a log line.
    ///
    /// # Errors
    /// When it cannot be sent.
    pub fn alarm(&self, severity: Severity, name: &str, text: &str) -> Result<()> {
        let level = match severity {
            Severity::Warn => {
                tracing::warn!("{name}: {text}");
                DiagnosticStatus::WARN
            }
            Severity::Error => {
                tracing::error!("{name}: {text}");
                DiagnosticStatus::ERROR
            }
        };
        self.diagnose(self.node.clock().stamp(), level, name, text)
    }

    /// Tells whether something that lasts is wrong: on `/diagnostics`, and as a log line.
    ///
    /// # Errors
    /// When it cannot be sent.
    pub fn condition(&self, report: &Report) -> Result<()> {
        let Report { tick, key, wrong, text, .. } = report;
        let level = match (wrong, definition(&key.name).map(|it| it.severity)) {
            (false, _) => DiagnosticStatus::OK,
            (true, Some(alarms::Severity::Warn)) => DiagnosticStatus::WARN,
            (true, _) => DiagnosticStatus::ERROR,
        };
        if *wrong {
            tracing::warn!("{}: {text}", key.name);
        } else {
            tracing::debug!("{}: {text}", key.name);
        }
        self.diagnose(self.stamper.time(*tick), level, &key.name, text)
    }

    fn diagnose(&self, stamp: Time, level: u8, name: &str, text: &str) -> Result<()> {
        self.publish(stamp, name, DiagnosticStatus { level, message: text.to_owned(), ..DiagnosticStatus::default() })
    }

    fn publish(&self, stamp: Time, name: &str, status: DiagnosticStatus) -> Result<()> {
        let status = DiagnosticStatus {
            name: format!("{}: {name}", self.node.names().fully_qualified()),
            hardware_id: "swath".to_owned(),
            ..status
        };
        let mut array = DiagnosticArray::default();
        array.header.stamp = stamp;
        let is_alarm = name != HEALTH;
        array.status.push(status);
        self.diagnostics.publish(&array).context("cannot raise an alarm")?;
        if is_alarm {
            let mut told = self.told.borrow_mut();
            if told.len() == TOLD {
                told.pop_front();
            }
            told.push_back(array);
        }
        Ok(())
    }
}

/// How long a tick takes at the mission's pace; nothing in lockstep.
fn tick_of(mission: &Mission, model: &Model) -> Duration {
    let seconds = if mission.pace > 0.0 { model.period.seconds() / mission.pace } else { 0.0 };
    Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX)
}

/// Turns the outcome of a node into an exit code; an error is told once, in the log as soon as there is one.
#[must_use]
pub fn exit_code(outcome: Result<()>) -> ExitCode {
    let Err(error) = outcome else { return ExitCode::SUCCESS };
    if tracing::dispatcher::has_been_set() {
        tracing::error!("{}", out::chain(&error));
    } else {
        out::say(format_args!("error: {}", out::chain(&error)));
    }
    ExitCode::FAILURE
}
