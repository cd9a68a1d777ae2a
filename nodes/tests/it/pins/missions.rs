//! Missions: what each planner does, with files of requests, conditions, approval, another satellite.

use std::fmt::Write as _;

use serde_json::Value;

use crate::pins::golden;
use crate::pins::place::{Place, sha256};

/// Missions by hand-written planners: file in `missions/`, and options.
const HAND_WRITTEN: &[&str] = &[
    "short.toml",
    "short.toml --planner random",
    "short.toml --planner random --seed 2",
    "short.toml --planner heuristic:62.5 --seed 3 --orbits 0.5",
    "short.toml --planner lookahead --seed 4 --requests 4000",
    "crowded.toml",
    "crowded.toml --planner lookahead:4 --seed 2",
    "crowded.toml --planner beam --seed 3",
    "crowded.toml --planner beam:4x2 --seed 4",
    "sparse.toml",
    "sparse.toml --planner random --seed 2",
    "conditions.toml",
    "conditions.toml --planner heuristic:40 --seed 6",
    "conditions.toml --planner beam --seed 7",
    "bidirectional.toml",
    "bidirectional.toml --planner heuristic:70 --seed 4",
    "other_satellite.toml",
    "other_satellite.toml --planner random --seed 10",
];

/// Missions by policies, with the kernels that [`Place`] chooses.
const POLICIES: &[&str] = &[
    "short.toml --planner hop-ppo",
    "crowded.toml --planner hop-ppo --seed 2",
    "sparse.toml --planner hop-ppo --seed 3",
    "conditions.toml --planner hop-ppo --seed 4",
    "crowded.toml --planner hop-ppo-mlp",
    "short.toml --planner hop-ppo-mlp --seed 2",
    "crowded.toml --planner h-ppo",
    "bidirectional.toml --planner h-ppo --seed 2",
    "crowded.toml --planner discrete-ppo",
    "sparse.toml --planner discrete-ppo --seed 2",
    "short.toml --planner hop-ppo+lookahead",
    "bidirectional.toml --planner hop-ppo+lookahead --seed 2",
    "short.toml --planner h-ppo+lookahead --seed 3",
];

/// What is left of a summary that is the same in every run.
fn summary(place: &Place, out: &str) -> String {
    let mut summary: Value = serde_json::from_str(&place.read(&format!("{out}/summary.json"))).unwrap();
    for measured in ["wall_seconds", "real_time_factor", "messages_recorded", "nodes"] {
        assert!(summary.as_object_mut().unwrap().remove(measured).is_some(), "{measured}: {summary}");
    }
    summary.to_string()
}

/// Flies a mission and appends what came of it.
fn fly(place: &Place, mission: &str, more: &str, text: &mut String) {
    let out = "out";
    let line = format!("swath launch <pins>/missions/{mission} {more}");
    place.succeed(&format!("{line} --out {out}"));
    let tasks = place.read(&format!("{out}/tasks.jsonl"));
    let lines: Vec<Value> = tasks.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    // What was decided, without what depends on the last bits.
    let choices: String = lines.iter().map(|line| format!("{} {}\n", line["strip"], line["success"])).collect();
    _ = writeln!(text, "$ {line}");
    _ = writeln!(text, "summary {}", summary(place, out));
    _ = writeln!(text, "requests {}", sha256(place.read(&format!("{out}/requests.geojson"))));
    _ = writeln!(text, "choices of {} tasks {}", lines.len(), sha256(choices));
    _ = writeln!(text, "tasks {}", sha256(tasks));
    if place.path(out).join("strips.jsonl").exists() {
        _ = writeln!(text, "ways {}", sha256(place.read(&format!("{out}/strips.jsonl"))));
    }
    text.push('\n');
    std::fs::remove_dir_all(place.path(out)).unwrap();
}

fn in_process(missions: &[&str]) -> String {
    let place = Place::new();
    let mut text = String::new();
    for mission in missions {
        fly(&place, mission, "--in-process", &mut text);
    }
    text
}

#[test]
fn missions_by_hand_written_planners() {
    golden::check("missions/hand_written.txt", &in_process(HAND_WRITTEN));
}

#[test]
fn missions_by_policies() {
    golden::check("missions/policies.txt", &in_process(POLICIES));
}

#[test]
fn missions_over_the_radio() {
    let mut text =
        in_process(&["radio.toml", "radio.toml --planner beam --seed 2", "radio.toml --planner heuristic:80 --seed 3"]);
    let passes = "swath passes <pins>/missions/radio.toml --hours 12";
    _ = writeln!(text, "$ {passes}\n{}", Place::new().succeed(passes));
    golden::check("missions/radio.txt", &text);
}

/// The files that a mission leaves say all that was flown, every default included; the beginning of each.
#[test]
fn files_of_a_mission() {
    let place = Place::new();
    place.succeed("swath launch <pins>/missions/conditions.toml --orbits 0.1 --requests 2 --in-process --out out");
    let mut text = String::new();
    for name in ["mission.toml", "requests.geojson", "tasks.jsonl"] {
        let file = place.read(&format!("out/{name}"));
        let beginning: Vec<&str> = file.lines().take(60).collect();
        _ = writeln!(text, "# {name}\n{}\n", beginning.join("\n"));
    }
    golden::check("missions/files.txt", &text);
}

/// Over DDS the planner node waits for approval; in process nobody is asked.
#[test]
fn missions_that_wait_for_approval() {
    let place = Place::with_domain();
    let mut text = String::new();
    for mission in ["approval.toml", "approval.toml --planner lookahead --seed 3"] {
        fly(&place, mission, "--no-bag", &mut text);
        fly(&place, mission, "--in-process", &mut text);
    }
    golden::check("missions/approval.txt", &text);
}
