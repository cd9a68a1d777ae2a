//! The recorder as a process, with publishers around it.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use swath_bags::ops::validate::validate;
use swath_bags::tap::{Selection, Sink, Tap, Tapped};
use swath_bags::{Bag, Filter, ReadOptions, Topic, TopicPattern};
use swath_msgs::RosMessage;
use swath_msgs::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus};
use swath_msgs::geometry_msgs::{Transform, TransformStamped};
use swath_msgs::rosbag2_interfaces::{IsPaused, Pause, Resume, SplitBagfile, Stop};
use swath_msgs::rosgraph_msgs::Clock;
use swath_msgs::std_msgs::Header;
use swath_msgs::swath_msgs::UpcomingStrips;
use swath_msgs::tf2_msgs::TFMessage;
use swath_ros::qos::{History, QosProfile, WhenFull};
use swath_ros::{Cdr, Environment, Mapping, Node, RosArgs, Subscription, graph};

use crate::common::program::{PATIENCE, Program, call, client, node, wait_until};
use crate::common::{TICK, cdr, stamp, state};

/// A recorder that is ready; its bag is `dir/bag`.
fn recorder(domain: u16, dir: &Path, words: &[&str]) -> Program {
    Program::start(domain, dir, &[&["record", "-o", "bag"], words].concat())
}

/// Log times of a topic's messages.
fn times(bag: &Bag, topic: &str) -> Vec<u64> {
    let mut messages = bag.messages(&Filter::default()).unwrap();
    let mut times = Vec::new();
    while let Some(message) = messages.next().unwrap() {
        if bag.topics()[message.topic].topic.name == topic {
            times.push(message.log_time);
        }
    }
    times
}

#[test]
fn topics_of_the_graph_and_others_are_recorded_in_simulated_time() {
    let temp = tempfile::tempdir().unwrap();
    let node = node(30);
    let recorder = recorder(30, temp.path(), &["-x", "/rosout|/parameter_events|/diagnostics"]);
    let clock = node.publisher(&graph::CLOCK).unwrap();
    let states = node.publisher(&graph::SPACECRAFT_STATE).unwrap();
    let frames = node.publisher(&graph::TF).unwrap();
    let upcoming = node.publisher(&graph::UPCOMING_STRIPS).unwrap();
    let passing = QosProfile::publisher_default()
        .history(History::KeepLast { depth: 100 })
        .lifespan(Some(Duration::from_secs(10)));
    let foreign = node.raw_publisher("/foreign", "foreign_msgs/msg/Thing", &passing).unwrap();
    upcoming.publish(&UpcomingStrips::default()).unwrap();
    wait_until("the recorder listens", || {
        clock.matched() * states.matched() * frames.matched() * upcoming.matched() * foreign.matched() > 0
    });
    for tick in 1..=500 {
        clock.publish(&Clock { clock: stamp(tick * TICK) }).unwrap();
        states.publish(&state(tick)).unwrap();
    }
    let header = Header { stamp: stamp(500 * TICK), ..Header::default() };
    let transform = TransformStamped { header, transform: Transform::default(), ..TransformStamped::default() };
    frames.publish(&TFMessage { transforms: vec![transform] }).unwrap();
    foreign.publish(Cdr::from_bytes(vec![0, 1, 0, 0, 42])).unwrap();
    for _ in 0..5 {
        assert!(states.flush(PATIENCE) && foreign.flush(PATIENCE));
    }
    let (status, closed) = recorder.interrupt();
    assert!(status.success());
    assert_eq!((&closed["messages"], &closed["lost"]), (&1003.into(), &0.into()));

    let report = validate(&temp.path().join("bag"), None, ReadOptions::default()).unwrap();
    assert_eq!(report.faults, [""; 0]);
    assert_eq!(report.warnings, ["/foreign: no schema known for foreign_msgs/msg/Thing"]);
    let bag = Bag::open(&temp.path().join("bag")).unwrap();
    let ticks: Vec<u64> = (1..=500).map(|tick| tick * TICK).collect();
    assert_eq!(times(&bag, "/clock"), ticks);
    assert_eq!(times(&bag, "/swath/spacecraft/state"), ticks);
    assert_eq!(times(&bag, "/tf"), [500 * TICK], "the time of the first transform");
    assert_eq!(times(&bag, "/foreign"), [500 * TICK], "the last time of /clock");
    assert_eq!(times(&bag, "/swath/requests/upcoming").len(), 1, "latched topics come late");
    assert!(bag.topics().iter().all(|topic| topic.topic.name != "/rosout"));
    let upcoming = bag.topics().iter().find(|t| t.topic.name == "/swath/requests/upcoming").unwrap();
    assert_eq!(upcoming.topic.qos, [swath_bags::qos::QosProfile::latched(1)]);
    let foreign = bag.topics().iter().find(|t| t.topic.name == "/foreign").unwrap();
    assert_eq!(foreign.topic.qos[0].lifespan, swath_bags::qos::QosDuration { sec: 10, nsec: 0 });
}

#[test]
fn services_pause_resume_split_and_stop() {
    let temp = tempfile::tempdir().unwrap();
    let node = node(31);
    let recorder = recorder(31, temp.path(), &["/swath/spacecraft/state"]);
    let states = node.publisher(&graph::SPACECRAFT_STATE).unwrap();
    let pause = client::<Pause>(&node, "/swath/recorder/pause");
    let resume = client::<Resume>(&node, "/swath/recorder/resume");
    let is_paused = client::<IsPaused>(&node, "/swath/recorder/is_paused");
    let split = client::<SplitBagfile>(&node, "/swath/recorder/split_bagfile");
    let stop = client::<Stop>(&node, "/swath/recorder/stop");
    wait_until("the recorder listens", || states.matched() > 0);
    // What was sent before a call is taken before the call is answered.
    let send = |ticks: std::ops::Range<u64>| {
        ticks.for_each(|tick| states.publish(&state(tick)).unwrap());
        assert!(states.flush(PATIENCE));
        std::thread::sleep(Duration::from_millis(300));
    };
    assert!(!call(&is_paused).paused);
    send(1..10);
    call(&pause);
    assert!(call(&is_paused).paused);
    send(10..20);
    call(&resume);
    send(20..30);
    call(&split);
    send(30..40);
    call(&stop);
    let (status, closed) = recorder.end();
    assert!(status.success());
    assert_eq!(closed.unwrap()["files"], 2);
    let bag = Bag::open(&temp.path().join("bag")).unwrap();
    let expected: Vec<u64> = (1..10).chain(20..40).map(|tick| tick * TICK).collect();
    assert_eq!(times(&bag, "/swath/spacecraft/state"), expected);
    assert_eq!(validate(bag.path(), None, ReadOptions::default()).unwrap().faults, [""; 0]);
}

#[test]
fn stamps_far_from_the_clock_are_given_the_clock_s_time() {
    let temp = tempfile::tempdir().unwrap();
    let node = node(46);
    let recorder = recorder(46, temp.path(), &["/clock", "/header"]);
    let clock = node.publisher(&graph::CLOCK).unwrap();
    let qos = QosProfile::publisher_default().history(History::KeepLast { depth: 100 });
    let headers = node.raw_publisher("/header", Header::TYPE_NAME, &qos).unwrap();
    wait_until("the recorder listens", || clock.matched() * headers.matched() > 0);
    let wall = 1_800_000_000_000_000_000;
    for (now, stamped) in [(100, 100 * TICK), (101, wall), (102, 102 * TICK), (103, 0)] {
        clock.publish(&Clock { clock: stamp(now * TICK) }).unwrap();
        assert!(clock.flush(PATIENCE));
        std::thread::sleep(Duration::from_millis(100));
        let header = Header { stamp: stamp(stamped), ..Header::default() };
        headers.publish(Cdr::from_bytes(cdr(&header))).unwrap();
        assert!(headers.flush(PATIENCE));
        std::thread::sleep(Duration::from_millis(100));
    }
    assert!(recorder.interrupt().0.success());
    let bag = Bag::open(&temp.path().join("bag")).unwrap();
    assert_eq!(times(&bag, "/header"), [100, 101, 102, 103].map(|tick| tick * TICK));
    assert_eq!(bag.time_range(), Some((100 * TICK, 103 * TICK)));
}

#[test]
fn a_second_signal_does_not_keep_the_bag_from_being_closed() {
    let temp = tempfile::tempdir().unwrap();
    let node = node(47);
    let recorder = recorder(47, temp.path(), &["/swath/spacecraft/state"]);
    let states = node.publisher(&graph::SPACECRAFT_STATE).unwrap();
    wait_until("the recorder listens", || states.matched() > 0);
    (1..=50).for_each(|tick| states.publish(&state(tick)).unwrap());
    assert!(states.flush(PATIENCE));
    let (status, closed) = recorder.signalled(&["-INT", "-INT", "-TERM", "-INT"]);
    assert!(status.success(), "{status}");
    assert_eq!(closed.unwrap()["messages"], 50);
    let report = validate(&temp.path().join("bag"), None, ReadOptions::default()).unwrap();
    assert_eq!(report.faults, [""; 0]);
}

#[test]
fn the_options_of_ros2_bag_record() {
    let temp = tempfile::tempdir().unwrap();
    fs::write(temp.path().join("qos.yaml"), "/late: {reliability: best_effort, history: keep_all}\n").unwrap();
    let node = node(49);
    let reliable = QosProfile::publisher_default().reliability_reliable(WhenFull::Wait(PATIENCE));
    let publisher = |name: &str| node.raw_publisher(name, "std_msgs/msg/Header", &reliable).unwrap();
    let early = ["/early", "/left_out/a", "/also", "/a/_hidden"].map(publisher);
    let words = [
        "-a",
        "-s",
        "mcap",
        "--no-discovery",
        "--exclude-topics",
        "/left_out/.*",
        "/also",
        "--qos-profile-overrides-path",
        "qos.yaml",
        "--compression-mode",
        "message",
        "--compression-format",
        "lz4",
    ];
    let recorder = recorder(49, temp.path(), &words);
    wait_until("the recorder listens", || early[0].matched() > 0);
    let late = publisher("/late");
    std::thread::sleep(Duration::from_millis(700));
    assert_eq!((late.matched(), early[1].matched(), early[2].matched(), early[3].matched()), (0, 0, 0, 0));
    let header = Cdr::from_bytes(cdr(&Header { stamp: stamp(TICK), ..Header::default() }));
    early[0].publish(header).unwrap();
    assert!(early[0].flush(PATIENCE));
    assert!(recorder.interrupt().0.success());
    let bag = Bag::open(&temp.path().join("bag")).unwrap();
    assert_eq!(times(&bag, "/early"), [TICK]);
    assert!(bag.files()[0].compressions.contains_key("lz4"));
    let hidden = Program::start(49, temp.path(), &["record", "-o", "hidden", "--topics", "/a/_hidden", "/late"]);
    wait_until("the recorder listens", || early[3].matched() * late.matched() > 0);
    assert!(hidden.interrupt().0.success());
    let names: Vec<String> =
        Bag::open(&temp.path().join("hidden")).unwrap().topics().iter().map(|t| t.topic.name.clone()).collect();
    assert_eq!(names, ["/a/_hidden", "/late"]);
}

#[test]
fn topics_of_missions_in_other_namespaces_are_left_out_if_asked_for() {
    let temp = tempfile::tempdir().unwrap();
    let node = node(51);
    let reliable = QosProfile::publisher_default().reliability_reliable(WhenFull::Wait(PATIENCE));
    let publisher = |name: &str, type_name: &str| node.raw_publisher(name, type_name, &reliable).unwrap();
    let (state, clock) = (graph::SPACECRAFT_STATE.entry.type_name, graph::CLOCK.entry.type_name);
    // The last ones are no topics of a mission.
    let own = publisher("/swath/spacecraft/state", state);
    let others = [("/sat2/spacecraft/state", state), ("/sat2/clock", clock)].map(|(name, kind)| publisher(name, kind));
    let free =
        [("/sat2/own/state", state), ("/sat2/spacecraft/state_2", clock)].map(|(name, kind)| publisher(name, kind));
    let recorder = recorder(51, temp.path(), &["--own-mission-only"]);
    wait_until("the recorder listens", || own.matched() * free[0].matched() * free[1].matched() > 0);
    std::thread::sleep(Duration::from_millis(700));
    assert_eq!(others.each_ref().map(|publisher| publisher.matched()), [0, 0]);
    assert!(recorder.interrupt().0.success());
    // Who does not ask for it has them all.
    let all = Program::start(51, temp.path(), &["record", "-o", "all"]);
    wait_until("the recorder listens", || others[0].matched() * others[1].matched() > 0);
    assert!(all.interrupt().0.success());
}

/// A sink that keeps everything in memory.
#[derive(Default)]
struct Kept {
    topics: Vec<(String, String)>,
    messages: Vec<(usize, u64, Vec<u8>)>,
}

impl Sink for Kept {
    fn topic(&mut self, number: usize, topic: &Topic) -> swath_bags::Result<()> {
        assert_eq!(number, self.topics.len());
        self.topics.push((topic.name.clone(), topic.type_name.clone()));
        Ok(())
    }

    fn message(&mut self, message: &Tapped<'_>) -> swath_bags::Result<()> {
        self.messages.push((message.topic, message.log_time, message.cdr.to_vec()));
        Ok(())
    }

    fn lost(&mut self, _topic: usize, messages: u64) {
        panic!("{messages} messages lost");
    }
}

#[test]
fn a_tap_hands_topic_type_stamp_and_bytes_to_any_sink() {
    let publishing = node(20);
    let states = publishing.publisher(&graph::SPACECRAFT_STATE).unwrap();
    let words = ["--ros-args", "-r", "__node:=tap", "--disable-rosout-logs"].map(str::to_owned);
    let (_, args) = RosArgs::split(words).unwrap();
    let environment = Environment { domain: 20, localhost_only: false, mapping: Mapping::Cyclone };
    let listening = Node::start_in(environment, graph::OPERATOR, &args).unwrap();
    let name = "/swath/spacecraft/state".to_owned();
    let topics = TopicPattern::new(std::slice::from_ref(&name), None, None).unwrap();
    let mut tap = Tap::new(listening, Selection { topics, depth: 1000, ..Selection::default() }).unwrap();
    wait_until("the tap is heard", || states.matched() > 0);
    (1..=20).for_each(|tick| states.publish(&state(tick)).unwrap());
    let mut kept = Kept::default();
    wait_until("the messages have come", || {
        tap.take_all(&mut kept).unwrap();
        tap.do_chores(&mut kept).unwrap();
        kept.messages.len() >= 20
    });
    assert_eq!(kept.topics, [(name, "swath_msgs/msg/SpacecraftState".to_owned())]);
    let expected: Vec<_> = (1..=20).map(|tick| (0, tick * TICK, cdr(&state(tick)))).collect();
    assert_eq!(kept.messages, expected);
}

#[test]
fn what_a_tap_leaves_for_its_next_turn_is_waited_for_no_longer() {
    let publishing = node(50);
    let states = publishing.publisher(&graph::SPACECRAFT_STATE).unwrap();
    let words = ["--ros-args", "-r", "__node:=tap", "--disable-rosout-logs"].map(str::to_owned);
    let (_, args) = RosArgs::split(words).unwrap();
    let environment = Environment { domain: 50, localhost_only: false, mapping: Mapping::Cyclone };
    let listening = Node::start_in(environment, graph::OPERATOR, &args).unwrap();
    let topics = TopicPattern::new(&["/swath/spacecraft/state".to_owned()], None, None).unwrap();
    let mut tap = Tap::new(listening, Selection { topics, depth: 20_000, ..Selection::default() }).unwrap();
    wait_until("the tap is heard", || states.matched() > 0);
    (1..=10_000).for_each(|tick| states.publish(&state(tick)).unwrap());
    assert!(states.flush(PATIENCE), "all have come");
    let mut kept = Kept::default();
    let first = tap.take_all(&mut kept).unwrap();
    assert!(first < 10_000, "one turn takes {first}");
    // Nothing else comes that would raise it.
    assert!(tap.node().signal().wait(Duration::ZERO), "the rest raises the signal");
    let mut taken = first + tap.take_all(&mut kept).unwrap();
    while tap.node().signal().wait(Duration::ZERO) {
        taken += tap.take_all(&mut kept).unwrap();
    }
    assert_eq!(taken, 10_000);
}

/// The worst that the recorder says of itself within some time.
fn worst(diagnostics: &Subscription<DiagnosticArray>) -> u8 {
    let mut worst = DiagnosticStatus::OK;
    while let Some(array) = diagnostics.take().unwrap() {
        let of_bag = array.status.iter().filter(|status| status.name == "/swath/recorder: bag");
        worst = of_bag.map(|status| status.level).fold(worst, u8::max);
    }
    worst
}

#[test]
fn a_full_disk_ends_recording_with_an_alarm_and_a_readable_bag() {
    let temp = tempfile::tempdir().unwrap();
    let node = node(32);
    let diagnostics = node.subscription(&graph::DIAGNOSTICS).unwrap();
    // A limit on the size of files stands for a full disk: blocks of 1024 bytes.
    let script = "trap '' XFSZ; ulimit -f 60; exec \"$0\" record -o bag --compression none --chunk-size 4096 /swath/spacecraft/state";
    let mut command = Command::new("bash");
    command.args(["-c", script, env!("CARGO_BIN_EXE_swath-bag")]);
    let recorder = Program::spawn(command, 32, temp.path());
    let states = node.publisher(&graph::SPACECRAFT_STATE).unwrap();
    wait_until("the recorder listens", || states.matched() > 0 && diagnostics.matched() > 0);
    let mut alarm = DiagnosticStatus::OK;
    let start = Instant::now();
    for tick in 0.. {
        if states.publish(&state(tick)).is_err() || states.matched() == 0 || start.elapsed() > PATIENCE {
            break;
        }
        alarm = alarm.max(worst(&diagnostics));
        std::thread::sleep(Duration::from_millis(1));
    }
    let (status, _) = recorder.end();
    assert_eq!(status.code(), Some(4));
    wait_until("the alarm has come", || {
        alarm = alarm.max(worst(&diagnostics));
        alarm == DiagnosticStatus::ERROR
    });
    let report = validate(&temp.path().join("bag"), None, ReadOptions::default()).unwrap();
    assert_eq!(report.faults, [""; 0]);
    assert!(report.messages > 100, "{} messages", report.messages);
    assert!(report.warnings[0].starts_with("the recording lost "), "{:?}", report.warnings);
}
