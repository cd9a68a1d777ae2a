//! What the ledger tells of messages, once each and in order.

use serde_json::{Value, json};
use swath_msgs::builtin_interfaces::Time;
use swath_msgs::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus};
use swath_msgs::sensor_msgs::NavSatFix;
use swath_msgs::swath_msgs as msg;

use crate::ledger::Ledger;

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
