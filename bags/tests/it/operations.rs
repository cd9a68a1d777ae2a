//! Filtering, merging, recovering, validating and printing bags, as library calls.

use std::fs;
use std::path::Path;
use std::time::Duration;

use swath_bags::ops::cat::cat;
use swath_bags::ops::copy::{filter, merge};
use swath_bags::ops::info::info;
use swath_bags::ops::recover::recover;
use swath_bags::ops::validate::validate;
use swath_bags::qos::QosProfile;
use swath_bags::{Bag, BagError, BagOptions, BagWriter, Compression, Filter, ReadOptions, Topic, TopicPattern};
use swath_msgs::swath_msgs::SpacecraftState;

use crate::common::{TICK, cdr, state, topic, write_sample};

const TICKS: u64 = 200;

fn small_chunks() -> BagOptions {
    BagOptions { chunk_bytes: 4096, ..BagOptions::default() }
}

/// Topic, sequence, time and payload of every message.
fn contents(bag: &Path, filter: &Filter) -> Vec<(String, u32, u64, Vec<u8>)> {
    let bag = Bag::open(bag).unwrap();
    let mut messages = bag.messages(filter).unwrap();
    let mut all = Vec::new();
    while let Some(m) = messages.next().unwrap() {
        let name = bag.topics()[m.topic].topic.name.clone();
        all.push((name, m.sequence, m.log_time, m.data.to_vec()));
    }
    all
}

#[test]
fn a_filtered_bag_holds_what_was_asked_for_and_validates() {
    let temp = tempfile::tempdir().unwrap();
    let (whole, part) = (temp.path().join("whole"), temp.path().join("part"));
    write_sample(&whole, TICKS, small_chunks());
    let wanted = Filter {
        topics: TopicPattern::new(&["/clock".to_owned()], None, None).unwrap(),
        from: 50 * TICK,
        until: 59 * TICK,
    };
    let summary = filter(&Bag::open(&whole).unwrap(), &wanted, &part, small_chunks()).unwrap();
    assert_eq!((summary.summary.messages, summary.faults), (10, vec![]));
    assert_eq!(contents(&part, &Filter::default()), contents(&whole, &wanted));
    let bag = Bag::open(&part).unwrap();
    assert_eq!(bag.topics().len(), 1);
    assert_eq!(bag.metadata_named("swath_manifest").unwrap()["seed"], "7");
    let report = validate(&part, None, ReadOptions::default()).unwrap();
    assert_eq!(report.faults, [""; 0]);
    let again = filter(&bag, &Filter::default(), &part, small_chunks());
    assert!(matches!(again, Err(BagError::Exists { .. })), "nothing is overwritten");
}

#[test]
fn merging_the_halves_gives_the_whole() {
    let temp = tempfile::tempdir().unwrap();
    let path = |name: &str| temp.path().join(name);
    write_sample(&path("whole"), TICKS, small_chunks());
    let whole = Bag::open(&path("whole")).unwrap();
    for (name, exclude) in [("clock", "/swath/.*"), ("rest", "/clock")] {
        let topics = TopicPattern::new(&[], None, Some(exclude)).unwrap();
        let half = Filter { topics, ..Filter::default() };
        filter(&whole, &half, &path(name), small_chunks()).unwrap();
    }
    let halves = [path("clock"), path("rest")];
    merge(&halves, &path("merged"), small_chunks(), ReadOptions::default()).unwrap();
    let sorted = |name: &str| {
        let mut all = contents(&path(name), &Filter::default());
        assert!(all.is_sorted_by_key(|(_, _, time, _)| *time));
        all.sort();
        all
    };
    assert_eq!(sorted("merged"), sorted("whole"));
    assert_eq!(validate(&path("merged"), None, ReadOptions::default()).unwrap().faults, [""; 0]);
}

#[test]
fn splitting_by_duration_and_size_loses_nothing() {
    let temp = tempfile::tempdir().unwrap();
    let path = |name: &str| temp.path().join(name);
    write_sample(&path("one"), TICKS, small_chunks());
    let duration = BagOptions { max_file_duration: Some(Duration::from_nanos(50 * TICK)), ..small_chunks() };
    let by_duration = write_sample(&path("duration"), TICKS, duration);
    assert_eq!(by_duration.files, 4);
    for file in Bag::open(&path("duration")).unwrap().files() {
        assert!(file.end - file.start < 50 * TICK, "{file:?}");
    }
    let size = BagOptions { max_file_bytes: Some(6_000), ..small_chunks() };
    assert!(write_sample(&path("size"), TICKS, size).files > 2);
    for name in ["duration", "size"] {
        let all = contents(&path(name), &Filter::default());
        assert_eq!(all, contents(&path("one"), &Filter::default()));
        assert_eq!(validate(&path(name), None, ReadOptions::default()).unwrap().faults, [""; 0]);
    }
}

#[test]
fn messages_come_in_order_of_time_whatever_the_order_of_recording() {
    let temp = tempfile::tempdir().unwrap();
    let dir = temp.path().join("mixed");
    let options = BagOptions { compression: Compression::None, ..small_chunks() };
    let bag = BagWriter::create(&dir, options).unwrap();
    let x = bag.add_topic(&Topic::new("/x", "a/msg/B", "uint64 n\n", "", vec![]).unwrap()).unwrap();
    // 7919 is prime: every time from 0 to 4999 once, far from in order.
    for n in 0..5000u64 {
        let time = n * 7919 % 5000;
        bag.write(x, time, time, &[&[0, 1, 0, 0][..], &n.to_le_bytes()].concat()).unwrap();
    }
    // And some at one time, which stay in the order of recording.
    for n in 5000..5010u64 {
        bag.write(x, 4999, 4999, &[&[0, 1, 0, 0][..], &n.to_le_bytes()].concat()).unwrap();
    }
    bag.close().unwrap();
    let all = contents(&dir, &Filter::default());
    let times: Vec<u64> = all.iter().map(|(_, _, time, _)| *time).collect();
    let expected: Vec<u64> = (0..5000).chain([4999; 10]).collect();
    assert_eq!(times, expected);
    let last: Vec<u32> = all[5000..].iter().map(|(_, sequence, ..)| *sequence).collect();
    assert_eq!(last, (5000..5010).collect::<Vec<u32>>());
}

#[test]
fn a_lost_message_is_a_fault() {
    let temp = tempfile::tempdir().unwrap();
    let dir = temp.path().join("gap");
    let bag = BagWriter::create(&dir, small_chunks()).unwrap();
    let states = topic::<SpacecraftState>("/swath/state", QosProfile::reliable(10));
    let states = bag.add_topic(&states).unwrap();
    for tick in 0..10 {
        if tick == 5 {
            bag.count_lost(states, 2);
        }
        bag.write(states, tick * TICK, tick * TICK, &cdr(&state(tick))).unwrap();
    }
    assert_eq!(bag.close().unwrap().lost, 2);
    let report = validate(&dir, None, ReadOptions::default()).unwrap();
    assert_eq!(report.faults, ["/swath/state: 2 of 12 sequence numbers are missing"]);
    assert_eq!(report.warnings, ["the recording lost 2 messages"]);
    assert_eq!(info(&Bag::open(&dir).unwrap()).lost, 2);
}

#[test]
fn validation_finds_what_is_wrong() {
    let temp = tempfile::tempdir().unwrap();
    let dir = temp.path().join("wrong");
    let bag = BagWriter::create(&dir, small_chunks()).unwrap();
    let clock = swath_msgs::Interface::find("rosgraph_msgs/msg/Clock").unwrap();
    let add = |name: &str, schema: &str, hash: &str| {
        bag.add_topic(&Topic::new(name, clock.type_name, schema, hash, vec![]).unwrap()).unwrap()
    };
    let short = add("/short", clock.schema, clock.type_hash);
    add("/hash", clock.schema, &format!("RIHS01_{}", "0".repeat(64)));
    add("/schema", "no schema", "");
    add("/unknown", "", "");
    bag.write(short, 0, 0, &[0, 1, 0, 0, 1]).unwrap();
    bag.write(short, 9 * TICK, 0, &[0, 1, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0]).unwrap();
    bag.close().unwrap();
    let report = validate(&dir, Some(TICK), ReadOptions::default()).unwrap();
    let expected = [
        "/hash: topic_type_hash \"RIHS01_0000",
        "/schema: schema of rosgraph_msgs/msg/Clock, line 1: type rosgraph_msgs/no is not defined",
        "/short, message 0 at 0 ns: CDR of rosgraph_msgs/msg/Clock, byte 4: 4 bytes expected",
        "/short: 4500000000 ns without a message, the limit is 500000000 ns",
    ];
    assert_eq!(report.faults.len(), expected.len(), "{:#?}", report.faults);
    for (fault, expected) in report.faults.iter().zip(expected) {
        assert!(fault.starts_with(expected), "{fault}");
    }
    assert_eq!(report.warnings, ["/unknown: no schema known for rosgraph_msgs/msg/Clock"]);
    fs::write(dir.join("metadata.yaml"), "nonsense").unwrap();
    assert!(validate(&dir, None, ReadOptions::default()).unwrap().faults.iter().any(|f| f.contains("metadata.yaml")));
}

#[test]
fn cat_prints_json_lines() {
    let temp = tempfile::tempdir().unwrap();
    let dir = temp.path().join("bag");
    write_sample(&dir, TICKS, small_chunks());
    let bag = Bag::open(&dir).unwrap();
    let topics = TopicPattern::new(&["/swath/state".to_owned()], None, None).unwrap();
    let from_tick_7 = Filter { topics, from: 7 * TICK, ..Filter::default() };
    let mut out = Vec::new();
    assert_eq!(cat(&bag, &from_tick_7, Some(3), &mut out, &mut Vec::new()).unwrap(), 3);
    let lines: Vec<serde_json::Value> =
        out.split(|b| *b == b'\n').filter(|l| !l.is_empty()).map(|l| serde_json::from_slice(l).unwrap()).collect();
    assert_eq!(lines.len(), 3);
    assert_eq!(lines[0]["topic"], "/swath/state");
    assert_eq!(lines[0]["time"], 3.5);
    assert_eq!(lines[0]["message"]["tick"], 7);
    assert_eq!(lines[0]["message"]["header"]["stamp"]["nanosec"], 500_000_000);
    let unknown = TopicPattern::new(&["/nowhere".to_owned()], None, None).unwrap();
    let error = bag.messages(&Filter { topics: unknown, ..Filter::default() }).err().unwrap();
    assert_eq!(error.to_string(), "--topic: the bag has no topic /nowhere");
}

#[test]
fn recovering_an_undamaged_bag_changes_nothing() {
    let temp = tempfile::tempdir().unwrap();
    let (whole, saved) = (temp.path().join("whole"), temp.path().join("saved"));
    write_sample(&whole, TICKS, BagOptions { max_file_bytes: Some(6_000), ..small_chunks() });
    let recovery = recover(&whole, &saved, small_chunks(), ReadOptions::default()).unwrap();
    assert_eq!(recovery.faults, [""; 0]);
    let everything = Filter::default();
    assert_eq!(contents(&saved, &everything), contents(&whole, &everything));
    let manifest = Bag::open(&saved).unwrap().metadata_named("swath_manifest").cloned();
    assert_eq!(manifest.unwrap()["planner"], "fixed");
}
