//! The player as a process, with subscriptions around it.

use std::fs::{self, File};
use std::path::Path;
use std::process::{Command, Stdio};

use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use swath_bags::qos::QosProfile as BagQos;
use swath_bags::{Bag, BagOptions, BagWriter, Filter};
use swath_msgs::rosbag2_interfaces::{
    Burst, BurstRequest, GetRate, IsPaused, PlayNext, Resume, Seek, SeekRequest, SetRate, SetRateRequest, Stop,
    TogglePaused,
};
use swath_msgs::rosgraph_msgs::Clock;
use swath_msgs::swath_msgs::SpacecraftState;
use swath_ros::qos::{Durability, History, QosProfile};
use swath_ros::{Environment, Mapping, Node, RawSample, RawSubscription, RosArgs, Subscription, graph};

use crate::common::program::{PATIENCE, Program, call, client, node, wait_until};
use crate::common::{TICK, cdr, stamp, state, topic, write_sample};

const TICKS: u64 = 400;
const STATES: &str = "/swath/state";
const STATE_TYPE: &str = "swath_msgs/msg/SpacecraftState";

/// A folder with the bag `bag` of [`TICKS`] ticks.
fn folder() -> tempfile::TempDir {
    let temp = tempfile::tempdir().unwrap();
    write_sample(&temp.path().join("bag"), TICKS, BagOptions::default());
    temp
}

/// A player that is ready, with services and without keys.
fn player(domain: u16, dir: &Path, words: &[&str]) -> Program {
    Program::start(domain, dir, &[&["play", "bag"], words].concat())
}

fn reliable(node: &Node, name: &str, type_name: &str) -> RawSubscription {
    let qos = QosProfile::subscription_default().history(History::KeepLast { depth: 4096 });
    node.raw_subscription(name, type_name, &qos.reliability(graph::CLOCK.entry.profile.qos().reliability)).unwrap()
}

/// A subscription to the states, matched.
fn states(node: &Node, name: &str) -> RawSubscription {
    let states = reliable(node, name, STATE_TYPE);
    wait_until("the player is heard", || states.matched() > 0);
    states
}

/// The next messages of a topic, as many as are wanted.
fn take(subscription: &RawSubscription, wanted: usize) -> Vec<RawSample> {
    let mut taken = Vec::new();
    wait_until("the messages have come", || {
        while let Some(sample) = subscription.take().unwrap() {
            taken.push(sample);
        }
        taken.len() >= wanted
    });
    taken
}

/// The ticks of states, by their stamps.
fn ticks(samples: &[RawSample]) -> Vec<u64> {
    let seconds = |sample: &RawSample| u32::from_le_bytes(*sample.cdr.as_bytes()[4..].first_chunk().unwrap());
    let nanoseconds = |sample: &RawSample| u32::from_le_bytes(*sample.cdr.as_bytes()[8..].first_chunk().unwrap());
    samples.iter().map(|s| (u64::from(seconds(s)) * 1_000_000_000 + u64::from(nanoseconds(s))) / TICK).collect()
}

#[test]
fn every_message_comes_back_in_the_order_of_the_bag() {
    let temp = folder();
    let node = node(33);
    let player = player(33, temp.path(), &["--rate", "0", "--start-paused"]);
    let bag = Bag::open(&temp.path().join("bag")).unwrap();
    let subscriptions: Vec<RawSubscription> =
        bag.topics().iter().map(|t| reliable(&node, &t.topic.name, &t.topic.type_name)).collect();
    wait_until("the player is heard", || subscriptions.iter().all(|s| s.matched() > 0 || s.topic() == "/clock"));
    call(&client::<Resume>(&node, "/swath/player/resume"));
    let mut played = Vec::new();
    wait_until("the messages have come", || {
        for (topic, subscription) in subscriptions.iter().enumerate() {
            while let Some(sample) = subscription.take().unwrap() {
                played.push((sample.info.source_time_ns.unwrap(), topic, sample.cdr.as_bytes().to_vec()));
            }
        }
        // `/clock` is best effort in this bag, and reliable readers do not match it.
        played.len() as u64 > TICKS
    });
    let (status, done) = player.end();
    let done = done.unwrap();
    assert!(status.success(), "{done}");
    assert_eq!((&done["messages"], &done["refused"]), (&(2 * TICKS + 1).into(), &0.into()));

    played.sort();
    let mut messages = bag.messages(&Filter::default()).unwrap();
    let mut played = played.into_iter();
    while let Some(message) = messages.next().unwrap() {
        if bag.topics()[message.topic].topic.name != "/clock" {
            let (_, topic, bytes) = played.next().unwrap();
            assert_eq!((topic, &bytes[..]), (message.topic, message.data));
        }
    }
    assert_eq!(played.next(), None);
}

#[test]
fn a_span_under_another_name_at_a_rate() {
    let temp = folder();
    let node = node(34);
    let words = [
        "-r",
        "20",
        "--start-offset",
        "50",
        "--playback-duration",
        "20",
        "--topics",
        STATES,
        "-m",
        "/swath/state:=/again",
    ];
    let player = player(34, temp.path(), &[&words[..], &["--delay", "3"]].concat());
    let states = states(&node, "/again");
    let samples = take(&states, 41);
    let (status, done) = player.end();
    assert!(status.success());
    assert_eq!(done.unwrap()["messages"], 41);
    assert_eq!(ticks(&samples), (100..=140).collect::<Vec<_>>());
    let sent = |n: usize| samples[n].info.source_time_ns.unwrap();
    // At 20 times a tick lasts 25 ms; the first message may itself be late.
    assert!(sent(40) - sent(0) > 20 * TICK / 20, "{} ns for 40 ticks", sent(40) - sent(0));
}

#[test]
fn services_step_seek_and_set_the_rate() {
    let temp = folder();
    let node = node(35);
    let player = player(35, temp.path(), &["--start-paused", "--topics", STATES]);
    let states = states(&node, STATES);
    let name = |service: &str| -> &'static str { format!("/swath/player/{service}").leak() };
    let is_paused = client::<IsPaused>(&node, name("is_paused"));
    let toggle = client::<TogglePaused>(&node, name("toggle_paused"));
    let play_next = client::<PlayNext>(&node, name("play_next"));
    let burst = client::<Burst>(&node, name("burst"));
    let seek = client::<Seek>(&node, name("seek"));
    let get_rate = client::<GetRate>(&node, name("get_rate"));
    let set_rate = client::<SetRate>(&node, name("set_rate"));

    assert!(call(&is_paused).paused);
    assert!(call(&play_next).success);
    assert_eq!(ticks(&take(&states, 1)), [0]);
    assert_eq!(burst.call(BurstRequest { num_messages: 5 }, PATIENCE).unwrap().actually_burst, 5);
    assert_eq!(ticks(&take(&states, 5)), [1, 2, 3, 4, 5]);
    let seek_to = |ns: u64| seek.call(SeekRequest { time: stamp(ns) }, PATIENCE).unwrap().success;
    assert!(seek_to(300 * TICK));
    assert!(!seek_to(TICKS * TICK), "past the end");
    assert!(call(&play_next).success);
    assert_eq!(ticks(&take(&states, 1)), [300]);
    let rate = |rate: f64| set_rate.call(SetRateRequest { rate }, PATIENCE).unwrap().success;
    assert!(!rate(-1.0) && !rate(0.0) && !rate(f64::NAN));
    assert_eq!(call(&get_rate).rate, 1.0);
    assert!(rate(1000.0));
    assert_eq!(call(&get_rate).rate, 1000.0);
    assert!(seek_to(390 * TICK), "back and forth");
    call(&toggle);
    assert_eq!(ticks(&take(&states, 10)), (390..400).collect::<Vec<_>>());
    let (status, done) = player.end();
    assert!(status.success());
    assert_eq!(done.unwrap()["messages"], 17);
}

#[test]
fn late_joiners_get_what_was_latched_before_the_start() {
    let temp = folder();
    let node = node(36);
    let player = player(36, temp.path(), &["--start-offset", "100", "--clock", "--delay", "0"]);
    let latched = graph::UPCOMING_STRIPS.entry.profile.qos();
    assert_eq!(latched.durability, Durability::TransientLocal);
    let strips = node.raw_subscription("/swath/strips/upcoming", "swath_msgs/msg/UpcomingStrips", &latched).unwrap();
    assert_eq!(take(&strips, 1).len(), 1);

    // Time goes on from the start, and no second /clock from the bag turns it back.
    let clock: Subscription<Clock> = node.subscription(&graph::CLOCK).unwrap();
    let mut times = Vec::new();
    wait_until("time has gone on", || {
        while let Some(message) = clock.take().unwrap() {
            times.push((message.clock.sec, message.clock.nanosec));
        }
        times.len() >= 20
    });
    assert!(times.is_sorted() && times[0].0 >= 100, "{times:?}");
    assert!(times.iter().any(|(_, nanosec)| *nanosec % TICK as u32 != 0), "between the ticks, too");
    call(&client::<Stop>(&node, "/swath/player/stop"));
    assert!(player.end().0.success());
}

#[test]
fn a_loop_begins_anew_until_it_is_interrupted() {
    let temp = folder();
    let node = node(37);
    fs::write(temp.path().join("qos.yaml"), "/swath/state: {reliability: best_effort, depth: 2}\n").unwrap();
    let words = ["--loop", "-r", "2000", "--start-paused", "--qos-profile-overrides-path", "qos.yaml"];
    let player = player(37, temp.path(), &words);
    let refusing = reliable(&node, STATES, STATE_TYPE);
    let qos = QosProfile::subscription_default().history(History::KeepLast { depth: 4096 });
    let states = node.raw_subscription(STATES, STATE_TYPE, &qos).unwrap();
    wait_until("the player is heard", || states.matched() > 0);
    assert_eq!(refusing.matched(), 0, "best effort does not serve a reliable reader");
    call(&client::<Resume>(&node, "/swath/player/resume"));
    let mut seen = Vec::new();
    wait_until("the first tick has come three times", || {
        while let Some(sample) = states.take().unwrap() {
            seen.extend(ticks(&[sample]));
        }
        // Best effort may lose the very first tick.
        seen.windows(2).filter(|pair| pair[0] > pair[1]).count() >= 3
    });
    let (status, done) = player.interrupt();
    assert!(status.success());
    assert!(done["messages"].as_u64().unwrap() > 3 * 2 * TICKS);
}

#[test]
fn a_recorded_mission_is_played_again() {
    let node = node(39);
    let samples = Path::new(env!("CARGO_MANIFEST_DIR")).join("samples");
    let player = Program::start(39, &samples, &["play", "mission", "-r", "0", "-p"]);
    let tasks = node.subscription_with_depth(&graph::PLANNER_TASK, 4096).unwrap();
    wait_until("the player is heard", || tasks.matched() > 0);
    call(&client::<Resume>(&node, "/swath/player/resume"));
    let mut numbers = Vec::new();
    wait_until("the tasks have come", || {
        while let Some(task) = tasks.take().unwrap() {
            numbers.push(task.task);
        }
        numbers.len() >= 17
    });
    assert_eq!(numbers, (0..17).collect::<Vec<_>>());
    let (status, done) = player.end();
    assert!(status.success());
    let recorded = Bag::open(&samples.join("mission")).unwrap().message_count();
    assert_eq!(done.unwrap()["messages"], recorded);
}

#[test]
fn keys_pause_and_step() {
    let temp = folder();
    let node = node(38);
    let terminal = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
    grantpt(&terminal).unwrap();
    unlockpt(&terminal).unwrap();
    let name = ptsname(&terminal, Vec::new()).unwrap();
    let slave = File::options().read(true).write(true).open(name.to_str().unwrap()).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_swath-bag"));
    command.args(["play", "bag", "-p", "--topics", STATES, "-r", "0"]).stdin(Stdio::from(slave));
    let player = Program::spawn(command, 38, temp.path());
    let states = states(&node, STATES);
    let press = |keys: &[u8]| rustix::io::write(&terminal, keys).unwrap();
    press(b"\x1b[C");
    assert_eq!(ticks(&take(&states, 1)), [0]);
    press(b" ");
    assert_eq!(ticks(&take(&states, TICKS as usize - 1)), (1..TICKS).collect::<Vec<_>>());
    let (status, done) = player.end();
    assert!(status.success());
    assert_eq!(done.unwrap()["messages"], TICKS);
}

/// A bag whose second message comes a year after its first.
fn stretched(dir: &Path) {
    let bag = BagWriter::create(&dir.join("bag"), BagOptions::default()).unwrap();
    let states = bag.add_topic(&topic::<SpacecraftState>(STATES, BagQos::reliable(10))).unwrap();
    for (tick, time) in [(0, 0), (1, 31_536_000_000_000_000)] {
        bag.write(states, time, time, &cdr(&state(tick))).unwrap();
    }
    bag.close().unwrap();
}

#[test]
fn a_signal_ends_the_player_while_it_sleeps() {
    let temp = tempfile::tempdir().unwrap();
    stretched(temp.path());
    for (domain, signal) in [(40, "-INT"), (41, "-TERM")] {
        let node = node(domain);
        let player = player(domain, temp.path(), &["--delay", "3"]);
        let states = states(&node, STATES);
        assert_eq!(ticks(&take(&states, 1)), [0]);
        let (status, done) = player.signalled(&[signal]);
        assert!(status.success(), "{signal}: {status}");
        assert_eq!(done.unwrap()["messages"], 1);
    }
}

#[test]
fn big_endian_messages_are_turned_over_and_what_cannot_be_sent_is_told() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    let node = node(42);
    let player = Program::start(42, &data, &["play", "encapsulations.mcap", "-r", "0", "-p"]);
    let texts = reliable(&node, "/chatter", "std_msgs/msg/String");
    wait_until("the player is heard", || texts.matched() > 0);
    call(&client::<Resume>(&node, "/swath/player/resume"));
    let played = take(&texts, 5);
    let text = |sample: &RawSample| {
        let bytes = sample.cdr.as_bytes();
        assert_eq!(bytes[..2], [0, 1]);
        let len = u32::from_le_bytes(*bytes[4..].first_chunk().unwrap()) as usize;
        String::from_utf8(bytes[8..8 + len - 1].to_vec()).unwrap()
    };
    assert_eq!(played.iter().map(text).collect::<Vec<_>>(), ["be", "le", "xcdr2_le", "xcdr2_be", "pad"]);
    let (status, done) = player.end();
    let done = done.unwrap();
    assert_eq!((status.code(), &done["messages"], &done["refused"]), (Some(3), &5.into(), &2.into()));
}

#[test]
fn odd_names_are_played_in_full() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    let node = node(43);
    let player = Program::start(43, &data, &["play", "-i", "odd_names.mcap", "mcap", "-r", "0", "-p"]);
    let texts = reliable(&node, "/short_type", "std_msgs/msg/String");
    wait_until("the player is heard", || texts.matched() > 0);
    call(&client::<Resume>(&node, "/swath/player/resume"));
    assert_eq!(take(&texts, 1).len(), 1);
    player.end();
}

#[test]
fn the_options_of_ros2_bag_play() {
    let temp = folder();
    let run = |words: &[&str]| {
        let program = player(44, temp.path(), &[&["-r", "0", "--delay", "0"], words].concat());
        let (status, done) = program.end();
        assert!(status.success(), "{words:?}");
        done.unwrap()["messages"].as_u64().unwrap()
    };
    assert_eq!(run(&["--playback-duration", "0"]), 0);
    assert_eq!(run(&["--playback-until-sec", "10", "--topics", STATES]), 21);
    assert_eq!(run(&["--playback-until-nsec", "500000000", "--exclude-topics", "/clock", "/swath/strips/.*"]), 2);
    assert_eq!(run(&["--exclude-regex", ".*/state", "--wait-for-all-acked", "100", "-s", "mcap"]), TICKS + 1);
}

#[test]
fn a_damaged_file_is_passed_over_and_told() {
    let temp = tempfile::tempdir().unwrap();
    let options = BagOptions { max_file_bytes: Some(6_000), chunk_bytes: 4096, ..BagOptions::default() };
    write_sample(&temp.path().join("bag"), TICKS, options);
    let path = temp.path().join("bag/bag_1.mcap");
    let bytes = fs::read(&path).unwrap();
    fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
    let left = Bag::open(&temp.path().join("bag")).unwrap().message_count();
    let mut command = Command::new(env!("CARGO_BIN_EXE_swath-bag"));
    command.current_dir(temp.path()).env("ROS_DOMAIN_ID", "45").args(["play", "bag", "-r", "0", "--delay", "0"]);
    let output = command.output().unwrap();
    let (stdout, stderr) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert_eq!(output.status.code(), Some(3), "{stderr}");
    assert!(stderr.contains("bag_1.mcap") && stdout.contains(&format!("\"messages\":{left}")), "{stdout}{stderr}");
}

#[test]
fn what_cannot_be_played_is_told() {
    let temp = folder();
    fs::write(temp.path().join("qos.yaml"), "/no: {depth: 2}\n").unwrap();
    for (words, reason) in [
        (
            &["--start-offset", "201"][..],
            "error: --start-offset: 201000000000 ns is past the bag's end at 199500000000 ns\n",
        ),
        (
            &["--qos-profile-overrides-path", "qos.yaml"],
            "error: --qos-profile-overrides-path: the bag has no topic /no\n",
        ),
    ] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_swath-bag"));
        command.current_dir(temp.path()).env("ROS_DOMAIN_ID", "38").args(["play", "bag"]).args(words);
        let output = command.output().unwrap();
        assert_eq!(output.status.code(), Some(1));
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(stderr.ends_with(reason), "{stderr}");
    }
}

/// The nodes of a mission do not count what a player says; their guests would.
#[test]
fn a_mission_that_flies_is_spared() {
    let temp = folder();
    let environment = Environment { domain: 58, localhost_only: false, mapping: Mapping::Cyclone };
    let words = ["--ros-args", "-r", "__ns:=/swath", "-p", "memory_limit_mb:=0"].map(str::to_owned);
    let spacecraft = Node::start_in(environment, graph::SPACECRAFT, &RosArgs::split(words).unwrap().1).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_swath-bag"));
    let output = command.args(["play", "bag", "--delay", "0"]).current_dir(temp.path()).env("ROS_DOMAIN_ID", "58");
    let output = output.stdin(Stdio::null()).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(text.contains("/swath/spacecraft flies in domain 58") && text.contains("--force"), "{text}");
    let forced = player(58, temp.path(), &["--rate", "0", "--force"]);
    assert!(forced.end().0.success());
    drop(spacecraft);
}
