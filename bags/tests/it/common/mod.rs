//! Helpers of the tests: sample messages as CDR, sample bags, and the Python of the test environment.
#![allow(dead_code, reason = "each test binary uses some of these")]
#![allow(clippy::unwrap_used, reason = "a test that cannot go on should panic")]

pub mod conformance;
pub mod contents;
pub mod mutate;
pub mod program;

use std::path::{Path, PathBuf};
use std::process::Command;

use swath_bags::qos::QosProfile;
use swath_bags::{BagOptions, BagSummary, BagWriter, Topic};
use swath_msgs::RosMessage;
use swath_msgs::builtin_interfaces::Time;
use swath_msgs::diagnostic_msgs::DiagnosticArray;
use swath_msgs::rosgraph_msgs::Clock;
use swath_msgs::std_msgs::Header;
use swath_msgs::swath_msgs::{SpacecraftState, UpcomingStrips};

/// A message's little-endian CDR with its encapsulation header.
pub fn cdr<M: RosMessage>(message: &M) -> Vec<u8> {
    let mut bytes = vec![0, 1, 0, 0];
    bytes.extend(cdr_encoding::to_vec::<M, byteorder::LittleEndian>(message).unwrap());
    bytes
}

/// The topic of a message type.
pub fn topic<M: RosMessage>(name: &str, qos: QosProfile) -> Topic {
    Topic::new(name, M::TYPE_NAME, M::SCHEMA, M::TYPE_HASH, vec![qos]).unwrap()
}

/// A stamp of a simulated time [ns].
pub fn stamp(ns: u64) -> Time {
    Time { sec: (ns / 1_000_000_000) as i32, nanosec: (ns % 1_000_000_000) as u32 }
}

/// A state whose numbers follow from its tick.
pub fn state(tick: u64) -> SpacecraftState {
    let mut state = SpacecraftState { tick, ..SpacecraftState::default() };
    state.header = Header { stamp: stamp(tick * TICK), frame_id: "N".to_owned() };
    state.sigma_bn = [0.1, -0.25, tick as f64 / 1024.0];
    state.r_bn_n.x = 6.9e6 + tick as f64;
    state
}

/// Length of a control tick [ns].
pub const TICK: u64 = 500_000_000;

/// Writes `ticks` of `/clock`, `/swath/state`, and one latched `/swath/strips/upcoming`.
pub fn write_sample(dir: &Path, ticks: u64, options: BagOptions) -> BagSummary {
    let bag = BagWriter::create(dir, options).unwrap();
    let clock = bag.add_topic(&topic::<Clock>("/clock", QosProfile::best_effort(1))).unwrap();
    let states = bag.add_topic(&topic::<SpacecraftState>("/swath/state", QosProfile::reliable(10)));
    let states = states.unwrap();
    let strips = topic::<UpcomingStrips>("/swath/strips/upcoming", QosProfile::latched(1));
    let strips = bag.add_topic(&strips).unwrap();
    bag.add_topic(&topic::<DiagnosticArray>("/diagnostics", QosProfile::reliable(10))).unwrap();
    let manifest = [("seed".to_owned(), "7".to_owned()), ("planner".to_owned(), "fixed".to_owned())];
    bag.add_metadata("swath_manifest", manifest.into());
    bag.write(strips, 0, 0, &cdr(&UpcomingStrips::default())).unwrap();
    for tick in 0..ticks {
        let time = tick * TICK;
        bag.write(clock, time, time, &cdr(&Clock { clock: stamp(time) })).unwrap();
        bag.write(states, time, time, &cdr(&state(tick))).unwrap();
    }
    bag.close().unwrap()
}

/// The interpreter with the packages of `tests/requirements.txt`.
pub fn python() -> PathBuf {
    if let Some(python) = std::env::var_os("SWATH_PYTHON") {
        return python.into();
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let python = root.join(".venv/bin/python");
    assert!(python.exists(), "no Python for the tests: run `cargo xtask test`, which makes .venv, or set SWATH_PYTHON");
    python
}

/// Runs a script of `tests/python` on a bag; returns what it prints.
pub fn run_python(script: &str, bag: &Path) -> String {
    let scripts = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python");
    let output = Command::new(python()).arg(scripts.join(script)).arg(bag).output().unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{script} refused {}:\n{stderr}", bag.display());
    String::from_utf8(output.stdout).unwrap()
}
