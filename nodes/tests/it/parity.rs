//! The strongest test of the suite: a mission over DDS in lockstep and the same one in one process give the same tasks,
//! results and rewards, bit for bit.

use std::path::Path;

use crate::common;

const MISSION: &str = "orbits = 1.0\n[requests.random]\ncount = [1500, 1500]\n";

fn tasks(mission: &Path, out: &Path, words: &[&str]) -> String {
    let domain = common::domain();
    let mut launch = common::command("swath", &domain);
    launch.arg("launch").arg(mission).arg("--out").arg(out).args(words);
    let flown = common::run(&mut launch);
    // 3: another planner decided than the one that was asked for.
    let wanted = if words.iter().any(|word| word.contains("missing")) { 3 } else { 0 };
    assert_eq!(flown.status.code(), Some(wanted), "{launch:?}: {}", String::from_utf8_lossy(&flown.stderr));
    std::fs::read_to_string(out.join("tasks.jsonl")).unwrap()
}

#[test]
fn missions_over_dds_and_in_one_process_are_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let mission = common::write_mission(folder.path(), MISSION);
    for planner in ["heuristic:80", "random", "lookahead", "beam", "repair", "aspen", "hop-ppo", "hop-ppo+lookahead"] {
        for seed in ["1", "2", "3"] {
            let words = ["--planner", planner, "--seed", seed];
            let out = |kind: &str| folder.path().join(format!("{planner}-{seed}-{kind}"));
            let in_process = tasks(&mission, &out("in-process"), &[&words[..], &["--in-process"]].concat());
            let over_dds = tasks(&mission, &out("dds"), &[&words[..], &["--no-bag"]].concat());
            assert_eq!(over_dds, in_process, "planner {planner}, seed {seed}");
            assert!(in_process.lines().count() > 20);
        }
    }
}

#[test]
fn the_heuristic_takes_over_from_a_policy_that_is_not_there() {
    let folder = tempfile::tempdir().unwrap();
    let mission = common::write_mission(folder.path(), "orbits = 0.5\n[requests.random]\ncount = [1500, 1500]\n");
    let missing = format!("hop-ppo:{}", folder.path().join("missing.safetensors").display());
    let over_dds = tasks(&mission, &folder.path().join("dds"), &["--planner", &missing]);
    let in_process = tasks(&mission, &folder.path().join("in-process"), &["--planner", &missing, "--in-process"]);
    let heuristic = tasks(&mission, &folder.path().join("heuristic"), &["--planner", "heuristic:90", "--in-process"]);
    assert_eq!((&over_dds, &in_process), (&heuristic, &heuristic));
    let bag = folder.path().join("dds/bag");
    let mut cat = common::command("swath-bag", "0");
    let alarms = common::succeed(cat.arg("cat").arg(bag).args(["--topic", "/diagnostics"]));
    assert!(
        alarms.contains("missing.safetensors: No such file") && alarms.contains("heuristic:90 takes over"),
        "{alarms}"
    );
}

#[test]
fn satellites_that_differ_from_their_model_and_planners_that_wait_are_the_same_too() {
    let folder = tempfile::tempdir().unwrap();
    let errors = "[plant]\ntorque_limit_scale = 0.9\ninertia_scale = 1.05\nattitude_noise_rad = 2e-4\n\
                  rate_noise_rad_s = 6e-5\nplanning_delay_s = 1.0\n";
    let approval = "[approval]\nmode = \"approve\"\ndeadline_s = 20.0\nat_deadline = \"fly\"\n";
    for (name, addition) in [("errors", errors), ("approval", approval)] {
        let mission = common::write_mission(folder.path(), &format!("{MISSION}{addition}"));
        for planner in ["beam", "random", "hop-ppo"] {
            let out = |kind: &str| folder.path().join(format!("{name}-{planner}-{kind}"));
            let words = ["--planner", planner, "--orbits", "0.5"];
            let in_process = tasks(&mission, &out("in-process"), &[&words[..], &["--in-process"]].concat());
            let over_dds = tasks(&mission, &out("dds"), &words);
            assert_eq!(over_dds, in_process, "{name}, planner {planner}");
            assert!(in_process.lines().count() > 10);
            let bag = out("dds").join("bag");
            common::succeed(common::swath("0", &["refly"]).arg(bag));
        }
    }
}
