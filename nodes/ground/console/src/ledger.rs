//! What the ground knows, as a numbered list of facts that only grows: whoever has read up to a number reads on from it.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use serde::Serialize;
use swath_msgs::builtin_interfaces::Time;
use swath_msgs::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus};
use swath_msgs::sensor_msgs::{JointState, NavSatFix};
use swath_msgs::swath_msgs as msg;
use swath_node::health::HEALTH;
use swath_node::stamp::nanoseconds;
use swath_ros::graph;

use crate::facts::{self, Fact, milliseconds};
use crate::presence::Presence;

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

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;

    const EPOCH_S: i32 = 1_767_225_600;

    fn at(seconds: i32) -> Time {
        Time { sec: EPOCH_S + seconds, nanosec: 0 }
    }

    fn ms(seconds: i32) -> f64 {
        f64::from(EPOCH_S + seconds) * 1000.0
    }

    fn status(id: u64, state: u8, seconds: i32, tick: u64) -> msg::StripStatus {
        let mut status = msg::StripStatus { state, tick, ..Default::default() };
        status.header.stamp = at(seconds);
        status.strip.id = id;
        status
    }

    fn told(ledger: &Ledger) -> Vec<Value> {
        ledger.after(0, usize::MAX).iter().map(|line| serde_json::from_str(line).unwrap()).collect()
    }

    fn kinds(ledger: &Ledger) -> Vec<String> {
        told(ledger).iter().map(|fact| fact["kind"].as_str().unwrap().to_owned()).collect()
    }

    #[test]
    fn a_tick_is_learnt_from_two_messages() {
        let mut ledger = Ledger::default();
        ledger.summary(&msg::RequestSummary { tick: 40, ..summary_at(10) });
        ledger.summary(&msg::RequestSummary { tick: 80, ..summary_at(20) });
        ledger.summary(&msg::RequestSummary { tick: 120, ..summary_at(30) });
        let clocks: Vec<_> = told(&ledger).into_iter().filter(|fact| fact["kind"] == "clock").collect();
        assert_eq!(clocks.len(), 2);
        // A guess by the default of 2 Hz first; then 4 Hz, and tick 0 at the epoch.
        assert_eq!((&clocks[0]["tick_ms"], &clocks[0]["epoch_ms"]), (&json!(500.0), &json!(ms(-10))));
        assert_eq!((&clocks[1]["tick_ms"], &clocks[1]["epoch_ms"]), (&json!(250.0), &json!(ms(0))));
    }

    fn summary_at(seconds: i32) -> msg::RequestSummary {
        let mut summary = msg::RequestSummary::default();
        summary.header.stamp = at(seconds);
        summary
    }

    #[test]
    fn a_request_is_told_once_and_each_change_of_it_once() {
        let mut ledger = Ledger::default();
        let accepted = status(7, msg::StripStatus::STATE_ACCEPTED, 0, 0);
        ledger.strip(&accepted);
        ledger.strip(&accepted);
        ledger.strip(&status(7, msg::StripStatus::STATE_SCHEDULED, 5, 10));
        // A list that was asked for before.
        ledger.strip(&accepted);
        assert_eq!(ledger.requests()[&7].state, msg::StripStatus::STATE_SCHEDULED);
        ledger.strip(&status(0, msg::StripStatus::STATE_REJECTED, 5, 10));
        assert_eq!(kinds(&ledger), ["clock", "strip", "change", "change", "change", "refused"]);
        for (number, fact) in (1..).zip(told(&ledger)) {
            assert_eq!(fact["n"], number);
        }
    }

    #[test]
    fn the_past_comes_before_what_is_known_now() {
        let mut ledger = Ledger::default();
        let now = status(7, msg::StripStatus::STATE_COMPLETED, 60, 120);
        ledger.introduce(&now);
        for (state, seconds) in [(msg::StripStatus::STATE_ACCEPTED, 0), (msg::StripStatus::STATE_COMPLETED, 60)] {
            ledger.history(&msg::HistoryEntry { strip_id: 7, state, stamp: at(seconds), ..Default::default() });
        }
        ledger.strip(&now);
        // An event that was on its way while the list was read.
        ledger.strip(&now);
        assert_eq!(kinds(&ledger), ["clock", "strip", "change", "change", "change"]);
        assert_eq!(ledger.now_ms(), ms(60));
    }

    #[test]
    fn answers_that_are_repeated_count_once() {
        let mut ledger = Ledger::default();
        for task in [0, 0, 1, 0] {
            ledger.task(&msg::ImagingTask { task, ..Default::default() });
            ledger.result(&msg::TaskResult { task, ..Default::default() });
            ledger.offer(&msg::UpcomingStrips { task, ..Default::default() });
        }
        let kinds = kinds(&ledger);
        for kind in ["task", "result", "offer"] {
            assert_eq!(kinds.iter().filter(|it| *it == kind).count(), 2, "{kind}");
        }
    }

    #[test]
    fn alarms_stand_until_they_are_acknowledged_and_again_when_they_are_raised_again() {
        let mut ledger = Ledger::default();
        let raise = |ledger: &mut Ledger, name: &str, level: u8| {
            let status = DiagnosticStatus { name: name.to_owned(), level, ..Default::default() };
            ledger.diagnostics(&DiagnosticArray { status: vec![status], ..Default::default() });
        };
        raise(&mut ledger, "guidance: late", DiagnosticStatus::WARN);
        raise(&mut ledger, "guidance: well", DiagnosticStatus::OK);
        raise(&mut ledger, "guidance: health", DiagnosticStatus::WARN);
        raise(&mut ledger, "planner: lost", DiagnosticStatus::ERROR);
        assert!(ledger.acknowledge(1, "console"));
        assert!(!ledger.acknowledge(1, "console"), "it is acknowledged");
        assert!(!ledger.acknowledge(3, "console"), "there is no such alarm");
        raise(&mut ledger, "guidance: late", DiagnosticStatus::WARN);
        assert!(ledger.acknowledge(1, "console"), "it stands again");
        let numbers: Vec<_> = told(&ledger).iter().map(|fact| (fact["kind"].clone(), fact["alarm"].clone())).collect();
        let expected = [("alarm", 1), ("alarm", 2), ("acknowledged", 1), ("alarm", 1), ("acknowledged", 1)];
        assert_eq!(numbers, expected.map(|(kind, alarm)| (json!(kind), json!(alarm))));
    }

    #[test]
    fn alarms_that_the_mission_keeps_are_told_as_it_keeps_them() {
        let mut ledger = Ledger::default();
        let standing = |state, until| {
            let (node, name) = ("guidance".to_owned(), "late".to_owned());
            let alarm = msg::Alarm { node, name, severity: 2, state, shelved_until: at(until), ..Default::default() };
            msg::StandingAlarms { alarms: vec![alarm], ..Default::default() }
        };
        let event = |event, actor: &str| {
            let (node, name, actor) = ("guidance".to_owned(), "late".to_owned(), actor.to_owned());
            msg::AlarmEvent { node, name, event, actor, text: "known".to_owned(), ..Default::default() }
        };
        // Who comes late hears what stands first; what nodes say is no alarm of its own then.
        ledger.standing(&standing(msg::Alarm::STATE_ACKNOWLEDGED, 0));
        let status = DiagnosticStatus { level: DiagnosticStatus::WARN, ..Default::default() };
        ledger.diagnostics(&DiagnosticArray { status: vec![status], ..Default::default() });
        ledger.alarm_event(&event(msg::AlarmEvent::EVENT_RETURNED, "guidance"));
        ledger.alarm_event(&event(msg::AlarmEvent::EVENT_RAISED, "guidance"));
        ledger.alarm_event(&event(msg::AlarmEvent::EVENT_SHELVED, "ada"));
        ledger.standing(&standing(msg::Alarm::STATE_SHELVED, 60));
        ledger.standing(&standing(msg::Alarm::STATE_SHELVED, 60));
        ledger.alarm_event(&event(msg::AlarmEvent::EVENT_UNSHELVED, "ada"));
        assert_eq!(ledger.kept_alarm(1), Some(("guidance".to_owned(), "late".to_owned())));
        assert_eq!(ledger.kept_alarm(2), None);
        let all = told(&ledger);
        let kinds: Vec<_> = all.iter().map(|fact| fact["kind"].as_str().unwrap()).collect();
        assert_eq!(kinds, ["alarm", "acknowledged", "returned", "alarm", "shelved", "shelved"]);
        assert_eq!((&all[4]["actor"], &all[4]["until_ms"]), (&json!("ada"), &json!(ms(60))));
        assert_eq!(all[5]["until_ms"], json!(0.0));
    }

    #[test]
    fn a_point_that_is_nowhere_is_not_told() {
        let mut ledger = Ledger::default();
        ledger.point(&NavSatFix { latitude: f64::NAN, ..Default::default() });
        assert_eq!(ledger.last(), 0);
    }
}
