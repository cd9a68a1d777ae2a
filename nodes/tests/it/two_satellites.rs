//! Two satellites side by side in one domain, each in a namespace of its own.

use std::path::Path;

use serde_json::Value;

use crate::common::{self, json_lines, succeed, swath};

const MISSION: &str = "orbits = 1.0\nplanner = \"heuristic:80\"\n[requests.random]\ncount = [1500, 1500]\n";

fn tasks(out: &Path) -> String {
    std::fs::read_to_string(out.join("tasks.jsonl")).unwrap()
}

#[test]
fn two_satellites_fly_side_by_side_as_if_each_were_alone() {
    let folder = tempfile::tempdir().unwrap();
    let mission = common::write_mission(folder.path(), MISSION);
    let mission = mission.to_str().unwrap();
    let domain = common::domain();
    let out = |name: &str| folder.path().join(name);
    let fly = |name: &str, seed: &str, words: &[&str]| {
        let mut launch = swath(&domain, &["launch", mission, "--seed", seed, "--out", out(name).to_str().unwrap()]);
        launch.args(words);
        launch
    };
    let mut first = common::Running::start(&mut fly("sat1", "1", &["--namespace", "/sat1"]));
    succeed(&mut fly("sat2", "2", &["--ros-args", "-r", "__ns:=/sat2"]));
    assert!(first.wait().success());
    for (name, seed) in [("sat1", "1"), ("sat2", "2")] {
        let alone = format!("{name}_alone");
        succeed(&mut fly(&alone, seed, &["--in-process"]));
        assert_eq!(tasks(&out(name)), tasks(&out(&alone)), "{name}");
        let bag = out(name).join("bag");
        // The namespace is in the bag's manifest.
        succeed(swath("0", &["refly"]).arg(&bag));
        let cat = |topic: &str| {
            let mut cat = common::command("swath-bag", "0");
            json_lines(&succeed(cat.arg("cat").arg(&bag).args(["--topic", topic])))
        };
        assert!(cat(&format!("/{name}/clock")).len() > 1000);
        let other = if name == "sat1" { "/sat2/" } else { "/sat1/" };
        let info = succeed(common::command("swath-bag", "0").arg("info").arg(&bag));
        assert!(info.contains(&format!("/{name}/spacecraft/state")) && !info.contains(other), "{info}");
        let shared = common::fail(common::command("swath-bag", "0").arg("cat").arg(&bag).args(["--topic", "/clock"]));
        assert!(shared.contains("the bag has no topic /clock"), "{shared}");
        let frame = |message: &Value| message["message"]["transforms"][0]["child_frame_id"].clone();
        let frames: std::collections::BTreeSet<_> = cat("/tf").iter().map(|tf| frame(tf).to_string()).collect();
        assert!(frames.contains(&format!("\"{name}/body\"")), "{frames:?}");
    }
}

#[test]
fn operators_reach_the_satellite_that_they_mean() {
    let folder = tempfile::tempdir().unwrap();
    let mission = common::write_mission(folder.path(), &format!("pace = 100.0\n{MISSION}"));
    let domain = common::domain();
    let fly = |name: &str, seed: &str| {
        let mut launch = swath(&domain, &["launch", mission.to_str().unwrap(), "--no-bag", "--seed", seed]);
        launch.args(["--namespace", &format!("/{name}"), "--out"]).arg(folder.path().join(name));
        common::Running::start(&mut launch)
    };
    let (mut first, mut second) = (fly("sat1", "1"), fly("sat2", "2"));
    let status = |name: &str| {
        let words = ["planner", "status", "--json", "--namespace", &format!("/{name}")];
        let told = common::run(&mut swath(&domain, &words));
        told.status.success().then(|| json_lines(&String::from_utf8(told.stdout).unwrap())[0]["mode"].clone())
    };
    common::until("the first planner", || status("sat1"));
    let mut hold = swath(&domain, &["planner", "mode", "hold", "--ros-args", "-r", "__ns:=/sat2"]);
    assert_eq!(succeed(&mut hold), "mode hold\n");
    assert_eq!((status("sat1"), status("sat2")), (Some("autonomous".into()), Some("hold".into())));
    let strips = |name: &str| {
        let words = ["strips", "list", "--limit", "0", "--json", "--namespace", &format!("/{name}")];
        json_lines(&succeed(&mut swath(&domain, &words)))
    };
    // Of other seeds.
    let (strips_of_first, strips_of_second) = (strips("sat1"), strips("sat2"));
    assert!(strips_of_first.len() > 100 && strips_of_second.len() > 100);
    assert_ne!(strips_of_first, strips_of_second);
    first.stop();
    second.stop();
}
