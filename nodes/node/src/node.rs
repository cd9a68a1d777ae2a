//! What every node of a mission starts with: its ROS node, its mission, its alarms.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context, Result, bail};
use swath_msgs::builtin_interfaces::Time;
use swath_msgs::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus};
use swath_ros::{Node, Publisher, RosArgs, Shutdown, Spec, graph};
use swath_sim::model::Model;
use swath_sim::time::Tick;

use crate::error::MessageError;
use crate::out;
use crate::program::{MISSION, Program};
use crate::stamp::Stamper;
use swath_mission::alarms;
use swath_mission::alarms::conditions::Report;
use swath_mission::alarms::definitions::definition;
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
    diagnostics: Publisher<DiagnosticArray>,
}

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
        if mission.link.is_some() {
            bail!("a mission with [link] flies in one process only: swath launch {} --in-process", path.display());
        }
        let model = Arc::new(mission.model()?);
        let diagnostics = node.publisher(&graph::DIAGNOSTICS)?;
        Ok(Self {
            shutdown,
            horizon: mission.horizon(&model),
            stamper: Stamper::new(mission.epoch_unix_s, model.period).in_namespace(node.names().namespace()),
            model,
            mission,
            diagnostics,
            node,
        })
    }

    /// Waits for news, and tells whether there are any; what went wrong with the messages of others is an alarm.
    ///
    /// # Errors
    /// When the node may not go on, or an alarm cannot be sent.
    pub fn wait(&self, timeout: Duration) -> Result<bool> {
        for notice in self.node.notices() {
            self.alarm(Severity::Warn, notice.trouble.name(), &notice.to_string())?;
        }
        Ok(self.node.wait(timeout)?)
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
        let Report { tick, key, wrong, text } = report;
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
        let status = DiagnosticStatus {
            level,
            name: format!("{}: {name}", self.node.names().fully_qualified()),
            message: text.to_owned(),
            hardware_id: "swath".to_owned(),
            ..DiagnosticStatus::default()
        };
        let mut array = DiagnosticArray::default();
        array.header.stamp = stamp;
        array.status.push(status);
        self.diagnostics.publish(&array).context("cannot raise an alarm")
    }
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
