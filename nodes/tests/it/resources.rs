//! Missions whose power, data and momentum have bounds: the same in one process, over DDS and in a re-flight.

use std::path::Path;

use serde_json::Value;

use crate::common;
use crate::parity::tasks;

const MISSION: &str = "orbits = 1.5\nseed = 4\n[requests.random]\ncount = [1500, 1500]\n";
const BSK: &str = "[resources]\nprofile = \"bsk\"\nbattery_initial = 0.4\n";
const MINISAT: &str = "[resources]\nbattery_initial = 0.4\nbus_w = 140.0\n";

/// What a mission leaves behind: tasks, alarms, and how its resources ended.
fn left(out: &Path) -> (String, String, Value) {
    let read = |name: &str| std::fs::read_to_string(out.join(name)).unwrap();
    let summary: Value = serde_json::from_str(&read("summary.json")).unwrap();
    (read("tasks.jsonl"), read("alarms.jsonl"), summary["resources"].clone())
}

/// Flies a mission in one process, over DDS and again from its bag, and returns what it left behind.
fn flown_alike(folder: &Path, name: &str, text: &str, over_dds: &str, planner: &str) -> (String, String, Value) {
    let out = |kind: &str| folder.join(format!("{name}-{planner}-{kind}"));
    let words = ["--planner", planner];
    let mission = |text: &str| common::write_mission(folder, text);
    tasks(&mission(text), &out("in-process"), &[&words[..], &["--in-process"]].concat());
    tasks(&mission(&format!("{text}{over_dds}")), &out("dds"), &words);
    let bag = out("dds").join("bag");
    common::succeed(common::swath("0", &["refly"]).arg(bag));
    let (one, other) = (left(&out("in-process")), left(&out("dds")));
    assert_eq!(other.0, one.0, "tasks of {name}, planner {planner}");
    assert_eq!(other.2, one.2, "resources of {name}, planner {planner}");
    if over_dds.is_empty() {
        assert_eq!(other.1, one.1, "alarms of {name}, planner {planner}");
    }
    one
}

#[test]
fn resources_are_the_same_over_dds_in_one_process_and_in_a_re_flight() {
    let folder = tempfile::tempdir().unwrap();
    let planners =
        ["heuristic:80", "random", "lookahead", "beam", "frugal", "beam+handmade:0.35", "repair", "aspen", "hop-ppo"];
    for planner in planners {
        let (tasks, _, resources) = flown_alike(folder.path(), "bsk", &format!("{MISSION}{BSK}"), "", planner);
        for duty in ["charge", "downlink", "desaturate"] {
            assert!(tasks.contains(duty), "{planner} never had to {duty}");
        }
        assert!(resources["delivered"]["strips"].as_u64() > Some(0), "{planner}: {resources}");
        assert_eq!(resources["delivered"]["floor_violations"], 0, "{planner}: {resources}");
    }
    for planner in ["beam", "frugal"] {
        let (tasks, _, resources) = flown_alike(folder.path(), "minisat", &format!("{MISSION}{MINISAT}"), "", planner);
        assert!(tasks.contains("charge") && !tasks.contains("downlink"), "{planner}");
        assert!(resources["delivered"]["strips"].as_u64() > Some(0), "{planner}: {resources}");
    }
}

/// A battery that is empty is safe mode in flight, and alarms tell of it; a spacecraft that is started again has the
/// charge, the images and the momentum that the one before had.
#[test]
fn an_empty_battery_is_safe_mode_and_a_spacecraft_that_is_started_again_lives_on() {
    let folder = tempfile::tempdir().unwrap();
    let empty = "[resources]\nbattery_capacity_wh = 20.0\nbattery_initial = 0.5\nshield = false\n";
    let (tasks, alarms, resources) = flown_alike(folder.path(), "empty", &format!("{MISSION}{empty}"), "", "beam");
    for alarm in ["battery low", "power or wheels failed"] {
        assert!(alarms.contains(alarm), "{alarm}: {alarms}");
    }
    assert!(tasks.contains("charge") && resources["delivered"]["failures"].as_u64() > Some(0), "{resources}");
    let kills = "[faults]\nplan = [\"spacecraft:kill@400s\", \"spacecraft:kill@3000s\"]\n";
    flown_alike(folder.path(), "killed", &format!("{MISSION}{BSK}"), kills, "frugal");
    // What befalls guidance cuts images short in both.
    let faults = "[faults]\nplan = [\"guidance:kill@700s\", \"planner:kill@1000s+200s\"]\n";
    let (tasks, ..) = flown_alike(folder.path(), "guidance", &format!("{MISSION}{BSK}{faults}"), "", "frugal");
    assert!(tasks.contains("interrupted"), "{tasks}");
}

/// One command flies the example, and another one flies it without DDS.
#[test]
fn the_example_flies() {
    let folder = tempfile::tempdir().unwrap();
    let mission = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/missions/resources.toml");
    let out = |kind: &str| folder.path().join(kind);
    tasks(&mission, &out("dds"), &["--orbits", "1"]);
    tasks(&mission, &out("in-process"), &["--orbits", "1", "--in-process"]);
    assert_eq!(left(&out("dds")), left(&out("in-process")));
    let topics = common::succeed(common::command("swath-bag", "0").arg("info").arg(out("dds").join("bag")));
    for topic in ["/swath/spacecraft/battery", "/swath/spacecraft/resources"] {
        assert!(topics.contains(topic), "{topics}");
    }
}
