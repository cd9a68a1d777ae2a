//! The strongest test of the suite: a mission over DDS in lockstep and the same one in one process give the same tasks,
//! results and rewards, bit for bit.

use std::path::Path;

use crate::common;

const MISSION: &str = "orbits = 1.0\n[requests.random]\ncount = [1500, 1500]\n";

pub fn tasks(mission: &Path, out: &Path, words: &[&str]) -> String {
    let domain = common::domain();
    let mut launch = common::command("swath", &domain);
    launch.arg("launch").arg(mission).arg("--out").arg(out).args(words);
    let flown = common::run(&mut launch);
    // 3: another planner decided than the one that was asked for.
    let replaced = std::fs::read_to_string(out.join("alarms.jsonl")).is_ok_and(|it| it.contains("planner replaced"));
    let wanted = if replaced || words.iter().any(|word| word.contains("missing")) { 3 } else { 0 };
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

/// Wheels and sensors fail in the spacecraft: tasks and what is told of alarms are the same over DDS, in one process and
/// in a re-flight.
#[test]
fn wheels_and_sensors_that_fail_are_the_same_too() {
    let folder = tempfile::tempdir().unwrap();
    let noise = "[plant]\nattitude_noise_rad = 2e-4\nrate_noise_rad_s = 6e-5\n";
    let faults = "[faults]\nplan = [\"wheel2:weak 60%@300s+400s\", \"gyro:bias 0.05deg/s@500s+600s\", \
                  \"startracker:out@900s+60s\", \"wheel1:dead@1500s\"]\n";
    for (name, addition) in [("exact", ""), ("noisy", noise)] {
        let mission = common::write_mission(folder.path(), &format!("{MISSION}{addition}{faults}"));
        for planner in ["lookahead", "heuristic:90"] {
            let out = |kind: &str| folder.path().join(format!("{name}-{planner}-{kind}"));
            let words = ["--planner", planner, "--orbits", "0.5"];
            let in_process = tasks(&mission, &out("in-process"), &[&words[..], &["--in-process"]].concat());
            let over_dds = tasks(&mission, &out("dds"), &words);
            assert_eq!(over_dds, in_process, "{name}, planner {planner}");
            let alarms = |kind: &str| std::fs::read_to_string(out(kind).join("alarms.jsonl")).unwrap();
            assert_eq!(alarms("dds"), alarms("in-process"), "{name}, planner {planner}");
            for alarm in ["wheel y", "gyro biased", "star tracker out", "wheel x"] {
                assert!(alarms("dds").contains(alarm), "{alarm}: {}", alarms("dds"));
            }
            assert_eq!(alarms("dds").contains("planner replaced"), planner == "heuristic:90");
            let bag = out("dds").join("bag");
            common::succeed(common::swath("0", &["refly"]).arg(bag));
        }
    }
}

/// Nodes that are killed or hang by order: the fallback flies for the ticks ordered, the clock stands while another node
/// is started, and the tasks are those of a mission in one process that loses the same.
#[test]
fn nodes_that_fail_by_order_are_the_same_too() {
    let folder = tempfile::tempdir().unwrap();
    let both = [
        "guidance:kill@300s",
        "guidance:hang@700s+20s",
        "planner:kill@500s",
        "planner:kill@1000s+95s",
        "request_manager:kill@900s",
        "wheel2:weak 60%@650s+200s",
    ];
    let over_dds = [&both[..], &["spacecraft:kill@400s", "recorder:kill@450s"]].concat();
    let mission =
        |plan: &[&str]| common::write_mission(folder.path(), &format!("{MISSION}[faults]\nplan = {plan:?}\n"));
    let words = ["--planner", "lookahead", "--orbits", "0.5"];
    let out = |kind: &str| folder.path().join(kind);
    let in_process = tasks(&mission(&both), &out("in-process"), &[&words[..], &["--in-process"]].concat());
    assert_eq!(tasks(&mission(&over_dds), &out("dds"), &words), in_process);
    let alarms = |kind: &str| {
        let text = std::fs::read_to_string(out(kind).join("alarms.jsonl")).unwrap();
        let other = |line: &&str| !line.contains("spacecraft lost") && !line.contains("recorder lost");
        let of = |line: &str| {
            let mut entry: serde_json::Value = serde_json::from_str(line).unwrap();
            entry.as_object_mut().unwrap().remove("number");
            entry
        };
        text.lines().filter(other).map(of).collect::<Vec<_>>()
    };
    assert_eq!(alarms("dds"), alarms("in-process"));
    assert_eq!(alarms("dds").len(), 14);
    // A fresh guidance knows nothing of the wheel, and finds it out again.
    let wheel = alarms("dds").into_iter().filter(|it| it["name"] == "wheel y");
    assert_eq!(wheel.map(|it| it["event"].clone()).collect::<Vec<_>>(), ["raised", "returned", "raised", "returned"]);
    let mut validate = common::command("swath-bag", "0");
    let told = common::succeed(validate.arg("validate").arg(out("dds").join("bag")));
    assert!(told.contains("the recording was interrupted"), "{told}");
}

#[test]
fn faults_that_cannot_be_flown_over_dds_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let mission = common::write_mission(folder.path(), "orbits = 0.5\n[faults]\nplan = [\"recorder:hang@120s+5s\"]\n");
    let mut launch = common::command("swath", &common::domain());
    let output = common::run(launch.arg("launch").arg(&mission).arg("--out").arg(folder.path().join("out")));
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(!output.status.success() && text.contains("recorder:hang@120s+5s cannot be flown over DDS"), "{text}");
}
