//! A node's health: how fast its main loop turns, how old its inputs are, what was lost; for `/diagnostics`.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::time::{Duration, Instant};

use swath_msgs::diagnostic_msgs::{DiagnosticStatus, KeyValue};
use swath_ros::Input;
use swath_ros::lifecycle::State;
use swath_ros::qos::Profile;

/// What a node's health is called on `/diagnostics`, after the node's name; it is no alarm.
pub const HEALTH: &str = "health";
/// Key of the state of its life cycle among what a node tells of its health.
pub const STATE: &str = "lifecycle";

/// How often it is told [wall time].
const EVERY: Duration = Duration::from_secs(1);
/// How long after it was started again a node wants attention.
const FRESH: Duration = Duration::from_secs(10);
/// An input that should come each tick, and has not for so long, wants attention; slow missions wait for three ticks.
const STALE: Duration = Duration::from_secs(2);

/// Counts what a node does between two reports.
#[derive(Debug)]
pub(crate) struct Health {
    started: Instant,
    told: Instant,
    /// How old an input of each tick may be.
    stale: Duration,
    /// Turns of the main loop since.
    turns: u32,
    /// Simulated time then [ns].
    now_ns: u64,
    /// What had come on each topic, and what was lost, then.
    before: BTreeMap<String, (u64, u64)>,
    /// What went wrong by its name: how often in all, and how often then.
    counts: BTreeMap<&'static str, (u64, u64)>,
}

/// What a node knows of itself.
pub(crate) struct Known {
    /// Simulated time [ns].
    pub now_ns: u64,
    /// Where it stands in its life.
    pub state: State,
    /// How often it was started again.
    pub restarts: u64,
    /// How long its launcher has been gone.
    pub orphaned: Option<Duration>,
    /// What has come.
    pub inputs: Vec<Input>,
}

impl Health {
    /// A node that starts `now`; a tick takes so much wall time, nothing in lockstep.
    pub fn new(now: Instant, tick: Duration) -> Self {
        let stale = STALE.max(tick.saturating_mul(3));
        Self { started: now, told: now, stale, turns: 0, now_ns: 0, before: BTreeMap::new(), counts: BTreeMap::new() }
    }

    /// The main loop has turned: whether it is time to tell.
    pub fn turn(&mut self, now: Instant) -> bool {
        self.turns = self.turns.saturating_add(1);
        now.saturating_duration_since(self.told) >= EVERY
    }

    /// Something went wrong so often since the node's start.
    pub fn count(&mut self, what: &'static str, total: u64) {
        self.counts.entry(what).or_default().0 = total;
    }

    /// Something went wrong so often once more.
    pub fn count_more(&mut self, what: &'static str, more: u64) {
        self.counts.entry(what).or_default().0 += more;
    }

    /// What there is to tell; level, words and values.
    pub fn tell(&mut self, now: Instant, known: &Known) -> DiagnosticStatus {
        let seconds = now.saturating_duration_since(self.told).as_secs_f64().max(1e-3);
        let simulated = known.now_ns.saturating_sub(self.now_ns) as f64 / 1e9;
        let speed = if self.now_ns == 0 { 0.0 } else { simulated / seconds };
        let mut values = vec![
            value(STATE, &known.state.label()),
            value("restarts", &known.restarts),
            value("loop_hz", &format_args!("{:.1}", f64::from(self.turns) / seconds)),
            value("simulated_s_per_s", &format_args!("{speed:.2}")),
        ];
        let mut troubles = Vec::new();
        if known.state != State::Active {
            troubles.push(format!("it is {}", known.state.label()));
        }
        for (what, (total, before)) in &mut self.counts {
            values.push(value(what, total));
            match *total - std::mem::replace(before, *total) {
                0 => {}
                more => troubles.push(format!("{what}: {more} more")),
            }
        }
        for input in &known.inputs {
            self.tell_input(input, seconds, &mut values, &mut troubles);
        }
        (self.told, self.turns, self.now_ns) = (now, 0, known.now_ns);
        if known.restarts > 0 && now.saturating_duration_since(self.started) < FRESH {
            troubles.push("it was started again".to_owned());
        }
        let (level, message) = match known.orphaned {
            Some(gone) => (DiagnosticStatus::ERROR, format!("the launcher has been gone for {} s", gone.as_secs())),
            None if troubles.is_empty() => (DiagnosticStatus::OK, "it runs".to_owned()),
            None => (DiagnosticStatus::WARN, troubles.join("; ")),
        };
        DiagnosticStatus { level, message, values, ..DiagnosticStatus::default() }
    }

    fn tell_input(&mut self, input: &Input, seconds: f64, values: &mut Vec<KeyValue>, troubles: &mut Vec<String>) {
        let Input { topic, profile, received, lost, age } = input;
        let (received_before, lost_before) = self.before.insert(topic.clone(), (*received, *lost)).unwrap_or_default();
        let rate = received.saturating_sub(received_before) as f64 / seconds;
        let text = age.map_or("never".to_owned(), |age| format!("{:.2}", age.as_secs_f64()));
        values.push(value(&format!("{topic} hz"), &format_args!("{rate:.1}")));
        values.push(value(&format!("{topic} age_s"), &text));
        values.push(value(&format!("{topic} lost"), lost));
        match lost.saturating_sub(lost_before) {
            0 => {}
            more => troubles.push(format!("{topic}: {more} messages lost")),
        }
        if *profile == Profile::State && age.is_some_and(|age| age > self.stale) {
            troubles.push(format!("{topic}: nothing for {text} s"));
        }
    }
}

fn value(key: &str, value: &dyn Display) -> KeyValue {
    KeyValue { key: key.to_owned(), value: value.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn input(received: u64, lost: u64, age_ms: u64) -> Input {
        Input {
            topic: "/swath/spacecraft/state".to_owned(),
            profile: Profile::State,
            received,
            lost,
            age: Some(Duration::from_millis(age_ms)),
        }
    }

    fn known(now_s: u64, restarts: u64, inputs: Vec<Input>) -> Known {
        Known { now_ns: now_s * 1_000_000_000, state: State::Active, restarts, orphaned: None, inputs }
    }

    fn of<'a>(status: &'a DiagnosticStatus, key: &str) -> &'a str {
        &status.values.iter().find(|it| it.key == key).unwrap().value
    }

    fn said(status: &DiagnosticStatus) -> (u8, &str) {
        (status.level, &status.message)
    }

    #[test]
    fn rates_ages_and_losses_are_those_since_the_last_report() {
        let begin = Instant::now();
        let mut health = Health::new(begin, Duration::ZERO);
        assert!(!health.turn(begin + Duration::from_millis(900)));
        assert!(health.turn(begin + Duration::from_secs(1)));
        let first = health.tell(begin + Duration::from_secs(1), &known(100, 0, vec![input(40, 0, 250)]));
        assert_eq!((said(&first), of(&first, "simulated_s_per_s")), ((DiagnosticStatus::OK, "it runs"), "0.00"));
        for _ in 0..50 {
            health.turn(begin + Duration::from_secs(2));
        }
        let second = health.tell(begin + Duration::from_secs(3), &known(140, 0, vec![input(120, 3, 250)]));
        assert_eq!(said(&second), (DiagnosticStatus::WARN, "/swath/spacecraft/state: 3 messages lost"));
        let keys = ["loop_hz", "simulated_s_per_s", "/swath/spacecraft/state hz", "/swath/spacecraft/state age_s"];
        assert_eq!(keys.map(|key| of(&second, key)), ["25.0", "20.00", "40.0", "0.25"]);
        let third = health.tell(begin + Duration::from_secs(4), &known(160, 0, vec![input(160, 3, 250)]));
        assert_eq!(third.level, DiagnosticStatus::OK, "what was lost was told");
    }

    #[test]
    fn what_should_come_each_tick_may_be_as_old_as_a_few_ticks() {
        let begin = Instant::now();
        let late = |tick_s| {
            let mut health = Health::new(begin, Duration::from_secs(tick_s));
            health.tell(begin + Duration::from_secs(1), &known(1, 0, vec![input(9, 0, 2500)]))
        };
        assert_eq!(said(&late(0)), (DiagnosticStatus::WARN, "/swath/spacecraft/state: nothing for 2.50 s"));
        assert_eq!(late(1).level, DiagnosticStatus::OK);
        let rare = Input { profile: Profile::Command, ..input(9, 0, 2500) };
        let mut health = Health::new(begin, Duration::ZERO);
        assert_eq!(health.tell(begin, &known(1, 0, vec![rare])).level, DiagnosticStatus::OK);
    }

    #[test]
    fn what_went_wrong_is_told_once_and_its_sum_always() {
        let begin = Instant::now();
        let mut health = Health::new(begin, Duration::ZERO);
        let tell = |health: &mut Health| health.tell(begin, &known(1, 0, Vec::new()));
        health.count("missed_ticks", 4);
        health.count_more("messages of strangers", 2);
        let first = tell(&mut health);
        assert_eq!(said(&first), (DiagnosticStatus::WARN, "messages of strangers: 2 more; missed_ticks: 4 more"));
        health.count("missed_ticks", 4);
        let second = tell(&mut health);
        assert_eq!((second.level, of(&second, "missed_ticks")), (DiagnosticStatus::OK, "4"));
        health.count("missed_ticks", 5);
        health.count_more("messages of strangers", 3);
        let third = tell(&mut health);
        assert_eq!(third.message, "messages of strangers: 3 more; missed_ticks: 1 more");
        assert_eq!(of(&third, "messages of strangers"), "5");
    }

    #[test]
    fn who_was_started_again_or_has_no_launcher_wants_attention() {
        let begin = Instant::now();
        let mut health = Health::new(begin, Duration::ZERO);
        let fresh = health.tell(begin + Duration::from_secs(1), &known(1, 2, Vec::new()));
        assert_eq!((fresh.level, of(&fresh, "restarts")), (DiagnosticStatus::WARN, "2"));
        let later = health.tell(begin + Duration::from_secs(11), &known(1, 2, Vec::new()));
        assert_eq!(later.level, DiagnosticStatus::OK);
        let inactive = Known { state: State::Inactive, ..known(1, 2, Vec::new()) };
        let inactive = health.tell(begin + Duration::from_secs(12), &inactive);
        assert_eq!((said(&inactive), of(&inactive, STATE)), ((DiagnosticStatus::WARN, "it is inactive"), "inactive"));
        let gone = Known { orphaned: Some(Duration::from_secs(7)), ..known(1, 2, Vec::new()) };
        let alone = health.tell(begin + Duration::from_secs(12), &gone);
        assert_eq!(said(&alone), (DiagnosticStatus::ERROR, "the launcher has been gone for 7 s"));
    }
}
