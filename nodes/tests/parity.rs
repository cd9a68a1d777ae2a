//! The strongest test of the suite: a mission over DDS in lockstep and the same one in one process give the same tasks,
//! results and rewards, bit for bit.
#![allow(missing_docs, clippy::unwrap_used, reason = "a test")]

mod common;

use std::path::Path;

const MISSION: &str = "orbits = 1.0\n[requests.random]\ncount = [1500, 1500]\n";

fn tasks(mission: &Path, out: &Path, words: &[&str]) -> String {
    let domain = common::domain();
    let mut launch = common::command("swath", &domain);
    launch.arg("launch").arg(mission).arg("--out").arg(out).args(words);
    common::succeed(&mut launch);
    std::fs::read_to_string(out.join("tasks.jsonl")).unwrap()
}

#[test]
fn missions_over_dds_and_in_one_process_are_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let mission = common::write_mission(folder.path(), MISSION);
    for planner in ["heuristic:80", "random", "lookahead"] {
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
