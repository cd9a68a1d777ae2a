//! The commands as processes: what they print and how they exit.

use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use swath_bags::metadata::BagInformation;
use swath_bags::qos::Durability;
use swath_bags::{Bag, BagOptions};

use crate::common::{cdr, state, write_sample};

fn swath_bag(dir: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_swath-bag"));
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
    let mut cat = Command::new(env!("CARGO_BIN_EXE_swath-bag"));
    let mut cat = cat.current_dir(temp.path()).args(["cat", "bag"]).stdout(Stdio::piped()).spawn().unwrap();
    drop(cat.stdout.take());
    assert!(cat.wait().unwrap().success());
}

#[test]
fn reindex_writes_what_the_writer_wrote() {
    let temp = tempfile::tempdir().unwrap();
    let dir = temp.path();
    let custom_data = [("vehicle".to_owned(), "sat-7".to_owned())].into();
    write_sample(
        &dir.join("bag"),
        200,
        BagOptions { max_file_bytes: Some(6_000), chunk_bytes: 4096, custom_data, ..BagOptions::default() },
    );
    let yaml = dir.join("bag/metadata.yaml");
    let read = || BagInformation::read(&dir.join("bag")).unwrap().unwrap();
    let mut before = read();
    assert!(before.files.len() > 2);
    assert!(run(dir, &["reindex", "bag"]).starts_with("401 messages in "));
    before.topics_with_message_count.sort_by(|a, b| a.topic_metadata.name.cmp(&b.topic_metadata.name));
    assert_eq!(read(), before, "what was told of more than the files is kept");
    std::fs::remove_file(&yaml).unwrap();
    run(dir, &["reindex", "bag"]);
    let anew = read();
    assert_eq!((anew.custom_data, anew.files), (None, before.files));
    assert_eq!(run(dir, &["validate", "bag"]), "401 messages on 4 topics checked: 0 faults, 0 warnings\n");
    // A file that was not closed is left out.
    let file = dir.join("bag/bag_1.mcap");
    let bytes = std::fs::read(&file).unwrap();
    std::fs::write(&file, &bytes[..bytes.len() - 50]).unwrap();
    let output = swath_bag(dir, &["reindex", "bag"]);
    assert_eq!(output.status.code(), Some(3));
    assert!(String::from_utf8_lossy(&output.stderr).contains("bag_1.mcap"));
    assert!(fail(dir, &["reindex", "bag/bag_0.mcap"]).contains("cannot read"));
}

#[test]
fn convert_takes_the_output_options_of_rosbag2() {
    let temp = sample();
    let dir = temp.path();
    let options = "\
output_bags:
- uri: all
  storage_id: \"\"
  all_topics: true
  all_services: true
  max_bagfile_size: 0
  compression_queue_size: 1
- uri: states
  storage_id: mcap
  regex: state
  topics: [/nowhere]
  exclude_topics: []
  storage_preset_profile: none
  custom_data: {vehicle: sat-7}
  start_time_ns: 1000000000
  end_time_ns: 2000000000
  topic_qos_profile_overrides:
    /swath/state: {durability: transient_local, depth: 7}
- uri: nothing
  max_cache_size: 5
";
    std::fs::write(dir.join("out.yaml"), options).unwrap();
    let told = run(dir, &["convert", "-i", "bag", "-o", "out.yaml"]);
    assert_eq!(told, "all: 41 messages\nstates: 3 messages\nnothing: 0 messages\n");
    assert_eq!(run(dir, &["cat", "all"]), run(dir, &["cat", "bag"]));
    let states = Bag::open(&dir.join("states")).unwrap();
    let qos = states.topics()[0].topic.qos[0];
    assert_eq!((qos.durability, qos.depth), (Durability::TransientLocal, 7));
    assert_eq!(states.information().unwrap().custom_data.as_ref().unwrap()["vehicle"], "sat-7");
    assert!(states.files()[0].compressions.contains_key(""));

    // A SQLite bag, and two bags as one.
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    std::fs::write(dir.join("one.yaml"), "output_bags: [{uri: one, all: true}]").unwrap();
    let db3 = data.join("rosbag2_cdr_test_db3");
    assert_eq!(
        run(dir, &["convert", "-i", db3.to_str().unwrap(), "sqlite3", "-i", "bag", "-o", "one.yaml"]),
        "one: 48 messages\n"
    );
    assert!(run(dir, &["validate", "one"]).ends_with("48 messages on 6 topics checked: 0 faults, 0 warnings\n"));
}

#[test]
fn output_options_that_are_not_understood_are_refused_before_anything_is_written() {
    let temp = sample();
    let dir = temp.path();
    for (yaml, reason) in [
        ("output_bags: [{uri: x, storage_id: sqlite3}]", "storage_id \"sqlite3\" is not written, only mcap is"),
        ("output_bags: [{uri: x, all_topcis: true}]", "unknown field `all_topcis`"),
        ("output_bags: [{all: true}]", "an output bag has no uri"),
        ("output_bags: [{uri: x, storage_preset_profile: best}]", "invalid variant: best"),
        ("output_bags: [{uri: x, compression_mode: all}]", "compression_mode \"all\" is none of none, file, message"),
        ("output: []", "unknown field `output`"),
    ] {
        std::fs::write(dir.join("bad.yaml"), yaml).unwrap();
        let error = fail(dir, &["convert", "-i", "bag", "-o", "bad.yaml"]);
        assert!(error.contains(reason), "{error}");
        assert!(!dir.join("x").exists());
    }
}

#[test]
fn info_tells_more_on_request() {
    let temp = sample();
    let text = run(temp.path(), &["info", "-v", "bag"]);
    let bytes = 20 * cdr(&state(0)).len();
    let size = format!("Count: 20 | Size Contribution: {:.1} KiB |", bytes as f64 / 1024.0);
    for part in [size.as_str(), "\n                     QoS: keep_last 10, reliable, volatile\n"] {
        assert!(text.contains(part), "{part:?} is missing in {text}");
    }
    let json: serde_json::Value = serde_json::from_str(&run(temp.path(), &["info", "bag", "-v", "--json"])).unwrap();
    assert_eq!(json["topics"][0]["schema_encoding"], "ros2msg");
    assert_eq!(json["topics"][2]["message_bytes"], bytes);
}

#[test]
fn what_knows_missions_is_run_by_the_program_beside() {
    let temp = tempfile::tempdir().unwrap();
    let dir = temp.path();
    std::fs::copy(env!("CARGO_BIN_EXE_swath-bag"), dir.join("swath-bag")).unwrap();
    let words = ["refly", "a bag", "--planner", "beam", "--help", "-x", "-1"];
    let run = || Command::new(dir.join("swath-bag")).args(words).output().unwrap();
    let said = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();

    let missing = run();
    assert_eq!(missing.status.code(), Some(1));
    let expected = format!("error: cannot run {}: No such file or directory", dir.join("swath").display());
    assert!(said(&missing.stderr).contains(&expected), "{}", said(&missing.stderr));

    std::fs::write(dir.join("swath"), "#!/bin/sh\nprintf '<%s>' \"$@\"\nexit 7\n").unwrap();
    std::fs::set_permissions(dir.join("swath"), PermissionsExt::from_mode(0o755)).unwrap();
    let output = run();
    assert_eq!(output.status.code(), Some(7));
    assert_eq!(said(&output.stdout), "<refly><a bag><--planner><beam><--help><-x><-1>");
    assert_eq!(said(&output.stderr), "swath-bag refly runs `swath refly`\n");
}
