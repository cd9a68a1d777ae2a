//! Measures writing, reading, recording and playing; prints one JSON object.
//!
//! Recording takes two further processes: `bench_bags record DIR` and `bench_bags publish RATE N`;
//! playing, alone with `bench_bags play`, takes `bench_bags play BAG RATE` and `bench_bags listen N`. With CycloneDDS on
//! the other side, in Python, `bench_bags cyclone` measures both; and with a reader in C, where CycloneDDS is installed
//! (under `CYCLONEDDS_HOME`, or with ROS 2).
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a measurement that cannot go on should panic")]

use std::collections::BTreeMap;
use std::env;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use swath_bags::play::{End, LAST_MESSAGES, PlayOptions, Player};
use swath_bags::qos::QosProfile;
use swath_bags::record::{RecordOptions, Recorder};
use swath_bags::tap::Selection;
use swath_bags::{Bag, BagOptions, BagWriter, Compression, Filter, ReadOptions, Topic, TopicPattern};
use swath_msgs::Interface;
use swath_ros::qos::{Durability, History, QosProfile as RosProfile, WhenFull};
use swath_ros::{Cdr, Node, RosArgs, Shutdown};

const TOPIC: &str = "/bench";
const TYPE: &str = "std_msgs/msg/String";
const MESSAGE_BYTES: usize = 300;
const RECORDED: u64 = 1_000_000;
const RATE: u64 = 50_000;
/// Messages that are played to CycloneDDS.
const PLAYED: u64 = 250_000;
/// Messages that are played at their own pace, a thousand a second.
const PACED: u64 = 10_000;
/// A domain of its own, so that nothing else is recorded.
const DOMAIN: &str = "139";
/// Python with the packages of `tests/requirements.txt`, as the tests find it.
const PYTHON: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../.venv/bin/python");

fn main() {
    let args: Vec<String> = env::args().skip(1).collect();
    let args: Vec<&str> = args.iter().map(String::as_str).collect();
    let result = match args[..] {
        [] => measure(),
        ["play"] => {
            let temp = tempfile::tempdir().unwrap();
            let messages: Vec<_> = (0..1024).map(message).collect();
            measure_playing(temp.path(), &messages)
        }
        ["cyclone"] => measure_cyclone(tempfile::tempdir().unwrap().path()),
        ["record", dir] => record(Path::new(dir)),
        ["publish", rate, n] => publish(rate.parse().unwrap(), n.parse().unwrap()),
        ["play", bag, rate] => play(Path::new(bag), rate.parse().unwrap()),
        ["listen", n] => listen(n.parse().unwrap()),
        _ => panic!("usage: bench_bags [cyclone | record DIR | publish RATE N | play [BAG RATE] | listen N]"),
    };
    println!("{result}");
}

/// A text of 300 bytes as CDR, of numbers that change as telemetry does.
fn message(n: u64) -> Vec<u8> {
    let numbers = (0..40).map(|i| format!("{:.6} ", ((n + i) as f64 / 97.0).sin()));
    let mut text = numbers.collect::<String>();
    text.truncate(MESSAGE_BYTES - 9);
    let mut bytes = vec![0, 1, 0, 0];
    bytes.extend((text.len() as u32 + 1).to_le_bytes());
    bytes.extend(text.as_bytes());
    bytes.push(0);
    assert_eq!(bytes.len(), MESSAGE_BYTES);
    bytes
}

fn measure() -> Value {
    let temp = tempfile::tempdir().unwrap();
    let messages: Vec<_> = (0..1024).map(message).collect();
    let none = write(&temp.path().join("none"), Compression::None, &messages, 1_000_000, 1);
    let zstd_dir = temp.path().join("zstd");
    let zstd = write(&zstd_dir, Compression::Zstd, &messages, 1_000_000, 1);
    let read = read(&zstd_dir);
    let many = many_topics(&temp.path().join("many"));
    let mut result = record_over_dds(&temp.path().join("recorded"));
    result["bag_write_MB_per_s"] = json!(none.round());
    result["bag_write_zstd_MB_per_s"] = json!(zstd.round());
    result["bag_read_msgs_per_s"] = json!(read.round());
    result["bag_60000_topics_s"] = json!(many);
    for part in [measure_playing(temp.path(), &messages), measure_cyclone(temp.path())] {
        if let (Value::Object(all), Value::Object(part)) = (&mut result, part) {
            all.extend(part);
        }
    }
    result
}

/// Bursts of a CycloneDDS writer recorded, and a bag of 50 000 messages/s played to a CycloneDDS reader of depth 10, at the
/// bag's rate and as fast as it goes. Nothing without the Python of the tests.
fn measure_cyclone(dir: &Path) -> Value {
    let python = env::var("SWATH_PYTHON").unwrap_or_else(|_| PYTHON.to_owned());
    if !Path::new(&python).exists() {
        return json!({});
    }
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python/cyclone.py");
    let peer = |role: &str, count: u64| {
        let mut command = Command::new(&python);
        command.arg(&script).args([role, DOMAIN, &count.to_string()]);
        command.stdout(Stdio::piped()).spawn().unwrap()
    };
    let recorder = this(&["record", dir.join("bursts").to_str().unwrap()]);
    last_line(peer("write", RECORDED));
    let recorded = last_line(recorder);
    let bag = dir.join("steady");
    let messages: Vec<_> = (0..1024).map(message).collect();
    write(&bag, Compression::Zstd, &messages, PLAYED, 1_000_000_000 / RATE);
    let untaken = |reader| PLAYED.saturating_sub(last_line(reader)["taken"].as_u64().unwrap());
    let play = |rate: &str| {
        let reader = peer("read", PLAYED);
        let played = last_line(this(&["play", bag.to_str().unwrap(), rate]));
        (played, untaken(reader))
    };
    let ((steady, steady_lost), (fast, fast_lost)) = (play("1"), play("0"));
    let in_c = measure_reader_in_c(dir, &bag);
    // What the same reader takes of a writer of its own kind: with a depth of 10 it keeps no more until Python takes them.
    let reader = peer("read", PLAYED);
    last_line(peer("write", PLAYED));
    let reference_lost = untaken(reader);
    let mut result = json!({
        "record_bursts_lost": RECORDED - recorded["messages"].as_u64().unwrap(),
        "play_cyclone_late_p99_ms": steady["late_p99_ms"],
        "play_cyclone_lost": steady_lost,
        "play_cyclone_fast_lost": fast_lost,
        "play_cyclone_of_cyclone_lost": reference_lost,
        "play_cyclone_refused": PLAYED - steady["published"].as_u64().unwrap(),
        "play_cyclone_msgs_per_s": (PLAYED as f64 / fast["seconds"].as_f64().unwrap()).round(),
    });
    if let (Value::Object(all), Value::Object(part)) = (&mut result, in_c) {
        all.extend(part);
    }
    result
}

/// The same bag played to a reader of depth 10 in C that takes each sample where it comes in: what is missing has not come.
fn measure_reader_in_c(dir: &Path, bag: &Path) -> Value {
    let Some(program) = reader_in_c(dir) else { return json!({}) };
    let play = |rate: &str| {
        let mut reader = Command::new(&program);
        reader.args([DOMAIN, &PLAYED.to_string()]).stdout(Stdio::piped());
        let reader = reader.spawn().unwrap();
        let played = last_line(this(&["play", bag.to_str().unwrap(), rate]));
        let taken = last_line(reader);
        (PLAYED.saturating_sub(taken["taken"].as_u64().unwrap()), taken["unsent"].clone(), played)
    };
    let ((steady_lost, unsent, steady), (fast_lost, fast_unsent, fast)) = (play("1"), play("0"));
    json!({
        "play_cyclone_c_late_p99_ms": steady["late_p99_ms"],
        "play_cyclone_c_lost": steady_lost,
        "play_cyclone_c_unsent": unsent,
        "play_cyclone_c_fast_lost": fast_lost,
        "play_cyclone_c_fast_unsent": fast_unsent,
        "play_cyclone_c_msgs_per_s": (PLAYED as f64 / fast["seconds"].as_f64().unwrap()).round(),
    })
}

/// Builds that reader; nothing without CycloneDDS and a compiler.
fn reader_in_c(dir: &Path) -> Option<PathBuf> {
    let homes = ["CYCLONEDDS_HOME", "AMENT_PREFIX_PATH"].map(|name| env::var(name).unwrap_or_default());
    let mut homes = homes.iter().flat_map(|homes| homes.split(':')).map(Path::new);
    let home = homes.find(|home| home.join("include/dds/dds.h").exists() && home.join("bin/idlc").exists())?;
    let (source, include, library) =
        (Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/c"), home.join("include"), home.join("lib"));
    let mut idlc = Command::new(home.join("bin/idlc"));
    idlc.env("LD_LIBRARY_PATH", &library).arg(source.join("String.idl")).current_dir(dir);
    let program = dir.join("cyclone_reader");
    let mut cc = Command::new("cc");
    cc.args(["-O2", "-I."]).arg("-I").arg(&include).arg("-I").arg(include.join("ddsc"));
    cc.arg(source.join("cyclone_reader.c")).arg("String.c").arg("-L").arg(&library).arg("-lddsc");
    cc.arg(format!("-Wl,-rpath,{}", library.display())).arg("-o").arg(&program).current_dir(dir);
    let built = [idlc, cc].iter_mut().all(|step| step.status().is_ok_and(|status| status.success()));
    built.then_some(program)
}

/// This program in another role.
fn this(args: &[&str]) -> std::process::Child {
    let mut command = Command::new(env::current_exe().unwrap());
    command.args(args).env("ROS_DOMAIN_ID", DOMAIN).stdout(Stdio::piped()).spawn().unwrap()
}

/// A million messages as fast as they go, and a thousand a second at their own pace.
fn measure_playing(dir: &Path, messages: &[Vec<u8>]) -> Value {
    let (fast, paced) = (dir.join("fast"), dir.join("paced"));
    write(&fast, Compression::Zstd, messages, 1_000_000, 1);
    write(&paced, Compression::Zstd, messages, PACED, 1_000_000);
    let (player, listener) = play_over_dds(&fast, 0.0, 1_000_000);
    let (in_time, received) = play_over_dds(&paced, 1.0, PACED);
    json!({
        "play_msgs_per_s": listener["msgs_per_s"],
        "play_lost": listener["lost"],
        "play_cpu_s": player["cpu_s"],
        "play_listener_cpu_s": listener["cpu_s"],
        "play_late_p99_ms": in_time["late_p99_ms"],
        "play_received_late_p99_ms": received["late_p99_ms"],
    })
}

/// Writes messages some time apart; MB/s of message bytes, the end included.
fn write(dir: &Path, compression: Compression, messages: &[Vec<u8>], count: u64, step_ns: u64) -> f64 {
    let start = Instant::now();
    let bag = BagWriter::create(dir, BagOptions { compression, ..BagOptions::default() }).unwrap();
    let known = Interface::find(TYPE).unwrap();
    let topic = Topic::new(TOPIC, TYPE, known.schema, known.type_hash, vec![QosProfile::reliable(4096)]);
    let topic = bag.add_topic(&topic.unwrap()).unwrap();
    for n in 0..count {
        bag.write(topic, n * step_ns, n * step_ns, &messages[n as usize % messages.len()]).unwrap();
    }
    let summary = bag.close().unwrap();
    summary.messages as f64 * MESSAGE_BYTES as f64 / 1e6 / start.elapsed().as_secs_f64()
}

/// Reads all messages in order of time; messages/s.
fn read(dir: &Path) -> f64 {
    let start = Instant::now();
    let bag = Bag::open(dir).unwrap();
    let mut messages = bag.messages(&Filter::default()).unwrap();
    let mut n = 0.0;
    while messages.next().unwrap().is_some() {
        n += 1.0;
    }
    n / start.elapsed().as_secs_f64()
}

/// A message of one of 60 000 topics, from the opening of the bag on [s].
fn many_topics(dir: &Path) -> f64 {
    let bag = BagWriter::create(dir, BagOptions::default()).unwrap();
    for n in 0..60_000u64 {
        let topic =
            Topic::new(&format!("/t{n}"), "std_msgs/msg/UInt64", "uint64 data\n", "", vec![QosProfile::reliable(1)]);
        let topic = bag.add_topic(&topic.unwrap()).unwrap();
        bag.write(topic, n, n, &message(n)).unwrap();
    }
    bag.close().unwrap();
    let start = Instant::now();
    let bag = Bag::open(dir).unwrap();
    let topics = TopicPattern::new(&["/t30000".to_owned()], None, None).unwrap();
    let mut messages = bag.messages(&Filter { topics, ..Filter::default() }).unwrap();
    assert_eq!(messages.next().unwrap().unwrap().log_time, 30_000);
    start.elapsed().as_secs_f64()
}

/// A publisher and a recorder, each in its process.
fn record_over_dds(dir: &Path) -> Value {
    let recorder = this(&["record", dir.to_str().unwrap()]);
    let publisher = this(&["publish", &RATE.to_string(), &RECORDED.to_string()]);
    let sent: Value = last_line(publisher);
    let recorded: Value = last_line(recorder);
    let in_bag = recorded["messages"].as_u64().unwrap();
    json!({
        "record_msgs_per_s": (in_bag as f64 / sent["seconds"].as_f64().unwrap()).round(),
        "record_lost": RECORDED.saturating_sub(in_bag),
        "record_memory_MB": recorded["memory_MB"],
        "record_cpu_s": recorded["cpu_s"],
    })
}

/// A player and a listener, each in its process; what both say.
fn play_over_dds(bag: &Path, rate: f64, messages: u64) -> (Value, Value) {
    let listener = this(&["listen", &messages.to_string()]);
    let player = this(&["play", bag.to_str().unwrap(), &rate.to_string()]);
    (last_line(player), last_line(listener))
}

fn last_line(child: std::process::Child) -> Value {
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "a part of the measurement failed");
    let last = BufReader::new(&output.stdout[..]).lines().last().unwrap().unwrap();
    serde_json::from_str(&last).unwrap()
}

/// Records until no message has come for two seconds.
fn record(dir: &Path) -> Value {
    let names = [TOPIC.to_owned()];
    let options = RecordOptions {
        output: dir.to_owned(),
        selection: Selection {
            topics: TopicPattern::new(&names, None, None).unwrap(),
            depth: 16_384,
            ..Selection::default()
        },
        ..RecordOptions::default()
    };
    let recorder = Recorder::start(options, &RosArgs::default()).unwrap();
    let shutdown = Shutdown::default();
    let counter = recorder.counter();
    let watched = shutdown.clone();
    std::thread::spawn(move || {
        let mut last = 0;
        loop {
            std::thread::sleep(Duration::from_secs(2));
            let now = counter.messages();
            if now > 0 && now == last {
                return watched.ask();
            }
            last = now;
        }
    });
    let summary = recorder.run(&shutdown, |_| ()).unwrap();
    json!({ "messages": summary.messages, "lost": summary.lost, "memory_MB": memory_mb(), "cpu_s": cpu_s() })
}

/// Publishes N messages at a rate once the recorder is there.
fn publish(rate: u64, n: u64) -> Value {
    let (_, args) = RosArgs::split(["--ros-args", "-r", "__node:=bench_publisher"].map(str::to_owned)).unwrap();
    let node = Node::start("operator", &args).unwrap();
    let qos = RosProfile::publisher_default()
        .reliability_reliable(WhenFull::Wait(Duration::from_secs(10)))
        .durability(Durability::Volatile)
        .history(History::KeepLast { depth: 4096 });
    let publisher = node.raw_publisher(TOPIC, TYPE, &qos).unwrap();
    while publisher.matched() == 0 {
        std::thread::sleep(Duration::from_millis(20));
    }
    std::thread::sleep(Duration::from_millis(500));
    let messages: Vec<_> = (0..1024).map(|n| Cdr::from_bytes(message(n))).collect();
    let start = Instant::now();
    for n in 0..n {
        if n % 50 == 0 {
            let due = start + Duration::from_micros(n * 1_000_000 / rate);
            std::thread::sleep(due.saturating_duration_since(Instant::now()));
        }
        publisher.publish(messages[n as usize % messages.len()].clone()).unwrap();
    }
    let seconds = start.elapsed().as_secs_f64();
    if !publisher.flush(Duration::from_secs(10)) {
        eprintln!("not every reader has all messages");
    }
    std::thread::sleep(Duration::from_secs(1));
    json!({ "seconds": seconds })
}

/// Plays a bag two seconds after the node is up.
fn play(bag: &Path, rate: f64) -> Value {
    let options = PlayOptions {
        bags: vec![bag.to_owned()],
        read: ReadOptions::default(),
        topics: TopicPattern::default(),
        rate,
        repeat: false,
        start_offset: 0,
        end: End::default(),
        delay: Duration::from_secs(2),
        paused: false,
        clock_hz: None,
        remap: BTreeMap::new(),
        qos_overrides: BTreeMap::new(),
        keys: false,
        acknowledged: Some(LAST_MESSAGES),
        force: false,
    };
    let player = Player::start(options, &RosArgs::default()).unwrap();
    let summary = player.run(&Shutdown::default(), |_| ()).unwrap();
    json!({
        "published": summary.published,
        "seconds": summary.wall.as_secs_f64(),
        "late_p99_ms": summary.late_p99.as_secs_f64() * 1e3,
        "cpu_s": cpu_s(),
    })
}

/// Takes messages until none has come for ten seconds: how many a second, how many were lost, and how much later than the
/// quickest 99 % of them came, were they a millisecond apart.
fn listen(n: u64) -> Value {
    let (_, args) = RosArgs::split(["--ros-args", "-r", "__node:=bench_listener"].map(str::to_owned)).unwrap();
    let node = Node::start("operator", &args).unwrap();
    let qos = RosProfile::subscription_default()
        .reliability_reliable(WhenFull::Wait(Duration::from_secs(10)))
        .history(History::KeepLast { depth: 65_536 });
    let subscription = node.raw_subscription(TOPIC, TYPE, &qos).unwrap();
    let mut times = Vec::new();
    let mut last = Instant::now();
    while (times.is_empty() || last.elapsed() < Duration::from_secs(10)) && (times.len() as u64) < n {
        while let Some(sample) = subscription.take().unwrap() {
            times.push(sample.info.received_time_ns);
            last = Instant::now();
        }
        node.wait(Duration::from_millis(100)).unwrap();
        // A wake-up serves many messages, as in the recorder.
        std::thread::sleep(Duration::from_millis(1));
    }
    let span = (times[times.len() - 1] - times[0]) as f64 / 1e9;
    let mut late: Vec<i64> = (0..).zip(&times).map(|(k, time)| time.cast_signed() - k * 1_000_000).collect();
    late.sort_unstable();
    let late_p99 = late[late.len() * 99 / 100] - late[0];
    json!({
        "msgs_per_s": (times.len() as f64 / span).round(),
        "lost": n - times.len() as u64,
        "late_p99_ms": late_p99 as f64 / 1e6,
        "cpu_s": cpu_s(),
    })
}

/// Largest resident set of this process [MB].
fn memory_mb() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find(|line| line.starts_with("VmHWM:")).unwrap();
    line.split_whitespace().nth(1).unwrap().parse::<f64>().unwrap() / 1000.0
}

/// Processor time of this process [s], from clock ticks of a hundredth of a second.
fn cpu_s() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap();
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap().split_whitespace().collect();
    let ticks = |n: usize| fields[n].parse::<f64>().unwrap();
    (ticks(11) + ticks(12)) / 100.0
}
