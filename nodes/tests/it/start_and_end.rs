//! Nodes come up in any order and say for whom they wait; SIGTERM ends each of them cleanly and at once.

use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use rustix::process::{Signal, kill_process};
use swath_msgs::swath_msgs as msg;
use swath_ros::{Environment, Node, RosArgs, graph};

use crate::common;
use crate::supervised::{NODES, process, tasks, until_it_flies};

/// The programs of the nodes that fly.
const FLIGHT: [&str; 4] = ["swath-spacecraft", "swath-guidance", "swath-planner", "swath-requests"];

fn node(program: &str, domain: &str, mission: &Path) -> Command {
    let mut node = common::command(program, domain);
    node.args(["--ros-args", "-p", &format!("mission:={}", mission.display())]);
    node
}

/// The tasks of a mission whose nodes are started in an order, one after the other, and what the first one said.
fn fly(mission: &Path, order: [&str; 4], log: &Path) -> (BTreeMap<u64, (u64, u64)>, String) {
    let domain = common::domain();
    let environment =
        Environment { domain: domain.parse().unwrap(), localhost_only: true, ..Environment::read().unwrap() };
    let listener = Node::start_in(environment, "listener", &RosArgs::default()).unwrap();
    let points = listener.subscription(&graph::DECISION_POINT).unwrap();
    let tasks = listener.subscription(&graph::PLANNER_TASK).unwrap();
    let mut running = Vec::new();
    for (number, program) in order.into_iter().enumerate() {
        let mut node = node(program, &domain, mission);
        if number == 0 {
            node.stderr(File::create(log).unwrap());
        }
        running.push(common::Running::start(&mut node));
        std::thread::sleep(Duration::from_secs(1));
    }
    let mut flown = BTreeMap::new();
    common::until("the mission's end", || {
        while let Some(msg::ImagingTask { task, strip, t_pre_ticks, .. }) = tasks.take().unwrap() {
            flown.insert(task, (strip.id, u64::from(t_pre_ticks)));
        }
        points.take().unwrap().filter(|point| point.mission_over)
    });
    (flown, std::fs::read_to_string(log).unwrap())
}

#[test]
fn whoever_comes_first_waits_for_the_others_and_the_mission_is_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let text = "orbits = 0.4\nseed = 5\nplanner = \"heuristic:90\"\n[requests.random]\ncount = [800, 800]\n";
    let mission = common::write_mission(folder.path(), text);
    let [spacecraft, guidance, planner, requests] = FLIGHT;
    let log = folder.path().join("log");
    let (first, said) = fly(&mission, FLIGHT, &log);
    for missing in ["waits: node /swath/guidance is not there", "node /swath/planner is not there"] {
        assert!(said.contains(missing), "{said}");
    }
    assert!(first.len() > 10, "{first:?}");
    for order in [[planner, requests, guidance, spacecraft], [guidance, spacecraft, requests, planner]] {
        let (tasks, said) = fly(&mission, order, &log);
        assert_eq!(tasks, first, "{order:?}");
        assert!(said.contains("waits: node /swath/"), "{}: {said}", order[0]);
    }
}

/// How long a process takes to end after it was asked to; it must say that all is well.
fn terminate(mut child: common::Running) -> Duration {
    child.signal(Signal::TERM);
    let begin = Instant::now();
    let status = child.wait();
    assert!(status.success(), "{status}");
    begin.elapsed()
}

#[test]
fn sigterm_ends_each_node_alone_and_in_flight() {
    let folder = tempfile::tempdir().unwrap();
    let text = "orbits = 60.0\npace = 200.0\nseed = 5\nplanner = \"heuristic:90\"\n[requests.random]\n\
                count = [800, 800]\n";
    let mission = common::write_mission(folder.path(), text);
    for program in FLIGHT {
        let log = folder.path().join(program);
        let mut node = node(program, &common::domain(), &mission);
        node.args(["--log-level", "debug"]);
        let child = common::Running::start(node.stderr(File::create(&log).unwrap()));
        common::until(program, || std::fs::read_to_string(&log).unwrap().contains("the node is active").then_some(()));
        let took = terminate(child);
        println!("{program} alone: {:.2} s", took.as_secs_f64());
        assert!(took < Duration::from_secs(5), "{program} took {took:?}");
    }
    let out = folder.path().join("out");
    let mut launch = common::command("swath", &common::domain());
    let mut flight = common::Running::start(launch.arg("launch").arg(&mission).arg("--out").arg(&out));
    common::until("the first task", || (!tasks(&out).is_empty()).then_some(()));
    for program in NODES {
        let pid = common::until(program, || process(program, &out));
        kill_process(pid, Signal::TERM).unwrap();
        let begin = Instant::now();
        while process(program, &out) == Some(pid) && begin.elapsed() < Duration::from_secs(60) {
            std::thread::sleep(Duration::from_millis(5));
        }
        println!("{program} in flight: {:.2} s", begin.elapsed().as_secs_f64());
        assert!(begin.elapsed() < Duration::from_secs(5), "{program}");
        // It is started again.
        until_it_flies(&out);
    }
    flight.stop();
}

#[test]
fn a_planner_that_the_launcher_does_not_start_takes_part() {
    let folder = tempfile::tempdir().unwrap();
    let text = "orbits = 0.4\nseed = 5\nplanner = \"heuristic:90\"\n[requests.random]\ncount = [800, 800]\n";
    let mission = common::write_mission(folder.path(), text);
    let (out, alone, domain) = (folder.path().join("out"), folder.path().join("alone"), common::domain());
    let fly = |out: &Path, words: &[&str]| {
        let mut launch = common::swath(&domain, &["launch", mission.to_str().unwrap(), "--out", out.to_str().unwrap()]);
        launch.args(words);
        launch
    };
    common::succeed(&mut fly(&alone, &["--in-process"]));
    let mut flight = common::Running::start(&mut fly(&out, &["--without", "planner"]));
    common::until("the spacecraft", || process("swath-spacecraft", &out));
    std::thread::sleep(Duration::from_secs(3));
    assert!(process("swath-planner", &out).is_none() && tasks(&out).is_empty(), "time waits for it");
    // Of no fleet: its name speaks for it.
    let _planner = common::Running::start(&mut node("swath-planner", &domain, &mission));
    assert!(flight.wait().success());
    let read = |out: &Path| std::fs::read_to_string(out.join("tasks.jsonl")).unwrap();
    assert_eq!(read(&out), read(&alone));
}
