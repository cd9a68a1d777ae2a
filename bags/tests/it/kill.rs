//! A killed writer, or recorder, loses no more than the last second.

use std::env;
use std::fs::{self, File};
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use swath_bags::ops::recover::recover;
use swath_bags::ops::validate::validate;
use swath_bags::{Bag, BagOptions, BagWriter, ReadOptions, Topic};
use swath_ros::graph;

use crate::common::program::{Program, node, wait_until};
use crate::common::state;

/// Where the child writes its bag; without it the child's part is no test.
const BAG: &str = "SWATH_TEST_KILLED_BAG";
const KILLS: u64 = 50;

fn now_ns() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_nanos() as u64
}

/// What the children run: a steady stream of messages stamped with wall time, without end.
#[test]
fn write_until_killed() {
    let Some(dir) = env::var_os(BAG) else { return };
    let alive = File::create(heartbeat(Path::new(&dir))).unwrap();
    let bag = BagWriter::create(Path::new(&dir), BagOptions::default()).unwrap();
    let topic = Topic::new("/n", "std_msgs/msg/UInt64", "uint64 data\n", "", vec![]).unwrap();
    let topic = bag.add_topic(&topic).unwrap();
    for n in 0u64.. {
        let payload = [&[0, 1, 0, 0][..], &n.to_le_bytes()].concat();
        let now = now_ns();
        bag.write(topic, now, now, &payload).unwrap();
        alive.write_all_at(&now.to_le_bytes(), 0).unwrap();
        sleep(Duration::from_millis(5));
    }
}

/// Where a child leaves the time of its last message.
fn heartbeat(bag: &Path) -> PathBuf {
    bag.with_extension("alive")
}

fn child(dir: &Path) -> Child {
    let mut command = Command::new(env::current_exe().unwrap());
    command.args(["--exact", "kill::write_until_killed"]).env(BAG, dir);
    command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
}

#[test]
fn a_killed_writer_loses_no_more_than_the_last_second() {
    let temp = tempfile::tempdir().unwrap();
    let path = |name: &str, n: u64| temp.path().join(format!("{name} {n}"));
    let mut children: Vec<Child> = (0..KILLS).map(|n| child(&path("killed", n))).collect();
    sleep(Duration::from_millis(1200));
    for (n, child) in (0..).zip(&mut children) {
        // 37 ms apart, the kills strike at every phase of the writer's half-second rhythm.
        sleep(Duration::from_millis(37));
        child.kill().unwrap();
        child.wait().unwrap();
        let bytes = fs::read(heartbeat(&path("killed", n))).unwrap();
        let killed_at = u64::from_le_bytes(bytes.try_into().unwrap());
        assert_lost_within_a_second(&path("killed", n), &path("saved", n), killed_at);
    }
}

/// Recovers a killed bag; it is whole up to a second before the kill [ns since 1970].
fn assert_lost_within_a_second(killed: &Path, saved: &Path, killed_at: u64) {
    recover(killed, saved, BagOptions::default(), ReadOptions::default()).unwrap();
    let killed = killed.display();
    assert_eq!(validate(saved, None, ReadOptions::default()).unwrap().faults, [""; 0], "{killed}");
    let (_, last) = Bag::open(saved).unwrap().time_range().unwrap();
    let lost = killed_at.saturating_sub(last);
    assert!(lost < 1_000_000_000, "{killed} lost the last {lost} ns");
}

#[test]
#[ignore = "takes minutes: cargo test --release -p swath-bags --test it kill -- --ignored --nocapture"]
fn a_killed_recorder_loses_no_more_than_the_last_second() {
    const DOMAIN: u16 = 48;
    let temp = tempfile::tempdir().unwrap();
    for kill in 0..KILLS {
        // A node each time: one whose reader was killed waits for it until its lease is over.
        let node = node(DOMAIN);
        let states = node.publisher(&graph::SPACECRAFT_STATE).unwrap();
        let name = format!("killed {kill}");
        let words = ["record", "-o", &name, "--wall-time", "/swath/spacecraft/state"];
        let recorder = Program::start(DOMAIN, temp.path(), &words);
        wait_until("the recorder listens", || states.matched() > 0);
        // 137 ms apart, the kills strike at every phase of the writer's half-second rhythm.
        let until = Instant::now() + Duration::from_millis(1000 + kill * 137 % 1000);
        for tick in 0.. {
            states.publish(&state(tick)).unwrap();
            if Instant::now() > until {
                break;
            }
            sleep(Duration::from_millis(5));
        }
        let killed_at = now_ns();
        recorder.kill();
        assert_lost_within_a_second(&temp.path().join(name), &temp.path().join(format!("saved {kill}")), killed_at);
    }
    println!("{KILLS} kills of the recorder, none lost more than the last second");
}
