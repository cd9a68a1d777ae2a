//! Log lines of a node on `/rosout`.

use std::process::Command;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use swath_ros::{Environment, Mapping, Node, RosArgs, graph};

use crate::common::eventually;

/// The first node of a process has its log, so this test has a process of its own.
#[test]
fn log_lines_reach_rosout() {
    let words = ["--exact", "rosout::log_lines_reach_rosout_in_a_process_of_their_own", "--ignored", "--nocapture"];
    let output = Command::new(std::env::current_exe().unwrap()).args(words).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(String::from_utf8_lossy(&output.stdout).contains("1 passed"));
}

#[test]
#[ignore = "run by the test above"]
fn log_lines_reach_rosout_in_a_process_of_their_own() {
    let process = std::process::id();
    let environment = Environment { domain: 10 + process as u16 % 20, localhost_only: true, mapping: Mapping::Cyclone };
    let words = format!("--ros-args -r __ns:=/p{process}");
    let args = RosArgs::split(words.split_whitespace().map(str::to_owned)).unwrap().1;
    let node = Node::start_in(environment.clone(), graph::PLANNER, &args).unwrap();
    let listener = Node::start_in(environment, graph::LAUNCHER, &args).unwrap();
    let lines = listener.subscription(&graph::ROSOUT).unwrap();
    // Lines are latched, but not for ever.
    let offered = eventually(|| listener.remote_writers().into_iter().find(|writer| writer.topic == "/rosout"));
    assert_eq!(offered.qos.lifespan, Some(Duration::from_secs(10)));
    node.clock().set_ns(1_500_000_000);
    tracing::warn!(limit = 3, "too much");
    let deadline = Instant::now() + Duration::from_secs(20);
    let line = loop {
        // The line is latched: it does not matter that it came before the match.
        if let Some(line) = lines.take().unwrap() {
            break line;
        }
        assert!(Instant::now() < deadline, "no line came");
        std::thread::sleep(Duration::from_millis(1));
    };
    assert_eq!(line.msg, "too much limit=3");
    assert_eq!(line.level, swath_msgs::rcl_interfaces::Log::WARN);
    assert_eq!(line.name, format!("p{process}.planner"));
    // As ROS stamps its log: by the host's clock, whatever simulated time is.
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_secs();
    assert!(now - u64::try_from(line.stamp.sec).unwrap() < 60, "{:?}", line.stamp);
    assert!(line.file.ends_with("rosout.rs"), "{}", line.file);
}
