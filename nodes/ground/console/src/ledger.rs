//! What the ground knows, as a numbered list of facts that only grows: whoever has read up to a number reads on from it.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use serde::Serialize;
use swath_mission::file::Mission;
use swath_msgs::builtin_interfaces::Time;
use swath_msgs::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus};
use swath_msgs::sensor_msgs::{JointState, NavSatFix};
use swath_msgs::swath_msgs as msg;
use swath_node::health::HEALTH;
use swath_node::stamp::nanoseconds;
use swath_ros::graph;

use crate::facts::{self, Fact};
use crate::newest::Newest;
use crate::presence::Presence;
use crate::ticks::{TICK_MS, TickClock, milliseconds};

/// Most facts that are kept: a week of telemetry every ten seconds with 5 000 requests has a tenth of it.
const CAPACITY: usize = 5_000_000;

/// Nodes that are missed only once they have been there: a mission can be flown without.
const BESIDES: [&str; 2] = [graph::LAUNCHER, graph::RECORDER];

/// The facts, each as a line of JSON.
#[derive(Default)]
pub struct Ledger {
    lines: Vec<Arc<str>>,
    /// Time of the newest fact [ms].
    now_ms: f64,
    clock: TickClock,
    /// The last state that was told of each request, with its time.
    told: BTreeMap<u64, (u8, Time)>,
    /// Numbers of alarms by who raises them with their name, and by their text where that tells them apart.
    alarms: BTreeMap<(String, String), u64>,
    acknowledged: BTreeSet<u64>,
    /// Whether the mission keeps its alarms itself; what nodes say on `/diagnostics` are its alarms then.
    kept: bool,
    /// Who put an alarm aside, and why, by its number.
    aside: BTreeMap<u64, (String, String)>,
    /// Until when an alarm was told to be put aside [ms], by its number.
    until: BTreeMap<u64, f64>,
    presence: Presence,
    newest: Newest,
    /// How each request stands.
    requests: BTreeMap<u64, msg::StripStatus>,
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

    /// How each request stands, by number.
    #[must_use]
    pub fn requests(&self) -> &BTreeMap<u64, msg::StripStatus> {
        &self.requests
    }

    /// Length of a tick [s].
    #[must_use]
    pub fn tick_s(&self) -> f64 {
        self.clock.told.map_or(TICK_MS, |(_, length)| length) / 1000.0
    }

    /// Time of tick 0 [ns since 1970-01-01 UTC].
    #[must_use]
    pub fn epoch_ns(&self) -> u64 {
        self.clock.told.map_or(0, |(epoch, _)| (epoch * 1e6) as u64)
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

    /// A request of which only the past is told so far.
    pub fn introduce(&mut self, status: &msg::StripStatus) {
        if !self.told.contains_key(&status.strip.id) {
            self.learn(status.tick, &status.header.stamp);
            self.tell_at(&status.header.stamp, &facts::strip(status));
            self.told.insert(status.strip.id, (u8::MAX, Time::default()));
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
        // A list that was asked for before a change may come after it.
        let newer = |known: &msg::StripStatus| nanoseconds(&known.header.stamp) > nanoseconds(stamp);
        if !self.requests.get(&id).is_some_and(newer) {
            self.requests.insert(id, status.clone());
        }
        match self.told.insert(id, (status.state, *stamp)) {
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

    /// The radio, as the ground knows it; said again, it is told once.
    pub fn link(&mut self, status: &msg::LinkStatus) {
        self.learn(status.tick, &status.header.stamp);
        let fact = self.newest.take_link(status);
        self.tell_news(&status.header.stamp, fact);
    }

    /// What the satellite is going to do, as the ground predicts it; said again, it is told once.
    pub fn plan(&mut self, plan: &msg::PredictedPlan) {
        self.learn(plan.tick, &plan.header.stamp);
        let fact = self.newest.take_plan(plan);
        self.tell_news(&plan.header.stamp, fact);
    }

    /// Power, data and momentum as the simulator has them.
    pub fn resources(&mut self, state: &msg::ResourceState) {
        self.learn(state.tick, &state.header.stamp);
        let fact = self.newest.take_resources(state);
        self.tell_news(&state.header.stamp, fact);
    }

    fn tell_news(&mut self, stamp: &Time, fact: Option<Fact>) {
        if let Some(fact) = fact {
            self.tell_at(stamp, &fact);
        }
    }

    /// What was told last of radio, plan and resources.
    #[must_use]
    pub fn newest(&self) -> &Newest {
        &self.newest
    }

    /// What the mission says of itself that its messages do not.
    pub fn know(&mut self, mission: &Mission) {
        self.newest.know(mission);
    }

    /// Alarms of a mission that nobody keeps. The same one raised again after it was acknowledged stands again.
    pub fn diagnostics(&mut self, array: &DiagnosticArray) {
        if self.kept {
            return;
        }
        for status in array.status.iter().filter(|status| is_alarm(status)) {
            let number = self.number(status.name.clone(), status.message.clone());
            self.acknowledged.remove(&number);
            self.tell_at(&array.header.stamp, &facts::alarm(number, status));
        }
    }

    fn number(&mut self, name: String, text: String) -> u64 {
        let next = self.alarms.len() as u64 + 1;
        *self.alarms.entry((name, text)).or_insert(next)
    }

    /// The alarms that stand, as the mission keeps them: those that were not told of yet, and until when which are put
    /// aside.
    pub fn standing(&mut self, standing: &msg::StandingAlarms) {
        use msg::Alarm;
        self.kept = true;
        self.presence.standing(standing);
        for alarm in &standing.alarms {
            let name = format!("{}: {}", alarm.node, alarm.name);
            let known = self.alarms.contains_key(&(name.clone(), String::new()));
            let number = self.number(name.clone(), String::new());
            if !known {
                let (level, text) = (alarm.severity, alarm.text.clone());
                self.tell_at(&alarm.raised, &Fact::Alarm { alarm: number, name, level, text });
                match if alarm.state == Alarm::STATE_SHELVED { alarm.beneath } else { alarm.state } {
                    Alarm::STATE_ACKNOWLEDGED => self.tell(self.now_ms, &facts::acknowledged(number, "")),
                    Alarm::STATE_RETURNED_UNACKNOWLEDGED => self.tell(self.now_ms, &Fact::Returned { alarm: number }),
                    _ => {}
                }
            }
            let until_ms = milliseconds(&alarm.shelved_until);
            if alarm.state == Alarm::STATE_SHELVED && self.until.insert(number, until_ms) != Some(until_ms) {
                self.tell_aside(number, until_ms);
            }
        }
    }

    fn tell_aside(&mut self, alarm: u64, until_ms: f64) {
        let (actor, reason) = self.aside.get(&alarm).cloned().unwrap_or_default();
        self.tell(self.now_ms, &Fact::Shelved { alarm, until_ms, actor, reason });
    }

    /// What has happened to an alarm that the mission keeps.
    pub fn alarm_event(&mut self, event: &msg::AlarmEvent) {
        use msg::AlarmEvent as Event;
        self.kept = true;
        let name = format!("{}: {}", event.node, event.name);
        let alarm = self.number(name.clone(), String::new());
        let (actor, text) = (event.actor.clone(), event.text.clone());
        let fact = match event.event {
            Event::EVENT_RAISED => Fact::Alarm { alarm, name, level: event.severity, text },
            Event::EVENT_RETURNED => Fact::Returned { alarm },
            Event::EVENT_ACKNOWLEDGED => facts::acknowledged(alarm, &actor),
            Event::EVENT_SHELVED => {
                self.aside.insert(alarm, (actor, text));
                // Until when is told by the alarms that stand, before or after this.
                if let Some(until_ms) = self.until.get(&alarm).copied() {
                    self.tell_aside(alarm, until_ms);
                }
                return;
            }
            Event::EVENT_UNSHELVED => {
                self.until.remove(&alarm);
                Fact::Shelved { alarm, until_ms: 0.0, actor, reason: text }
            }
            _ => return,
        };
        self.tell_at(&event.header.stamp, &fact);
    }

    /// Node and name of an alarm that the mission keeps, by its number here.
    #[must_use]
    pub fn kept_alarm(&self, alarm: u64) -> Option<(String, String)> {
        let (name, _) = self.alarms.iter().find(|(_, number)| **number == alarm)?.0;
        let (node, name) = name.split_once(": ")?;
        self.kept.then(|| (node.to_owned(), name.to_owned()))
    }

    /// An operator has seen an alarm; whether it stood.
    pub fn acknowledge(&mut self, alarm: u64, actor: &str) -> bool {
        let known = self.alarms.values().any(|number| *number == alarm);
        if !known || !self.acknowledged.insert(alarm) {
            return false;
        }
        self.tell(self.now_ms, &facts::acknowledged(alarm, actor));
        true
    }

    /// An operator puts an alarm aside for some minutes of simulated time; whether there is such an alarm.
    pub fn shelve(&mut self, alarm: u64, minutes: u32, actor: &str, reason: &str) -> bool {
        if !self.alarms.values().any(|number| *number == alarm) {
            return false;
        }
        let until_ms = self.now_ms + f64::from(minutes) * 60_000.0;
        self.tell(self.now_ms, &Fact::Shelved { alarm, until_ms, actor: actor.to_owned(), reason: reason.to_owned() });
        true
    }

    /// Which nodes are there, of those that must be and those that come besides, and how often each was started anew.
    pub fn nodes(&mut self, present: &BTreeSet<String>, epochs: BTreeMap<String, u64>) {
        if let Some(nodes) = self.presence.look(present, &graph::FLIGHT_NODES, &BESIDES, epochs) {
            self.tell(self.now_ms, &nodes);
        }
    }
}

/// Whether something is wrong of which an operator has to know: what a node says of its health is no alarm.
fn is_alarm(status: &DiagnosticStatus) -> bool {
    let name = status.name.rsplit_once(": ").map(|(_, name)| name);
    status.level != DiagnosticStatus::OK && name != Some(HEALTH)
}
