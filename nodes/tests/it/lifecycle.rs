//! Nodes under management: what each does while it rests, that it goes on afterwards, and what is refused. The manager is
//! an outside ROS 2 peer (CycloneDDS).

use std::path::Path;
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use swath_msgs::swath_msgs as msg;
use swath_ros::{Environment, Node, RosArgs, Subscription, graph};

use crate::common;
use crate::supervised::{journal, tasks, until_it_flies};

const TIMEOUT: Duration = Duration::from_secs(60);
const MISSION: &str = "orbits = 60.0\npace = 200.0\nseed = 5\nplanner = \"heuristic:90\"\n[requests.random]\n\
                       count = [3000, 3000]\n";

fn client(domain: &str) -> Node {
    let environment =
        Environment { domain: domain.parse().unwrap(), localhost_only: true, ..Environment::read().unwrap() };
    Node::start_in(environment, "operator", &RosArgs::default()).unwrap()
}

/// What the outside manager saw of a node while it asked for transitions.
fn manage(domain: &str, node: &str, transitions: &[&str]) -> Value {
    let mut manager = common::python("lifecycle.py", domain);
    serde_json::from_str(&common::succeed(manager.arg(node).args(transitions))).unwrap()
}

/// Asks for transitions that must all be done, and returns what was seen.
fn told(domain: &str, node: &str, transitions: &[&str]) -> Value {
    let seen = manage(domain, node, transitions);
    assert!(seen["steps"].as_array().unwrap().iter().all(|step| step["done"] == true), "{node}: {seen}");
    seen
}

fn holds(task: &Value) -> bool {
    task["strip"] == Value::Null
}

/// The last `count` tasks since some.
fn last(out: &Path, since: usize, count: usize) -> Option<Vec<Value>> {
    let tasks = tasks(out);
    (tasks.len() >= since + count).then(|| tasks[tasks.len() - count..].to_vec())
}

/// The satellite holds its attitude from some task on.
fn until_it_holds(out: &Path) {
    let since = tasks(out).len();
    common::until("the attitude held", || last(out, since + 1, 3).filter(|tasks| tasks.iter().all(holds)));
}

/// Strips are imaged again.
fn until_it_images(out: &Path) {
    let since = tasks(out).len();
    common::until("an image", || {
        tasks(out)[since..].iter().any(|it| it["success"] == true && !holds(it)).then_some(())
    });
}

#[test]
fn each_node_rests_and_goes_on_when_a_manager_tells_it_to() {
    let folder = tempfile::tempdir().unwrap();
    let mission = common::write_mission(folder.path(), MISSION);
    let (out, domain) = (folder.path().join("out"), common::domain());
    let mut launch = common::command("swath", &domain);
    let mut flight = common::Running::start(launch.arg("launch").arg(mission).arg("--out").arg(&out));
    common::until("the first task", || (!tasks(&out).is_empty()).then_some(()));
    let node = client(&domain);
    the_planner_rests(&domain, &node, &out);
    the_request_manager_rests(&domain, &node, &out);
    guidance_rests(&domain, &node, &out);
    the_spacecraft_rests(&domain, &node, &out);
    told(&domain, "/swath/recorder", &["deactivate"]);
    until_it_flies(&out);
    told(&domain, "/swath/recorder", &["activate"]);
    for node in ["guidance", "planner", "request_manager", "spacecraft"] {
        let ways = ["deactivate", "cleanup", "configure", "activate"];
        let seen = told(&domain, &format!("/swath/{node}"), &ways);
        let states: Vec<_> = seen["steps"].as_array().unwrap().iter().map(|step| &step["state"]).collect();
        assert_eq!(states, ["inactive", "unconfigured", "inactive", "active"], "{node}");
        until_it_images(&out);
    }
    drop(node);
    flight.stop();
    let numbers: Vec<u64> = tasks(&out).iter().map(|it| it["task"].as_u64().unwrap()).collect();
    assert_eq!(numbers, (0..numbers.len() as u64).collect::<Vec<_>>());
    let lost: Vec<_> = journal(&out).into_iter().filter(|it| it["name"].as_str().unwrap().ends_with(" lost")).collect();
    assert_eq!(lost, Vec::<Value>::new(), "nobody was started again");
    the_recorder_has_a_gap(&out.join("bag"));
}

fn the_planner_rests(domain: &str, node: &Node, out: &Path) {
    let seen = manage(domain, "/swath/planner", &["activate", "fly", "deactivate", "deactivate"]);
    assert_eq!(seen["before"], "active", "it comes up active by itself");
    let done: Vec<_> = seen["steps"].as_array().unwrap().iter().map(|step| &step["done"]).collect();
    assert_eq!(done, [false, false, true, false], "{seen}");
    let events =
        json!([[4, "deactivate", "active", "deactivating"], [40, "transition_success", "deactivating", "inactive"]]);
    assert_eq!((&seen["steps"][0]["events"], &seen["steps"][2]["events"]), (&json!([]), &events));
    let available = json!([[4, "deactivate", "active", "deactivating"], [7, "shutdown", "active", "shuttingdown"]]);
    assert_eq!((&seen["available"], seen["graph"].as_array().unwrap().len()), (&available, 25));
    assert_eq!(seen["states"].as_array().unwrap().len(), 11);
    until_it_holds(out);
    let set = node.client(&graph::SET_PLANNER_MODE).unwrap();
    node.wait_for_service(&set, TIMEOUT).unwrap();
    let answer = set.call(msg::SetPlannerModeRequest::default(), TIMEOUT).unwrap();
    assert_eq!((answer.accepted, answer.reason.as_str()), (false, "the planner is inactive"));
    told(domain, "/swath/planner", &["activate"]);
    until_it_images(out);
}

fn the_request_manager_rests(domain: &str, node: &Node, out: &Path) {
    let submit = node.client(&graph::SUBMIT_STRIPS).unwrap();
    let list = node.client(&graph::LIST_STRIPS).unwrap();
    node.wait_for_service(&submit, TIMEOUT).unwrap();
    node.wait_for_service(&list, TIMEOUT).unwrap();
    let request = msg::StripRequest {
        client_ref: "rests".to_owned(),
        submitter: "manager".to_owned(),
        start_longitude_deg: 20.0,
        end_longitude_deg: 20.0,
        end_latitude_deg: 1.0,
        priority: 0.5,
        acquisition_speed: 3000.0,
        ..msg::StripRequest::default()
    };
    let submit = || submit.call(msg::SubmitStripsRequest { requests: vec![request.clone()] }, TIMEOUT).unwrap();
    told(domain, "/swath/request_manager", &["deactivate"]);
    let refused = submit();
    assert_eq!((refused.results.len(), refused.reason_code), (0, 121), "{}", refused.reason);
    assert!(refused.reason.contains("is inactive"), "{}", refused.reason);
    assert!(!list.call(msg::ListStripsRequest::default(), TIMEOUT).unwrap().strips.is_empty());
    until_it_holds(out);
    told(domain, "/swath/request_manager", &["activate"]);
    assert_eq!(submit().results[0].reason_code, 0);
    until_it_images(out);
}

fn guidance_rests(domain: &str, node: &Node, out: &Path) {
    let torques = node.subscription(&graph::WHEEL_TORQUE).unwrap();
    common::until("a torque", || torques.take().unwrap().filter(|it| it.torque != [0.0; 3]));
    told(domain, "/swath/guidance", &["deactivate"]);
    while torques.take().unwrap().is_some() {}
    let flown = tasks(out).len();
    let mut ticks = Vec::new();
    common::until("commands", || {
        while let Some(command) = torques.take().unwrap() {
            assert_eq!((command.torque, command.phase), ([0.0; 3], msg::WheelTorque::PHASE_HOLD));
            ticks.push(command.tick);
        }
        (ticks.len() > 500).then_some(())
    });
    assert!(ticks.is_sorted());
    assert!(tasks(out).len() <= flown + 1, "no task ends");
    told(domain, "/swath/guidance", &["activate"]);
    until_it_images(out);
    let interrupted = |it: &Value| it["reason"] == "interrupted" && it["task"].as_u64().unwrap() as usize >= flown;
    assert!(tasks(out).iter().any(interrupted), "what was in hand counts as interrupted");
}

fn the_spacecraft_rests(domain: &str, node: &Node, out: &Path) {
    let clock = node.subscription(&graph::CLOCK).unwrap();
    let newest = |clock: &Subscription<_>| {
        std::iter::from_fn(|| clock.take().unwrap()).map(|it: swath_msgs::rosgraph_msgs::Clock| it.clock).last()
    };
    common::until("the clock", || newest(&clock));
    told(domain, "/swath/spacecraft", &["deactivate"]);
    let stands = newest(&clock).unwrap();
    std::thread::sleep(Duration::from_secs(2));
    assert_eq!(newest(&clock), None, "the clock stands");
    told(domain, "/swath/spacecraft", &["activate"]);
    let goes_on = common::until("the clock", || clock.take().unwrap()).clock;
    let seconds = |time: &swath_msgs::builtin_interfaces::Time| f64::from(time.sec) + f64::from(time.nanosec) / 1e9;
    assert!(seconds(&goes_on) > seconds(&stands), "from where it stood");
    until_it_images(out);
}

/// Time on `/clock` is missing where the recorder rested, and nowhere else.
fn the_recorder_has_a_gap(bag: &Path) {
    let mut cat = common::command("swath-bag", "0");
    let clock = common::succeed(cat.arg("cat").arg(bag).args(["--topic", "/clock"]));
    let seconds = |it: &Value| it["time"].as_f64().unwrap();
    let times: Vec<f64> = common::json_lines(&clock).iter().map(seconds).collect();
    let gaps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).filter(|&gap| gap > 30.0).collect();
    assert_eq!(gaps.len(), 1, "{gaps:?}");
    assert!(times.is_sorted(), "the clock never steps back");
}

/// A planner alone, which does not start by itself.
fn planner_that_waits(folder: &Path, domain: &str) -> common::Running {
    let mission = format!("mission:={}", common::write_mission(folder, MISSION).display());
    let mut planner = common::command("swath-planner", domain);
    common::Running::start(planner.args(["--ros-args", "-p", &mission, "-p", "autostart:=false"]))
}

#[test]
fn a_node_that_does_not_start_by_itself_waits_for_its_manager() {
    let folder = tempfile::tempdir().unwrap();
    let domain = common::domain();
    let mut planner = planner_that_waits(folder.path(), &domain);
    let seen = manage(&domain, "/swath/planner", &["activate", "configure", "activate", "deactivate", "cleanup"]);
    let available =
        json!([[1, "configure", "unconfigured", "configuring"], [5, "shutdown", "unconfigured", "shuttingdown"]]);
    assert_eq!((&seen["before"], &seen["available"]), (&json!("unconfigured"), &available));
    let steps: Vec<_> = seen["steps"].as_array().unwrap().iter().map(|it| (&it["done"], &it["state"])).collect();
    let (yes, no) = (json!(true), json!(false));
    let [unconfigured, inactive, active] = ["unconfigured", "inactive", "active"].map(Value::from);
    let expected = [(&no, &unconfigured), (&yes, &inactive), (&yes, &active), (&yes, &inactive), (&no, &inactive)];
    assert_eq!(steps, expected, "what it knows would be lost without `keep`: {seen}");
    told(&domain, "/swath/planner", &["shutdown"]);
    assert!(planner.wait().success());
}

#[test]
#[ignore = "needs the program ros2 of a ROS 2 installation on the PATH"]
fn ros2_lifecycle_manages_a_node() {
    let folder = tempfile::tempdir().unwrap();
    let domain = common::domain();
    let mut planner = planner_that_waits(folder.path(), &domain);
    let ros2 = |words: &[&str]| {
        let mut ros2 = std::process::Command::new("ros2");
        ros2.arg("lifecycle").args(words).env("ROS_DOMAIN_ID", &domain).env("ROS_LOCALHOST_ONLY", "1");
        let output = ros2.output().unwrap();
        String::from_utf8_lossy(&output.stdout).trim().to_owned()
    };
    common::until("the node", || ros2(&["nodes"]).contains("/swath/planner").then_some(()));
    assert_eq!(ros2(&["get", "/swath/planner"]), "unconfigured [1]");
    assert!(ros2(&["set", "/swath/planner", "activate"]).starts_with("Unknown transition requested"));
    for (transition, state) in
        [("configure", "inactive [2]"), ("activate", "active [3]"), ("deactivate", "inactive [2]")]
    {
        assert_eq!(ros2(&["set", "/swath/planner", transition]), "Transitioning successful");
        assert_eq!(ros2(&["get", "/swath/planner"]), state);
    }
    assert_eq!(ros2(&["set", "/swath/planner", "shutdown"]), "Transitioning successful");
    let begin = Instant::now();
    assert!(planner.wait().success() && begin.elapsed() < TIMEOUT);
}
