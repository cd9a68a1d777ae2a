//! A launcher is killed: its nodes fly on, and another launcher takes them over to the mission's end.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

use rustix::process::{Signal, kill_process};
use serde_json::Value;

use crate::common;
use crate::supervised::{NODES, journal, launch, process, tasks, until_it_flies, validate};

const MISSION: &str = "orbits = 1.5\npace = 100.0\nseed = 5\nplanner = \"heuristic:90\"\n[requests.random]\n\
                       count = [1500, 1500]\n[faults]\nplan = [\"wheel2:weak 60%@60s\"]\n";

fn attach(domain: &str, out: &Path) -> Command {
    let mut attach = common::command("swath", domain);
    attach.args(["launch", "--json", "--attach"]).arg(out);
    attach
}

/// Events of an alarm.
fn events(out: &Path, name: &str) -> Vec<String> {
    let of = journal(out).into_iter().filter(|it| it["name"] == name);
    of.map(|it| it["event"].as_str().unwrap().to_owned()).collect()
}

#[test]
fn a_mission_without_its_launcher_is_taken_over_and_ends_as_any_other() {
    let folder = tempfile::tempdir().unwrap();
    let mission = common::write_mission(folder.path(), MISSION);
    let (out, domain) = (folder.path().join("out"), common::domain());
    let mut first = common::Running::start(&mut launch(&domain, &mission, &out));
    common::until("the weak wheel", || (!events(&out, "wheel y").is_empty()).then_some(()));
    until_it_flies(&out);
    let refused = common::fail(&mut attach(&domain, &out));
    assert!(refused.contains("the launcher of this mission is there"), "{refused}");
    first.kill();
    let before = tasks(&out).len();
    std::thread::sleep(std::time::Duration::from_secs(4));
    let refused = common::fail(&mut attach("99", &out));
    assert!(refused.contains("set ROS_DOMAIN_ID"), "{refused}");
    let said = folder.path().join("said.json");
    let mut second = common::Running::start(attach(&domain, &out).stdout(std::fs::File::create(&said).unwrap()));
    until_it_flies(&out);
    assert!(NODES.iter().all(|program| process(program, &out).is_some()), "the same nodes fly on");
    assert_eq!(events(&out, "wheel y"), ["raised"], "it stands as before");
    // It supervises.
    let guidance = process("swath-guidance", &out).unwrap();
    kill_process(guidance, Signal::KILL).unwrap();
    common::until("another guidance", || process("swath-guidance", &out).filter(|&other| other != guidance));
    until_it_flies(&out);
    let status = second.wait();
    assert!(status.success(), "{status}");
    let summary: Value = serde_json::from_str(&std::fs::read_to_string(&said).unwrap()).unwrap();
    assert_eq!(summary["failure"], Value::Null, "{summary}");
    let numbers: Vec<u64> = tasks(&out).iter().map(|it| it["task"].as_u64().unwrap()).collect();
    assert!(numbers.is_sorted() && numbers.len() > before + 10, "{numbers:?}");
    assert_eq!(numbers.iter().collect::<BTreeSet<_>>().len(), numbers.len(), "each once: {numbers:?}");
    let imaged: Vec<_> = tasks(&out).iter().filter(|it| it["success"] == true).map(|it| it["strip"].clone()).collect();
    let fulfilled = summary["fulfilled"].as_u64();
    assert_eq!(fulfilled, Some(imaged.len() as u64), "what was imaged without a launcher counts, too: {summary}");
    assert_eq!(events(&out, "wheel y").last().unwrap(), "raised", "another guidance has found it, too");
    assert_eq!(events(&out, "guidance lost"), ["raised", "returned"]);
    assert!(NODES.iter().all(|program| process(program, &out).is_none()), "all have ended");
    validate(&out.join("bag"));
}

#[test]
fn a_mission_whose_nodes_have_ended_without_a_launcher_goes_on_where_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let mission = common::write_mission(folder.path(), &format!("{MISSION}[supervision]\norphaned_s = 1.0\n"));
    let (out, domain) = (folder.path().join("out"), common::domain());
    let mut first = common::Running::start(launch(&domain, &mission, &out).arg("--no-bag"));
    common::until("the first task", || (!tasks(&out).is_empty()).then_some(()));
    until_it_flies(&out);
    first.kill();
    common::until("the end of all", || NODES.iter().all(|program| process(program, &out).is_none()).then_some(()));
    let end = |tasks: &[Value]| tasks.last().unwrap()["end_tick"].as_u64().unwrap();
    let before = end(&tasks(&out));
    common::succeed(&mut attach(&domain, &out));
    let tasks = tasks(&out);
    assert!(end(&tasks) > before);
    assert!(tasks.windows(2).all(|pair| pair[0]["end_tick"].as_u64() <= pair[1]["start_tick"].as_u64()), "{tasks:?}");
}
