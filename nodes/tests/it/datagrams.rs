//! Missions to whose nodes somebody sends datagrams that nobody should send.

use std::collections::BTreeSet;
use std::path::Path;

use serde_json::Value;

use crate::common;
use crate::flight::Flight;
use crate::storm::Storm;
use crate::stranger::Stranger;

/// A mission that takes ten seconds and more.
const PACED: [&str; 6] = ["--no-bag", "--seed", "3", "--orbits", "1.2", "--pace=500"];
const LOCKSTEP: [&str; 6] = ["--no-bag", "--seed", "3", "--orbits", "20", "--pace=0"];
const MISSION: &str = "planner = \"lookahead\"\n[requests.random]\ncount = [2000, 2000]\n";

/// Names of the alarms that were raised, each behind its node.
fn alarms(out: &Path) -> BTreeSet<String> {
    // There is none where nothing was wrong.
    let journal = std::fs::read_to_string(out.join("alarms.jsonl")).unwrap_or_default();
    let word = |alarm: &Value, key: &str| alarm[key].as_str().unwrap().to_owned();
    let names = common::json_lines(&journal);
    names.iter().map(|alarm| format!("{}: {}", word(alarm, "node"), word(alarm, "name"))).collect()
}

/// Flies a mission while something is sent to it: it ends by itself, with the tasks that it has without that; the
/// alarms.
fn fly(words: &[&str], send: impl FnOnce(u16, &mut Flight)) -> BTreeSet<String> {
    let folder = tempfile::tempdir().unwrap();
    let mission = common::write_mission(folder.path(), MISSION);
    let domain = common::domain().parse().unwrap();
    let (alone, out) = (folder.path().join("alone"), folder.path().join("out"));
    let in_process = Flight::launch(&mission, &alone, domain, &[words, &["--in-process"]].concat());
    let (_, _, expected) = in_process.unwrap().end().unwrap();
    let mut flight = Flight::launch(&mission, &out, domain, words).unwrap();
    flight.wait_for_tasks(1).unwrap();
    send(domain, &mut flight);
    let (well, summary, tasks) = flight.end().unwrap();
    assert!(well && summary.failure.is_none(), "{:?}: {}", summary.failure, flight.said());
    assert!(tasks == expected, "other tasks: {} instead of {}", tasks.lines().count(), expected.lines().count());
    alarms(&out)
}

/// Each of the files, to the node and topic that it is for.
fn send_each(domain: u16, flight: &mut Flight) {
    let send = |number: u8, file: &str, topic: &str, kind: &str| {
        let mut stranger = Stranger::towards(None, domain, number, 2);
        if !topic.is_empty() {
            stranger.announce_writer(topic, &format!("swath_msgs::{kind}_"));
            std::thread::sleep(std::time::Duration::from_millis(300));
        }
        stranger.send_file(file, !topic.is_empty());
    };
    send(1, "01", "rt/swath/requests/request", "msg::dds_::StripRequest");
    send(2, "02", "rq/swath/requests/submitRequest", "srv::dds_::SubmitStrips_Request");
    send(3, "11", "rt/swath/spacecraft/state", "msg::dds_::SpacecraftState");
    let mut stalled = Stranger::towards(None, domain, 4, 2);
    stalled.announce_reader("rt/swath/spacecraft/state", "swath_msgs::msg::dds_::SpacecraftState_");
    for (number, file) in [(5, "03"), (6, "04"), (7, "06")] {
        send(number, file, "", "");
    }
    assert!(flight.flies().unwrap(), "all were sent in flight");
}

/// What the files of each kind have raised.
fn told_of_each(alarms: &BTreeSet<String>) {
    for alarm in [
        // Anybody may send requests, so they are looked into; the same for services.
        "request_manager: unreadable messages",
        "guidance: messages of strangers",
        "spacecraft: reader lags",
        "spacecraft: datagrams dropped",
        "guidance: datagrams dropped",
        "planner: datagrams dropped",
        "request_manager: datagrams dropped",
    ] {
        assert!(alarms.contains(alarm), "no alarm {alarm}: {alarms:?}");
    }
}

#[test]
fn a_paced_mission_tells_of_each_datagram_that_nobody_should_send() {
    told_of_each(&fly(&PACED, send_each));
}

#[test]
fn a_mission_in_lockstep_tells_of_each_datagram_that_nobody_should_send() {
    told_of_each(&fly(&LOCKSTEP, send_each));
}

#[test]
fn missions_fly_through_storms_of_damaged_datagrams() {
    for words in [PACED, LOCKSTEP] {
        let alarms = fly(&words, |domain, flight| {
            let mut storm = Storm::gather(domain, 1);
            assert!(storm.kinds().len() >= 7, "only these kinds were heard: {:x?}", storm.kinds());
            assert_eq!(storm.rage(2000, || flight.flies().unwrap()), 2000);
        });
        for alarm in [": messages of strangers", ": unreadable messages", ": datagrams dropped"] {
            assert!(alarms.iter().any(|raised| raised.ends_with(alarm)), "no alarm {alarm}: {alarms:?}");
        }
    }
}

#[test]
fn a_crowd_of_announced_participants_stays_outside() {
    for words in [PACED, LOCKSTEP] {
        fly(&words, |domain, flight| {
            Stranger::towards(None, domain, 1, 2).announce_crowd(2000, 2);
            assert!(flight.flies().unwrap(), "all were announced in flight");
        });
    }
}
