//! What the ground knows, as a numbered list of facts that only grows: whoever has read up to a number reads on from it.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use serde::Serialize;
use swath_msgs::builtin_interfaces::Time;
use swath_msgs::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus};
use swath_msgs::sensor_msgs::{JointState, NavSatFix};
use swath_msgs::swath_msgs as msg;

use crate::facts::{self, Fact, milliseconds};

/// Most facts that are kept: a week of telemetry every ten seconds with 5 000 requests has a tenth of it.
const CAPACITY: usize = 5_000_000;

/// The facts, each as a line of JSON.
pub struct Ledger {
    lines: Vec<Arc<str>>,
    /// Time of the newest fact [ms].
    now_ms: f64,
    clock: TickClock,
    /// The last state that was told of each request, with its time.
    told: BTreeMap<u64, (u8, Time)>,
    alarms: BTreeMap<(String, String), u64>,
    acknowledged: BTreeSet<u64>,
    present: Option<BTreeSet<String>>,
    tasks: u64,
    results: u64,
    offers: u64,
}

#[derive(Serialize)]
struct Line<'a> {
    n: usize,
    t: f64,
    #[serde(flatten)]
    fact: &'a Fact,
}

/// Learns what a tick is from messages that say both tick and time.
#[derive(Default)]
struct TickClock {
    first: Option<(u64, f64)>,
    told: Option<(f64, f64)>,
}

/// Length of a tick until two messages have told it [ms]: that of the default control frequency.
const TICK_MS: f64 = 500.0;

impl TickClock {
    /// Epoch and length of a tick [ms], if they have changed.
    fn learn(&mut self, tick: u64, t: f64) -> Option<(f64, f64)> {
        let (first, at) = *self.first.get_or_insert((tick, t));
        let tick_ms = match (self.told, tick > first) {
            (_, true) => (t - at) / (tick - first) as f64,
            (Some((_, known)), false) => known,
            (None, false) => TICK_MS,
        };
        let learnt = (at - first as f64 * tick_ms, tick_ms);
        let same = |(epoch, length): (f64, f64)| (epoch - learnt.0).abs() < 1.0 && (length - tick_ms).abs() < 1e-6;
        if self.told.is_some_and(same) {
            return None;
        }
        self.told = Some(learnt);
        Some(learnt)
    }
}

impl Default for Ledger {
    fn default() -> Self {
        Self {
            lines: Vec::new(),
            now_ms: 0.0,
            clock: TickClock::default(),
            told: BTreeMap::new(),
            alarms: BTreeMap::new(),
            acknowledged: BTreeSet::new(),
            present: None,
            tasks: 0,
            results: 0,
            offers: 0,
        }
    }
}

impl Ledger {
    /// Number of the newest fact, 0 while there is none.
    #[must_use]
    pub fn last(&self) -> usize {
        self.lines.len()
    }

    /// Time of the newest fact [ms since 1970-01-01 UTC].
    #[must_use]
    pub fn now_ms(&self) -> f64 {
        self.now_ms
    }

    /// Up to `limit` facts with greater numbers than `after`, as JSON, in order.
    #[must_use]
    pub fn after(&self, after: usize, limit: usize) -> &[Arc<str>] {
        let from = after.min(self.lines.len());
        &self.lines[from..(from + limit).min(self.lines.len())]
    }

    fn tell(&mut self, t: f64, fact: &Fact) {
        if self.lines.len() >= CAPACITY {
            return;
        }
        self.now_ms = self.now_ms.max(t);
        // Maps with keys of other types than text cannot occur: a fact always has a form in JSON.
        if let Ok(line) = serde_json::to_string(&Line { n: self.lines.len() + 1, t, fact }) {
            self.lines.push(line.into());
        }
    }

    fn tell_at(&mut self, stamp: &Time, fact: &Fact) {
        self.tell(milliseconds(stamp), fact);
    }

    fn learn(&mut self, tick: u64, stamp: &Time) {
        let t = milliseconds(stamp);
        if t > 0.0
            && let Some((epoch_ms, tick_ms)) = self.clock.learn(tick, t)
        {
            self.tell(t, &Fact::Clock { epoch_ms, tick_ms });
        }
    }

    /// A request has changed, or is read from a list of all.
    pub fn strip(&mut self, status: &msg::StripStatus) {
        let (id, stamp) = (status.strip.id, &status.header.stamp);
        self.learn(status.tick, stamp);
        if id == 0 {
            self.tell_at(stamp, &facts::refused(status));
            return;
        }
        match self.told.insert(id, (status.state, stamp.clone())) {
            None => self.tell_at(stamp, &facts::strip(status)),
            // A list that was asked for while the change was under way.
            Some((state, at)) if state == status.state && at == *stamp => return,
            Some(_) => {}
        }
        self.tell_at(stamp, &facts::change(status));
    }

    /// A change of the past; its request must be known, and tells of its own state afterwards.
    pub fn history(&mut self, entry: &msg::HistoryEntry) {
        if entry.strip_id == 0 {
            let (name, reason) = (entry.name.clone(), entry.reason.clone());
            let submitter = entry.actor.clone();
            self.tell_at(&entry.stamp, &Fact::Refused { name, submitter, reason_code: entry.reason_code, reason });
            return;
        }
        let change = Fact::Change {
            strip: entry.strip_id,
            state: entry.state,
            reason_code: entry.reason_code,
            reason: entry.reason.clone(),
            actor: entry.actor.clone(),
            attempts: 0,
            reward: 0.0,
            open_ms: 0.0,
            close_ms: 0.0,
            imaging_ms: 0.0,
            superseded_by: 0,
        };
        self.tell_at(&entry.stamp, &change);
    }

    /// The point below the satellite.
    pub fn point(&mut self, fix: &NavSatFix) {
        if [fix.longitude, fix.latitude, fix.altitude].iter().all(|value| value.is_finite()) {
            self.tell_at(&fix.header.stamp, &facts::point(fix));
        }
    }

    /// What guidance is doing.
    pub fn guidance(&mut self, status: &msg::GuidanceStatus) {
        self.learn(status.tick, &status.header.stamp);
        self.tell_at(&status.header.stamp, &facts::status(status));
    }

    /// The wheels.
    pub fn wheels(&mut self, joints: &JointState) {
        self.tell_at(&joints.header.stamp, &facts::wheels(joints));
    }

    /// A task was chosen; said again, it is told once.
    pub fn task(&mut self, task: &msg::ImagingTask) {
        if task.task >= self.tasks {
            self.tasks = task.task + 1;
            self.tell_at(&task.header.stamp, &facts::task(task));
        }
    }

    /// A task has ended; said again, it is told once.
    pub fn result(&mut self, result: &msg::TaskResult) {
        if result.task >= self.results {
            self.results = result.task + 1;
            let t = self.time_of(result.end_tick);
            self.tell(t, &facts::result(result));
        }
    }

    fn time_of(&self, tick: u64) -> f64 {
        self.clock.told.map_or(self.now_ms, |(epoch, length)| epoch + tick as f64 * length)
    }

    /// What the planner may choose among; said again, it is told once.
    pub fn offer(&mut self, offer: &msg::UpcomingStrips) {
        if offer.task >= self.offers {
            self.offers = offer.task + 1;
            self.learn(offer.tick, &offer.header.stamp);
            self.tell_at(&offer.header.stamp, &facts::offer(offer));
        }
    }

    /// How the planner chose.
    pub fn choice(&mut self, decision: &msg::Decision) {
        self.tell_at(&decision.header.stamp, &facts::choice(decision));
    }

    /// What the planner may do, and what it proposes.
    pub fn planner(&mut self, status: &msg::PlannerStatus) {
        self.tell_at(&status.header.stamp, &facts::planner(status));
    }

    /// How many requests are in which state.
    pub fn summary(&mut self, summary: &msg::RequestSummary) {
        self.learn(summary.tick, &summary.header.stamp);
        self.tell_at(&summary.header.stamp, &facts::summary(summary));
    }

    /// Alarms. The same one raised again after it was acknowledged stands again.
    pub fn diagnostics(&mut self, array: &DiagnosticArray) {
        for status in array.status.iter().filter(|status| status.level != DiagnosticStatus::OK) {
            let next = self.alarms.len() as u64 + 1;
            let key = (status.name.clone(), status.message.clone());
            let number = *self.alarms.entry(key).or_insert(next);
            self.acknowledged.remove(&number);
            self.tell_at(&array.header.stamp, &facts::alarm(number, status));
        }
    }

    /// An operator has seen an alarm; whether it stood.
    pub fn acknowledge(&mut self, alarm: u64) -> bool {
        let known = self.alarms.values().any(|number| *number == alarm);
        if !known || !self.acknowledged.insert(alarm) {
            return false;
        }
        self.tell(self.now_ms, &Fact::Acknowledged { alarm });
        true
    }

    /// The nodes that are there, of those that should be; told when it changes.
    pub fn nodes(&mut self, present: BTreeSet<String>, expected: &[&str]) {
        let here: BTreeSet<_> = present.into_iter().filter(|name| expected.contains(&name.as_str())).collect();
        if self.present.as_ref() == Some(&here) {
            return;
        }
        let missing = expected.iter().filter(|name| !here.contains(**name)).map(|name| (*name).to_owned()).collect();
        self.tell(self.now_ms, &Fact::Nodes { present: here.iter().cloned().collect(), missing });
        self.present = Some(here);
    }
}
