//! Nodes as ROS 2 programs deal with them: parameters that change in flight, and logs that tell more if asked.

use std::fs::File;
use std::time::Duration;

use swath_msgs::rcl_interfaces::{Parameter, ParameterType, ParameterValue, SetParameters, SetParametersRequest};
use swath_msgs::sensor_msgs::JointState;
use swath_ros::{Environment, Node, RosArgs, Subscription, graph};

use crate::common;

const TIMEOUT: Duration = Duration::from_secs(60);

fn node(domain: &str) -> Node {
    let environment =
        Environment { domain: domain.parse().unwrap(), localhost_only: true, ..Environment::read().unwrap() };
    Node::start_in(environment, "operator", &RosArgs::default()).unwrap()
}

/// Simulated time between the next two messages [s].
fn gap(wheels: &Subscription<JointState>) -> f64 {
    let stamp = || {
        let message = common::until("the wheels' speeds", || wheels.take().unwrap());
        f64::from(message.header.stamp.sec) + f64::from(message.header.stamp.nanosec) / 1e9
    };
    let first = stamp();
    stamp() - first
}

#[test]
fn telemetry_comes_as_often_as_is_asked_for_in_flight() {
    let folder = tempfile::tempdir().unwrap();
    let mission = common::write_mission(folder.path(), "orbits = 5.0\npace = 100.0\nplanner = \"heuristic:90\"\n");
    let domain = common::domain();
    let out = folder.path().join("out");
    let mut launch = common::swath(&domain, &["launch", mission.to_str().unwrap(), "--no-bag", "--out"]);
    let mut flight = common::Running::start(launch.arg(out));
    let node = node(&domain);
    let wheels = node.subscription(&graph::WHEELS).unwrap();
    let set = node.client::<SetParameters>(&graph::Service::new("spacecraft/set_parameters", &[], &[])).unwrap();
    node.wait_for_service(&set, TIMEOUT).unwrap();
    assert_eq!(gap(&wheels), 10.0);
    let value = ParameterValue { r#type: ParameterType::PARAMETER_DOUBLE, double_value: 7.0, ..Default::default() };
    let parameter = Parameter { name: "telemetry_period_s".to_owned(), value };
    let answer = set.call(SetParametersRequest { parameters: vec![parameter] }, TIMEOUT).unwrap();
    assert!(answer.results[0].successful, "{}", answer.results[0].reason);
    common::until("telemetry every 7 s", || (gap(&wheels) == 7.0).then_some(()));
    flight.stop();
}

#[test]
fn a_log_of_debug_names_each_topic() {
    let folder = tempfile::tempdir().unwrap();
    let mission = common::write_mission(folder.path(), "orbits = 0.1\n");
    let said = |level: &str| {
        let log = folder.path().join(level);
        let mut manager = common::command("swath-requests", &common::domain());
        let mission = format!("mission:={}", mission.display());
        let store = folder.path().join(format!("{level}.sqlite"));
        manager.args([
            "--ros-args",
            "--log-level",
            level,
            "-p",
            &mission,
            "-p",
            &format!("store:={}", store.display()),
        ]);
        let mut manager = common::Running::start(manager.stderr(File::create(&log).unwrap()));
        let read = || std::fs::read_to_string(&log).unwrap();
        common::until("its first words", || read().contains("known from the start").then_some(()));
        manager.stop();
        read()
    };
    let debug = said("debug");
    for topic in ["/swath/requests/request", "/swath/guidance/decision_point", "/swath/requests/upcoming"] {
        assert!(debug.lines().any(|line| line.contains("DEBUG") && line.contains(topic)), "no {topic}: {debug}");
    }
    assert!(!said("info").contains("DEBUG"));
}
