//! How a recorder is controlled and how it tells of itself: services and `/diagnostics`.

use std::time::{Duration, Instant};

use swath_msgs::builtin_interfaces::Time;
use swath_msgs::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus, KeyValue};
use swath_msgs::rosbag2_interfaces::{
    IsPaused, IsPausedResponse, Pause, Resume, Snapshot, SnapshotResponse, SplitBagfile, Stop, TogglePaused,
};
use swath_msgs::std_msgs::Header;
use swath_ros::lifecycle::State;
use swath_ros::{Managed, Node, Publisher, RosError, Server, graph};

use crate::error::{Result, chain};
use crate::writer::{BagSummary, BagWriter};

/// How often diagnostics are sent while nothing changes [wall time].
const REPORT_EVERY: Duration = Duration::from_secs(5);

/// What callers of the services want.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Wishes {
    pub paused: bool,
    pub split: bool,
    pub snapshot: bool,
    pub stop: bool,
}

/// The services that `ros2 bag record` has, and the diagnostics.
pub(super) struct Control {
    pause: Server<Pause>,
    resume: Server<Resume>,
    toggle: Server<TogglePaused>,
    is_paused: Server<IsPaused>,
    split: Server<SplitBagfile>,
    snapshot: Server<Snapshot>,
    stop: Server<Stop>,
    diagnostics: Publisher<DiagnosticArray>,
    name: String,
    reported: Option<(Instant, u64)>,
    lifecycle: Managed,
    /// Asked for by service.
    paused: bool,
}

impl Control {
    /// A recorder that is active; `paused` is whether it waits for `~/resume` nevertheless.
    pub(super) fn new(node: &Node, paused: bool) -> Result<Self, RosError> {
        let lifecycle = node.managed()?;
        for label in ["configure", "activate"] {
            lifecycle.take(label, |_| true)?;
        }
        Ok(Self {
            pause: node.server(&graph::Service::new("~/pause", &[], &[]))?,
            resume: node.server(&graph::Service::new("~/resume", &[], &[]))?,
            toggle: node.server(&graph::Service::new("~/toggle_paused", &[], &[]))?,
            is_paused: node.server(&graph::Service::new("~/is_paused", &[], &[]))?,
            split: node.server(&graph::Service::new("~/split_bagfile", &[], &[]))?,
            snapshot: node.server(&graph::Service::new("~/snapshot", &[], &[]))?,
            stop: node.server(&graph::Service::new("~/stop", &[], &[]))?,
            diagnostics: node.publisher(&graph::DIAGNOSTICS)?,
            name: node.names().fully_qualified(),
            reported: None,
            lifecycle,
            paused,
        })
    }

    /// Answers the calls that have come.
    pub(super) fn wishes(&mut self) -> Result<Wishes, RosError> {
        self.lifecycle.serve(|transition| {
            // A bag that is closed is whole: what comes later belongs into another one.
            let possible = transition.goal != State::CleaningUp;
            if !possible {
                tracing::warn!("{} is refused: a recorder writes one bag", transition.label);
            }
            possible
        })?;
        let state = self.lifecycle.state();
        self.paused |= self.pause.answer_all(|_| Default::default())? > 0;
        self.paused &= self.resume.answer_all(|_| Default::default())? == 0;
        self.paused ^= self.toggle.answer_all(|_| Default::default())? % 2 == 1;
        let paused = self.paused || state != State::Active;
        let mut wishes = Wishes { paused, ..Wishes::default() };
        self.is_paused.answer_all(|_| IsPausedResponse { paused })?;
        wishes.split = self.split.answer_all(|_| Default::default())? > 0;
        wishes.snapshot = self.snapshot.answer_all(|_| SnapshotResponse { success: true })? > 0;
        wishes.stop = self.stop.answer_all(|_| Default::default())? > 0 || state == State::Finalized;
        Ok(wishes)
    }

    /// Sends diagnostics when something was lost, and every few seconds.
    pub(super) fn report(&mut self, writer: &BagWriter, topics: usize, stamp: Time) -> Result<(), RosError> {
        let lost = writer.lost();
        let due = |(at, known): (Instant, u64)| at.elapsed() >= REPORT_EVERY || known != lost;
        if !self.reported.is_none_or(due) {
            return Ok(());
        }
        self.reported = Some((Instant::now(), lost));
        let (level, text) = match (writer.has_stopped(), lost) {
            (true, _) => (DiagnosticStatus::ERROR, "storing has failed".to_owned()),
            (false, 0) => (DiagnosticStatus::OK, "recording".to_owned()),
            (false, lost) => (DiagnosticStatus::WARN, format!("{lost} messages lost")),
        };
        let values = [("bag", writer.dir().display().to_string()), ("topics", topics.to_string())];
        self.send(level, text, &values, stamp)
    }

    /// Sends the last diagnostics: how the bag was closed.
    pub(super) fn report_end(&self, summary: &Result<BagSummary>, stamp: Time) {
        let (level, text) = match summary {
            Ok(summary) if summary.lost > 0 => {
                (DiagnosticStatus::WARN, format!("closed, {} messages lost", summary.lost))
            }
            Ok(_) => (DiagnosticStatus::OK, "closed".to_owned()),
            Err(error) => (DiagnosticStatus::ERROR, chain(error)),
        };
        if let Err(error) = self.send(level, text, &[], stamp) {
            tracing::warn!("no last diagnostics: {error}");
        }
        if !self.diagnostics.flush(Duration::from_millis(500)) {
            tracing::debug!("not every reader has the last diagnostics");
        }
        if level != DiagnosticStatus::OK {
            // A reader may drop what it has not taken yet when the writer leaves.
            std::thread::sleep(Duration::from_millis(500));
        }
    }

    fn send(&self, level: u8, message: String, values: &[(&str, String)], stamp: Time) -> Result<(), RosError> {
        let pair = |(key, value): &(&str, String)| KeyValue { key: (*key).to_owned(), value: value.clone() };
        let status = DiagnosticStatus {
            level,
            name: format!("{}: bag", self.name),
            message,
            hardware_id: String::new(),
            values: values.iter().map(pair).collect(),
        };
        let header = Header { stamp, frame_id: String::new() };
        self.diagnostics.publish(&DiagnosticArray { header, status: vec![status] })
    }
}
