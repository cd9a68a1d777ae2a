//! Recorder and player with CycloneDDS on the other side, as ROS 2 programs have it: reliable, of depth 10.

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;
use swath_bags::qos::QosProfile;
use swath_bags::{Bag, BagOptions, BagWriter, Topic};
use swath_msgs::Interface;

use crate::common::program::Program;
use crate::common::python;

const MESSAGES: u64 = 40_000;

/// `cyclone.py` as `write` or `read`.
fn peer(role: &str, domain: u16) -> Child {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python/cyclone.py");
    let mut command = Command::new(python());
    command.arg(script).args([role, &domain.to_string(), &MESSAGES.to_string()]);
    command.stdout(Stdio::piped()).spawn().unwrap()
}

fn said(peer: Child) -> Value {
    let output = peer.wait_with_output().unwrap();
    assert!(output.status.success(), "the peer failed");
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn bursts_of_a_writer_are_recorded_to_the_last_message() {
    let temp = tempfile::tempdir().unwrap();
    let recorder = Program::start(53, temp.path(), &["record", "-o", "bag", "/bench"]);
    said(peer("write", 53));
    let (status, done) = recorder.interrupt();
    assert!(status.success(), "{done}");
    assert_eq!((&done["messages"], &done["lost"]), (&MESSAGES.into(), &0.into()));
    assert_eq!(Bag::open(&temp.path().join("bag")).unwrap().message_count(), MESSAGES);
}

/// Each ten samples once waited for the next heartbeat: a minute for these.
#[test]
fn a_reader_of_depth_10_does_not_hold_the_player_up() {
    let temp = tempfile::tempdir().unwrap();
    let known = Interface::find("std_msgs/msg/String").unwrap();
    let qos = vec![QosProfile::reliable(10)];
    let topic = Topic::new("/bench", known.type_name, known.schema, known.type_hash, qos).unwrap();
    let bag = BagWriter::create(&temp.path().join("bag"), BagOptions::default()).unwrap();
    let number = bag.add_topic(&topic).unwrap();
    let message = [&[0, 1, 0, 0, 0x20, 1, 0, 0][..], &[b'a'; 287], &[0]].concat();
    (0..MESSAGES).for_each(|n| bag.write(number, n, n, &message).unwrap());
    bag.close().unwrap();
    let reader = peer("read", 54);
    let player = Program::start(54, temp.path(), &["play", "bag", "--rate", "0", "--delay", "3"]);
    let started = Instant::now();
    let (status, done) = player.end();
    assert!(status.success());
    assert_eq!(done.unwrap()["messages"], MESSAGES);
    assert!(started.elapsed() < Duration::from_secs(30), "{:?}", started.elapsed());
    // What Python has not taken before the next came is overwritten.
    assert!(said(reader)["taken"].as_u64().unwrap() > 0);
}
