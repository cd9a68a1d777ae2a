//! Missions over the radio: over DDS they are what they are in one process, byte by byte, whoever is killed on the way.

use std::path::{Path, PathBuf};
use std::process::Command;

use rustix::process::{Signal, kill_process};
use serde_json::Value;

use crate::common;
use crate::supervised::process;

const ONE: &str = "\"merritt\"";
const THREE: &str = "\"puertollano\", \"awarua\", \"punta-arenas\"";
const SEVEN: &str = "\"boulder\", \"merritt\", \"singapore\", \"weilheim\", \"santiago\", \"dongara\", \"hawaii\"";
/// What a mission over the radio leaves that must be the same wherever it is flown.
const OUTPUTS: [&str; 3] = ["tasks.jsonl", "strips.jsonl", "alarms.jsonl"];

/// A loss, and what of the radio fails by order.
const FAILING: &str = "0.1\n[faults]\nplan = [\"link:drop 60%@600s+3000s\", \"link:kill@900s\", \"catalogue:kill@1500s\", \
    \"link:hang@2000s\", \"catalogue:hang@2600s\"]";

fn mission(folder: &Path, name: &str, text: &str) -> PathBuf {
    let path = folder.join(format!("{name}.toml"));
    std::fs::write(&path, format!("{text}[requests.random]\ncount = [800, 800]\n")).unwrap();
    path
}

fn launch(mission: &Path, out: &Path, words: &[&str]) -> Command {
    let mut launch = common::command("swath", &common::domain());
    launch.arg("launch").arg(mission).arg("--out").arg(out).args(words);
    launch
}

fn outputs(out: &Path) -> Vec<String> {
    OUTPUTS.iter().map(|name| std::fs::read_to_string(out.join(name)).unwrap_or_default()).collect()
}

fn lines(out: &Path, name: &str) -> Vec<Value> {
    common::json_lines(&std::fs::read_to_string(out.join(name)).unwrap())
}

/// How many requests have come to a step of their way.
fn reached(out: &Path, step: &str) -> usize {
    lines(out, "strips.jsonl").iter().filter(|line| !line[step].is_null()).count()
}

#[test]
fn missions_over_the_radio_are_the_same_over_dds_in_one_process_and_flown_again() {
    let folder = tempfile::tempdir().unwrap();
    for (name, stations, orbits, seed, loss) in [
        ("one", ONE, "6.0", "1", "0.2"),
        ("three", THREE, "3.0", "2", "0.0"),
        ("seven", SEVEN, "2.0", "3", "0.2"),
        ("silent", ONE, "7.0", "1", "0.0\ncommand_loss_h = 1.5"),
        ("failing", SEVEN, "2.0", "3", FAILING),
    ] {
        let link = format!("[link]\nstations = [{stations}]\nstrip_bits = 50e6\nloss = {loss}\n");
        let mission = mission(folder.path(), name, &link);
        let out = |kind: &str| folder.path().join(format!("{name}-{kind}"));
        let words = ["--planner", "lookahead", "--orbits", orbits, "--seed", seed];
        common::succeed(&mut launch(&mission, &out("in-process"), &[&words[..], &["--in-process"]].concat()));
        common::succeed(&mut launch(&mission, &out("dds"), &words));
        assert_eq!(outputs(&out("dds")), outputs(&out("in-process")), "{name}");
        for step in ["uplinked_tick", "acknowledged_tick", "imaged_tick", "known_tick", "delivered_tick"] {
            assert!(reached(&out("dds"), step) > 0, "{name}: nothing has come to {step}");
        }
        let silent = outputs(&out("dds"))[2].contains("ground silent");
        assert_eq!(silent, name == "silent", "{name}");
        if name == "failing" {
            for (alarm, times) in [("link lost", 4), ("catalogue lost", 4), ("frames lost", 2)] {
                let told = lines(&out("dds"), "alarms.jsonl");
                assert_eq!(told.iter().filter(|it| it["name"] == alarm).count(), times, "{alarm}: {told:?}");
            }
        }
        let summary = |kind: &str| -> Value {
            serde_json::from_str(&std::fs::read_to_string(out(kind).join("summary.json")).unwrap()).unwrap()
        };
        assert_eq!(summary("dds")["link"], summary("in-process")["link"], "{name}");
        common::succeed(common::swath("0", &["refly"]).arg(out("dds").join("bag")));
    }
}

/// All that a node knows follows from what it has taken in, and that is kept: not even a tick is flown otherwise.
#[test]
fn whoever_of_the_radio_is_killed_nothing_is_lost_doubled_or_even_different() {
    let folder = tempfile::tempdir().unwrap();
    let link = format!("[link]\nstations = [{SEVEN}]\nstrip_bits = 50e6\nloss = 0.1\nuplink_bps = 4000\n");
    let mission = mission(folder.path(), "killed", &link);
    let words = ["--planner", "lookahead", "--orbits", "12.0", "--seed", "4"];
    let (alone, killed) = (folder.path().join("alone"), folder.path().join("killed"));
    common::succeed(&mut launch(&mission, &alone, &[&words[..], &["--in-process"]].concat()));
    let mut flight = common::Running::start(&mut launch(&mission, &killed, &words));
    let tasks = || std::fs::read_to_string(killed.join("tasks.jsonl")).unwrap_or_default().lines().count();
    for program in ["swath-link", "swath-catalogue", "swath-requests", "swath-catalogue", "swath-link"] {
        let before = tasks();
        common::until("more tasks", || (tasks() > before + 5).then_some(()));
        let pid = common::until(program, || process(program, &killed));
        kill_process(pid, Signal::KILL).unwrap();
        common::until("another one", || process(program, &killed).filter(|&other| other != pid));
    }
    assert!(flight.wait().success());
    assert_eq!(outputs(&killed)[..2], outputs(&alone)[..2]);
    for node in ["link", "catalogue", "request_manager"] {
        let name = format!("{node} lost");
        assert!(lines(&killed, "alarms.jsonl").iter().any(|it| it["name"] == name.as_str()), "{name}");
    }
    // Whoever was started again was recorded from its first word on.
    common::succeed(common::swath("0", &["refly"]).arg(killed.join("bag")));
}

#[test]
fn a_peer_that_doubles_reorders_and_damages_what_is_sent_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let link = format!("[link]\nstations = [{SEVEN}]\nstrip_bits = 50e6\nloss = 0.1\n");
    let mission = mission(folder.path(), "disturbed", &link);
    let words = ["--planner", "lookahead", "--orbits", "4.0", "--seed", "5", "--no-bag"];
    let (alone, disturbed) = (folder.path().join("alone"), folder.path().join("disturbed"));
    common::succeed(&mut launch(&mission, &alone, &[&words[..], &["--in-process"]].concat()));
    let domain = common::domain();
    let said = folder.path().join("peer.json");
    let mut peer = common::python("radio_peer.py", &domain);
    let mut peer = common::Running::start(peer.stdout(std::fs::File::create(&said).unwrap()));
    let mut flight = common::command("swath", &domain);
    common::succeed(flight.arg("launch").arg(&mission).arg("--out").arg(&disturbed).args(words));
    peer.stop();
    assert_eq!(outputs(&disturbed)[..2], outputs(&alone)[..2]);
    let said: Value = serde_json::from_str(&std::fs::read_to_string(&said).unwrap()).unwrap();
    assert!(said["sent"].as_u64().unwrap() > 1000, "{said}");
    assert!(said["heard"].as_object().unwrap().values().all(|count| count.as_u64().unwrap() > 10), "{said}");
}

#[test]
fn the_ground_says_what_the_satellite_is_going_to_do_and_when_that_will_be_known() {
    let folder = tempfile::tempdir().unwrap();
    let link = format!("[link]\nstations = [{THREE}]\nstrip_bits = 50e6\nprediction_h = 6.0\n");
    let mission = mission(folder.path(), "foreseen", &link);
    let (out, domain) = (folder.path().join("out"), common::domain());
    let words = ["--planner", "lookahead", "--orbits", "12.0", "--seed", "2", "--no-bag"];
    let mut launch = common::command("swath", &domain);
    let mut flight = launch.arg("launch").arg(&mission).arg("--out").arg(&out).args(words).spawn().unwrap();
    let ask = |words: &[&str]| {
        let output = common::run(&mut common::swath(&domain, words));
        output.status.success().then(|| serde_json::from_slice::<Value>(&output.stdout).unwrap())
    };
    let plan = common::until("a plan", || ask(&["link", "plan", "--json"]));
    let tasks = plan["tasks"].as_array().unwrap();
    assert!(tasks.len() > 10, "{plan}");
    let last = tasks.iter().rfind(|task| task["success"] == true && !task["known_tick"].is_null()).unwrap();
    let way = ask(&["strips", "show", &last["strip"].to_string(), "--json"]).unwrap()["way"].clone();
    let step = |name: &str| {
        [&way[name], &way["predicted"][name]].into_iter().find(|it| !it.is_null()).unwrap()["tick"].clone()
    };
    assert_eq!((&step("imaged"), &step("known")), (&last["end_tick"], &last["known_tick"]), "{way}");
    assert!(flight.wait().unwrap().success());
    let flown = lines(&out, "tasks.jsonl");
    for task in tasks {
        let flown = &flown[task["task"].as_u64().unwrap() as usize];
        for name in ["strip", "start_tick", "end_tick"] {
            assert_eq!(task[name], flown[name], "{task} and {flown}");
        }
        assert_eq!(task["success"].as_bool(), Some(flown["reason"].is_null()), "{task} and {flown}");
    }
    assert_eq!(plan["partings"], 0);
}

#[test]
fn with_a_link_that_never_opens_the_ground_shows_nothing_newer() {
    let folder = tempfile::tempdir().unwrap();
    let mission = mission(folder.path(), "never", "orbits = 20.0\npace = 400.0\n[link]\nstations = [\"svalbard\"]\n");
    let (out, domain) = (folder.path().join("out"), common::domain());
    let mut command = common::command("swath", &domain);
    let mut flight = common::Running::start(command.arg("launch").arg(&mission).arg("--out").arg(&out));
    common::until("some tasks", || {
        (std::fs::read_to_string(out.join("tasks.jsonl")).ok()?.lines().count() > 5).then_some(())
    });
    let listed = || common::json_lines(&common::succeed(&mut common::swath(&domain, &["strips", "list", "--json"])));
    let states: std::collections::BTreeSet<String> = listed().iter().map(|it| it["state"].to_string()).collect();
    assert_eq!(states.into_iter().collect::<Vec<_>>(), ["\"accepted\""]);
    // What is asked waits for a pass, and the planner on board cannot be asked at all.
    common::succeed(&mut common::swath(&domain, &["strips", "cancel", "1", "--reason", "test"]));
    assert_eq!(listed()[0]["state"], "accepted");
    assert!(!common::run(&mut common::swath(&domain, &["planner", "mode", "hold"])).status.success());
    flight.stop();
    assert!(lines(&out, "tasks.jsonl").iter().all(|it| it["strip"].is_null()));
    assert_eq!(reached(&out, "uplinked_tick"), 0);
}
