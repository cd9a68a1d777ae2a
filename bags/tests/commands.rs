//! The commands as processes: what they print and how they exit.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should panic")]

mod common;

use std::{
    path::Path,
    process::{Command, Output, Stdio},
};

use common::write_sample;
use swath_bags::BagOptions;

fn swath_bag(dir: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_swath-bag-core"));
    command.current_dir(dir).args(args).output().unwrap()
}

/// Standard output of a command that must succeed.
fn run(dir: &Path, args: &[&str]) -> String {
    let output = swath_bag(dir, args);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{args:?}: {stderr}");
    String::from_utf8(output.stdout).unwrap()
}

/// Standard error of a command that must fail with code 1.
fn fail(dir: &Path, args: &[&str]) -> String {
    let output = swath_bag(dir, args);
    assert_eq!(output.status.code(), Some(1), "{args:?}");
    String::from_utf8(output.stderr).unwrap()
}

fn sample() -> tempfile::TempDir {
    let temp = tempfile::tempdir().unwrap();
    write_sample(&temp.path().join("bag"), 20, BagOptions::default());
    temp
}

#[test]
fn every_command_has_an_example() {
    let temp = tempfile::tempdir().unwrap();
    let help = run(temp.path(), &["--help"]);
    let commands = help.split("Commands:\n").nth(1).unwrap().split("\n\n").next().unwrap();
    let names: Vec<&str> = commands.lines().map(|l| l.split_whitespace().next().unwrap()).collect();
    assert!(names.len() >= 6, "{names:?}");
    for name in names.into_iter().filter(|name| *name != "help") {
        let help = run(temp.path(), &[name, "--help"]);
        assert!(help.contains(&format!("Example:\n  swath-bag {name} ")), "{help}");
    }
}

#[test]
fn info_reads_like_ros2_bag_info() {
    let temp = sample();
    let text = run(temp.path(), &["info", "bag"]);
    for line in [
        "Files:             bag_0.mcap",
        "Storage id:        mcap",
        "Compression:       zstd",
        "ROS Distro:        jazzy",
        "Duration:          9.500000000s",
        "Start:             1970-01-01 00:00:00.000 UTC (0.000000000)",
        "Messages:          41",
        "Lost:              0",
        "Topic information: Topic: /clock | Type: rosgraph_msgs/msg/Clock | Count: 20 | Serialization Format: cdr",
        "  planner: fixed",
    ] {
        assert!(text.lines().any(|found| found == line), "{line:?} is missing in {text}");
    }
    let json: serde_json::Value = serde_json::from_str(&run(temp.path(), &["info", "bag", "--json"])).unwrap();
    assert_eq!(json["messages"], 41);
    assert_eq!(json["metadata"]["swath_manifest"]["seed"], "7");
}

#[test]
fn cat_filter_merge_validate_recover() {
    let temp = sample();
    let dir = temp.path();
    let lines = run(dir, &["cat", "bag", "-t", "/swath/state", "--from", "+1", "--to", "2"]);
    assert_eq!(lines.lines().count(), 3);
    run(dir, &["filter", "bag", "-o", "a", "--to", "4.9"]);
    run(dir, &["filter", "bag", "-o", "b", "--from", "5", "--compression", "lz4"]);
    let merged = run(dir, &["merge", "b", "a", "-o", "ab"]);
    assert!(merged.starts_with("41 messages in 1 files"), "{merged}");
    assert_eq!(run(dir, &["cat", "ab", "-e", ".*/state"]), run(dir, &["cat", "bag", "-e", ".*/state"]));
    let report = run(dir, &["validate", "ab"]);
    assert_eq!(report, "41 messages on 4 topics checked: 0 faults, 0 warnings\n");
    let saved = run(dir, &["recover", "ab", "-o", "saved"]);
    assert_eq!(saved, "41 messages saved\n");
}

#[test]
fn faults_and_mistakes_end_with_code_1_and_a_reason() {
    let temp = sample();
    let dir = temp.path();
    assert!(fail(dir, &["info", "nothing"]).contains("cannot open nothing: No such file"));
    assert!(fail(dir, &["filter", "bag", "-o", "bag"]).contains("bag already exists"));
    assert!(fail(dir, &["cat", "bag", "-t", "/none"]).contains("the bag has no topic /none"));
    assert!(fail(dir, &["cat", "bag", "--from", "nan"]).contains("--from: NaN s is outside 0 to"));
    let file = dir.join("bag/bag_0.mcap");
    let bytes = std::fs::read(&file).unwrap();
    std::fs::write(&file, &bytes[..bytes.len() / 2]).unwrap();
    assert!(fail(dir, &["info", "bag"]).contains("the file's end is missing"));
    let validated = swath_bag(dir, &["validate", "bag"]);
    assert_eq!(validated.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&validated.stdout).contains("fault: "));
}

#[test]
fn a_closed_pipe_is_no_failure() {
    let temp = sample();
    let mut cat = Command::new(env!("CARGO_BIN_EXE_swath-bag-core"));
    let mut cat = cat.current_dir(temp.path()).args(["cat", "bag"]).stdout(Stdio::piped()).spawn().unwrap();
    drop(cat.stdout.take());
    assert!(cat.wait().unwrap().success());
}
