//! The small programs of `nodes/examples` do what they say.

use std::path::Path;
use std::process::Command;
use std::time::Duration;

use crate::common;

fn example(name: &str) -> Command {
    let path = Path::new(env!("CARGO_BIN_EXE_swath")).with_file_name("examples").join(name);
    assert!(path.is_file(), "{} is missing: run `cargo build --release --workspace --examples`", path.display());
    Command::new(path)
}

#[test]
fn a_planner_of_ones_own_flies_and_beam_beats_it() {
    let said = common::succeed(&mut example("own_planner"));
    let reward = |planner: &str| -> f64 {
        let line = said.lines().find(|line| line.starts_with(planner)).unwrap_or_else(|| panic!("{said}"));
        line.split_whitespace().last().unwrap().parse().unwrap()
    };
    assert!(reward("earliest-deadline") > 5.0, "{said}");
    assert!(reward("beam") > reward("earliest-deadline"), "{said}");
}

#[test]
fn a_node_of_ones_own_hears_the_planners_tasks() {
    let folder = tempfile::tempdir().unwrap();
    let mission = common::write_mission(folder.path(), "orbits = 0.5\npace = 200.0\nseed = 5\n");
    let domain = common::domain();
    let mut node = example("own_node");
    node.args(["--ros-args", "-r", "__ns:=/swath"]).env("ROS_DOMAIN_ID", &domain).env("ROS_LOCALHOST_ONLY", "1");
    let heard = folder.path().join("heard");
    let mut node = common::Running::start(node.stdout(std::fs::File::create(&heard).unwrap()));
    std::thread::sleep(Duration::from_secs(1));
    let mut launch = common::swath(&domain, &["launch", "--no-bag"]);
    common::succeed(launch.arg(mission).arg("--out").arg(folder.path().join("out")));
    node.signal(rustix::process::Signal::INT);
    assert!(node.wait().success());
    let said = std::fs::read_to_string(&heard).unwrap();
    let tasks = std::fs::read_to_string(folder.path().join("out/tasks.jsonl")).unwrap().lines().count();
    let heard = said.lines().filter(|line| line.starts_with("task ")).count();
    assert!(heard + 3 > tasks && heard > 5, "{heard} of {tasks}: {said}");
}
