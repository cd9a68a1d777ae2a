//! Messages that are dropped, a store and a bag without room: the satellite flies on, what was acknowledged is kept, and
//! all is as before once it is over.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::common;

fn text(out: &Path, name: &str) -> String {
    std::fs::read_to_string(out.join(name)).unwrap_or_default()
}

fn events(out: &Path, name: &str) -> Vec<String> {
    let lines = common::json_lines(&text(out, "alarms.jsonl"));
    lines.iter().filter(|it| it["name"] == name).map(|it| it["event"].as_str().unwrap().to_owned()).collect()
}

fn launch(domain: &str, mission: &Path, out: &Path) -> Command {
    let mut launch = common::swath(domain, &["launch"]);
    launch.arg(mission).arg("--out").arg(out);
    launch
}

#[test]
fn tasks_and_alarms_are_those_of_one_process_and_bag_and_store_are_whole() {
    let folder = tempfile::tempdir().unwrap();
    let text_of = "orbits = 0.3\nseed = 3\nplanner = \"lookahead\"\n[requests.random]\ncount = [1500, 1500]\n[faults]\n\
                   plan = [\"topic:drop 20%@100s+60s\", \"store:full@300s+400s\", \"bag:full@900s+100s\", \
                   \"store:full@1200s\"]\n";
    let mission = common::write_mission(folder.path(), text_of);
    let (dds, alone) = (folder.path().join("dds"), folder.path().join("alone"));
    common::succeed(&mut launch(&common::domain(), &mission, &dds));
    common::succeed(launch("0", &mission, &alone).arg("--in-process"));
    assert_eq!(text(&dds, "tasks.jsonl"), text(&alone, "tasks.jsonl"));
    assert_eq!(text(&dds, "alarms.jsonl"), text(&alone, "alarms.jsonl"));
    for (name, times) in [("messages dropped", 1), ("bag full", 1)] {
        assert_eq!(events(&dds, name), ["raised", "returned"].repeat(times), "{name}");
    }
    assert_eq!(events(&dds, "store full"), ["raised", "returned", "raised"], "the last one stays");
    let mut validate = common::command("swath-bag", "0");
    common::succeed(validate.arg("validate").arg(dds.join("bag")));
    // What could not be written by then was written at the end.
    let trail = common::succeed(
        common::command("swath", "0").args(["strips", "export", "--trail", "--store"]).arg(dds.join("requests.sqlite")),
    );
    let completed = common::json_lines(&trail).iter().filter(|it| it["state"] == "completed").count();
    let imaged = common::json_lines(&text(&dds, "tasks.jsonl")).iter().filter(|it| it["success"] == true).count();
    assert!(completed >= imaged && imaged > 5, "{completed} of {imaged}");
}

#[test]
fn a_store_without_room_takes_nothing_and_loses_nothing_while_the_satellite_flies_on() {
    let folder = tempfile::tempdir().unwrap();
    let mission_text = "orbits = 60.0\npace = 200.0\nseed = 5\nplanner = \"heuristic:90\"\n[requests.random]\n\
                        count = [3000, 3000]\n";
    let mission = common::write_mission(folder.path(), mission_text);
    let (out, domain) = (folder.path().join("out"), common::domain());
    let mut flight = common::Running::start(&mut launch(&domain, &mission, &out));
    let tasks = || text(&out, "tasks.jsonl").lines().count();
    common::until("tasks", || (tasks() > 2).then_some(()));
    let coasts = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/requests/coasts.geojson");
    let submit = || common::run(&mut common::swath(&domain, &["strips", "submit", coasts, "--json"]));
    common::succeed(&mut common::swath(&domain, &["fault", "store:full+4000s"]));
    common::until("the alarm", || (!events(&out, "store full").is_empty()).then_some(()));
    let refused = common::until("a refusal", || {
        let output = submit();
        let said = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
        (!output.status.success() && said.contains("123")).then_some(said)
    });
    assert!(refused.contains("there is no room where requests are kept"), "{refused}");
    let before = tasks();
    common::until("more tasks", || (tasks() > before + 3).then_some(()));
    assert_eq!(events(&out, "store full"), ["raised"], "it flies on while there is no room");
    common::until("room", || (events(&out, "store full").len() == 2).then_some(()));
    let taken = common::until("a submission", || {
        let output = submit();
        output.status.success().then(|| String::from_utf8(output.stdout).unwrap())
    });
    flight.stop();
    assert!(taken.contains("accepted"), "{taken}");
    let kept = common::succeed(
        common::command("swath", "0").args(["strips", "export", "--store"]).arg(out.join("requests.sqlite")),
    );
    let kept: Value = serde_json::from_str(&kept).unwrap();
    let completed = |it: &&Value| it["properties"]["state"] == "completed";
    let completed = kept["features"].as_array().unwrap().iter().filter(completed).count();
    let lines = common::json_lines(&text(&out, "tasks.jsonl"));
    let imaged = lines.iter().filter(|it| it["success"] == true).count();
    assert!(completed >= imaged && imaged > 3, "{completed} of {imaged}");
}

#[test]
fn a_fifth_of_the_messages_costs_little() {
    let folder = tempfile::tempdir().unwrap();
    let head =
        "orbits = 0.3\npace = 100.0\nseed = 5\nplanner = \"lookahead\"\n[requests.random]\ncount = [1500, 1500]\n";
    let reward = |name: &str, faults: &str| {
        let mission = common::write_mission(folder.path(), &format!("{head}{faults}"));
        let out = folder.path().join(name);
        common::succeed(launch(&common::domain(), &mission, &out).arg("--no-bag"));
        let lines = common::json_lines(&text(&out, "tasks.jsonl"));
        lines.iter().map(|it| it["reward"].as_f64().unwrap()).sum::<f64>()
    };
    let nominal = reward("nominal", "");
    let dropped = reward("dropped", "[faults]\nplan = [\"topic:drop 20%@10s+10000s\"]\n");
    println!("reward {dropped:.2} with a fifth of the messages lost, {nominal:.2} without");
    assert!(dropped > 0.9 * nominal, "{dropped} of {nominal}");
}

#[test]
fn an_output_that_cannot_be_written_costs_no_other() {
    let folder = tempfile::tempdir().unwrap();
    let text_of = "orbits = 0.4\npace = 100.0\nplanner = \"heuristic:90\"\n[requests.random]\ncount = [1500, 1500]\n\
                   [faults]\nplan = [\"wheel2:weak 60%@1000s\"]\n";
    let mission = common::write_mission(folder.path(), text_of);
    let out = folder.path().join("out");
    let mut flight = common::Running::start(launch(&common::domain(), &mission, &out).arg("--no-bag"));
    common::until("the folder", || out.join("tasks.jsonl").exists().then_some(()));
    // Where the alarms' journal goes there is something else.
    std::fs::create_dir_all(out.join("alarms.jsonl/in_the_way")).unwrap();
    assert_eq!(flight.wait().code(), Some(1));
    assert!(text(&out, "tasks.jsonl").lines().count() > 2, "what was flown is there");
    let summary: Value = serde_json::from_str(&text(&out, "summary.json")).unwrap();
    assert!(summary["failure"].as_str().unwrap().contains("alarms.jsonl"), "{summary}");
}

#[test]
fn a_mission_ends_although_its_last_messages_are_lost() {
    let folder = tempfile::tempdir().unwrap();
    for seed in 0..4 {
        let text = format!(
            "orbits = 0.1\npace = 200.0\nseed = {seed}\nplanner = \"heuristic:90\"\n[requests.random]\n\
             count = [100, 100]\n[faults]\nplan = [\"topic:drop 50%@550s+1000s\"]\n"
        );
        let mission = common::write_mission(folder.path(), &text);
        let out = folder.path().join(seed.to_string());
        common::succeed(launch(&common::domain(), &mission, &out).arg("--no-bag"));
        let summary: Value = serde_json::from_str(&self::text(&out, "summary.json")).unwrap();
        assert_eq!(summary["failure"], Value::Null, "{summary}");
    }
}
