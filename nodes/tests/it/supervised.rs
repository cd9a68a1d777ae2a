//! Nodes that are killed, hang or lose their launcher: another one goes on where they were, or the mission says why not.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

use crate::common;

/// The programs of a mission.
pub const NODES: [&str; 5] = ["swath-spacecraft", "swath-guidance", "swath-planner", "swath-requests", "swath-bag"];

/// The process of a program that works for the mission in a folder.
pub fn process(program: &str, out: &Path) -> Option<Pid> {
    let out = out.display().to_string();
    let of = |entry: std::io::Result<std::fs::DirEntry>| {
        let pid: i32 = entry.ok()?.file_name().to_str()?.parse().ok()?;
        let words = std::fs::read(format!("/proc/{pid}/cmdline")).ok()?;
        let words: Vec<String> = words.split(|&byte| byte == 0).map(|it| String::from_utf8_lossy(it).into()).collect();
        let ours = words.first()?.ends_with(program) && words.iter().any(|word| word.contains(&out));
        ours.then_some(pid)
    };
    std::fs::read_dir("/proc").unwrap().filter_map(of).last().and_then(Pid::from_raw)
}

/// The tasks that were flown.
pub fn tasks(out: &Path) -> Vec<Value> {
    let text = std::fs::read_to_string(out.join("tasks.jsonl")).unwrap_or_default();
    common::json_lines(&text[..text.rfind('\n').map_or(0, |end| end + 1)])
}

/// What happened to alarms.
pub fn journal(out: &Path) -> Vec<Value> {
    common::json_lines(&std::fs::read_to_string(out.join("alarms.jsonl")).unwrap_or_default())
}

/// What happened to an alarm.
fn events(out: &Path, name: &str) -> Vec<String> {
    let of = |it: &Value| (it["name"] == name).then(|| it["event"].as_str().unwrap().to_owned());
    journal(out).iter().filter_map(of).collect()
}

/// Waits until the mission has flown some tasks more.
pub fn until_it_flies(out: &Path) {
    let before = tasks(out).len();
    common::until("more tasks", || (tasks(out).len() > before + 2).then_some(()));
}

pub fn launch(domain: &str, mission: &Path, out: &Path) -> Command {
    let mut launch = common::command("swath", domain);
    launch.arg("launch").arg(mission).arg("--out").arg(out);
    launch
}

pub fn validate(bag: &Path) -> String {
    let mut validate = common::command("swath-bag", "0");
    common::succeed(validate.arg("validate").arg(bag))
}

#[test]
fn whichever_node_is_killed_or_stopped_another_one_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let text = "orbits = 60.0\npace = 200.0\nseed = 5\nplanner = \"heuristic:90\"\n[requests.random]\n\
                count = [3000, 3000]\n";
    let mission = common::write_mission(folder.path(), text);
    let out = folder.path().join("out");
    let mut flight = common::Running::start(&mut launch(&common::domain(), &mission, &out));
    common::until("the first task", || (!tasks(&out).is_empty()).then_some(()));
    for (number, program) in NODES.iter().chain(&["swath-guidance"]).enumerate() {
        // The last one is stopped, which is no end.
        let signal = if number == NODES.len() { Signal::STOP } else { Signal::KILL };
        let pid = common::until(program, || process(program, &out));
        kill_process(pid, signal).unwrap();
        let killed = Instant::now();
        common::until("another one", || process(program, &out).filter(|&other| other != pid));
        println!("{program}: another process after {:.2} s", killed.elapsed().as_secs_f64());
        until_it_flies(&out);
        println!("{program}: three more tasks after {:.2} s", killed.elapsed().as_secs_f64());
    }
    flight.stop();
    let numbers: Vec<u64> = tasks(&out).iter().map(|it| it["task"].as_u64().unwrap()).collect();
    assert_eq!(numbers, (0..numbers.len() as u64).collect::<Vec<_>>());
    let imaged: Vec<_> =
        tasks(&out).iter().filter(|it| it["success"] == true).filter_map(|it| it["strip"].as_u64()).collect();
    assert_eq!(imaged.iter().collect::<BTreeSet<_>>().len(), imaged.len(), "imaged twice: {imaged:?}");
    let journal = journal(&out);
    for node in ["spacecraft", "guidance", "planner", "request_manager", "recorder"] {
        let name = format!("{node} lost");
        let of: Vec<&str> =
            journal.iter().filter(|it| it["name"] == name.as_str()).map(|it| it["event"].as_str().unwrap()).collect();
        let times = if node == "guidance" { 2 } else { 1 };
        assert_eq!(of, ["raised", "returned"].repeat(times), "{name}");
    }
    let told = validate(&out.join("bag"));
    assert!(told.contains("the recording was interrupted"), "{told}");
    let mut info = common::command("swath-bag", "0");
    let info = common::succeed(info.args(["info"]).arg(out.join("bag")));
    assert!(info.contains("bag_1.mcap"), "{info}");
}

#[test]
fn a_node_that_is_silent_for_a_while_is_warned_of_and_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let text = "orbits = 60.0\npace = 200.0\nseed = 5\nplanner = \"heuristic:90\"\n";
    let mission = common::write_mission(folder.path(), text);
    let out = folder.path().join("out");
    let mut flight = common::Running::start(launch(&common::domain(), &mission, &out).arg("--no-bag"));
    until_it_flies(&out);
    let pid = common::until("guidance", || process("swath-guidance", &out));
    kill_process(pid, Signal::STOP).unwrap();
    let stopped = Instant::now();
    common::until("the warning", || (!events(&out, "guidance silent").is_empty()).then_some(()));
    println!("warned after {:.2} s", stopped.elapsed().as_secs_f64());
    kill_process(pid, Signal::CONT).unwrap();
    common::until("the end of the warning", || (events(&out, "guidance silent").len() > 1).then_some(()));
    until_it_flies(&out);
    flight.stop();
    assert_eq!(events(&out, "guidance silent"), ["raised", "returned"]);
    assert!(events(&out, "guidance lost").is_empty());
    let journal = journal(&out);
    let warned = journal.iter().find(|it| it["name"] == "guidance silent").unwrap();
    assert_eq!(warned["severity"], "warn");
}

#[test]
fn a_planner_that_is_lost_again_and_again_leads_to_safe_mode_until_an_operator_ends_it() {
    let folder = tempfile::tempdir().unwrap();
    let text = "orbits = 60.0\npace = 200.0\nseed = 5\nplanner = \"heuristic:90\"\n[requests.random]\n\
                count = [3000, 3000]\n[supervision]\nstarts = 1\n";
    let mission = common::write_mission(folder.path(), text);
    let (out, domain) = (folder.path().join("out"), common::domain());
    let mut flight = common::Running::start(launch(&domain, &mission, &out).arg("--no-bag"));
    common::until("the first task", || (!tasks(&out).is_empty()).then_some(()));
    for _ in 0..2 {
        let pid = common::until("the planner", || process("swath-planner", &out));
        until_it_flies(&out);
        kill_process(pid, Signal::KILL).unwrap();
        common::until("another one", || process("swath-planner", &out).filter(|&other| other != pid));
    }
    let holds = |it: &Value| it["strip"] == Value::Null;
    common::until("the attitude held", || {
        let tasks = tasks(&out);
        (tasks.len() > 5 && tasks[tasks.len() - 5..].iter().all(holds)).then_some(())
    });
    common::succeed(&mut common::swath(&domain, &["planner", "mode", "autonomous"]));
    let held = tasks(&out).len();
    common::until("imaging again", || {
        tasks(&out)[held..].iter().any(|it| it["success"] == true && !holds(it)).then_some(())
    });
    common::until("the end of safe mode", || (events(&out, "safe mode").len() == 2).then_some(()));
    flight.signal(Signal::INT);
    assert_eq!(flight.wait().code(), Some(4));
    assert_eq!(events(&out, "safe mode"), ["raised", "returned"]);
    let journal = journal(&out);
    let safe = journal.iter().find(|it| it["name"] == "safe mode").unwrap();
    assert_eq!((&safe["event"], &safe["severity"]), (&"raised".into(), &"critical".into()));
}

#[test]
fn without_their_launcher_nodes_fly_on_for_a_while_and_end_cleanly() {
    let folder = tempfile::tempdir().unwrap();
    let text = "orbits = 60.0\npace = 200.0\nplanner = \"heuristic:90\"\n[supervision]\norphaned_s = 3.0\n";
    let mission = common::write_mission(folder.path(), text);
    let out = folder.path().join("out");
    let mut flight = common::Running::start(&mut launch(&common::domain(), &mission, &out));
    common::until("the first task", || (!tasks(&out).is_empty()).then_some(()));
    flight.kill();
    std::thread::sleep(Duration::from_secs(1));
    assert!(NODES.iter().all(|program| process(program, &out).is_some()), "they fly on");
    common::until("the end of all", || NODES.iter().all(|program| process(program, &out).is_none()).then_some(()));
    validate(&out.join("bag"));
}
