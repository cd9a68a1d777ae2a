//! `swath-train` as a user runs it: training, stopping, resuming, evaluating, and bad input.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use crate::case::{Case, STRIPS, TOY, checkpoints, succeeded};

#[test]
fn a_run_in_two_parts_ends_with_the_same_policy_and_progress_as_in_one() {
    let (whole, parts) = (Case::new(TOY), Case::new(TOY));
    succeeded(&whole.train(&[]));
    succeeded(&parts.train(&["--stop-after", "200"]));
    assert_eq!(checkpoints(&parts.path("out/toy-seed0/checkpoints")).last().unwrap(), "step-000000000200.safetensors");
    succeeded(&parts.train(&["--resume"]));
    let read = |case: &Case, name: &str| std::fs::read(case.path("out/toy-seed0").join(name)).unwrap();
    for name in ["policy.safetensors", "checkpoints/step-000000000400.safetensors"] {
        assert_eq!(read(&whole, name), read(&parts, name), "{name}");
    }
    let steps = |case: &Case| {
        let text = String::from_utf8(read(case, "progress.jsonl")).unwrap();
        let lines = text.lines().map(|line| serde_json::from_str::<Value>(line).unwrap()["steps"].as_u64().unwrap());
        lines.collect::<Vec<_>>()
    };
    assert_eq!(steps(&whole), (1..=10).map(|update| 40 * update).collect::<Vec<_>>());
    assert_eq!(steps(&whole), steps(&parts));
    assert_eq!(checkpoints(&whole.path("out/toy-seed0/checkpoints")).len(), 2, "old checkpoints are removed");
}

#[test]
fn a_run_is_not_begun_over_another_one() {
    let case = Case::new(TOY);
    succeeded(&case.train(&["--stop-after", "80"]));
    case.refused(&case.train(&[]), &["step-000000000080.safetensors exists", "--resume"]);
}

#[test]
fn a_run_can_begin_with_the_weights_of_a_policy_of_the_same_network() {
    let case = Case::new(TOY);
    succeeded(&case.train(&["--steps", "40"]));
    std::fs::rename(case.path("out/toy-seed0/policy.safetensors"), case.path("policy.safetensors")).unwrap();
    let begun = |seed: &str, more: &[&str]| {
        succeeded(&case.train(&[&["--seed", seed, "--steps", "40", "--stop-after", "0"], more].concat()));
        let path = case.path(&format!("out/toy-seed{seed}/policy.safetensors"));
        swath_training::store::Content::read(&path).unwrap().tensors
    };
    let policy = swath_training::store::Content::read(&case.path("policy.safetensors")).unwrap().tensors;
    assert_eq!(begun("1", &["--from", "policy.safetensors"]), policy);
    assert_ne!(begun("2", &[]), policy);
    let other = Case::new(&TOY.replace("encoder = [8]", "encoder = [9]"));
    let policy = case.path("policy.safetensors");
    let output = other.train(&["--from", policy.to_str().unwrap()]);
    other.refused(&output, &["policy.safetensors was made by another run: network.encoder"]);
}

#[test]
fn tensorboard_reads_the_event_files() {
    let venv = Path::new(env!("CARGO_MANIFEST_DIR")).join("../.venv/bin/python");
    let python = std::env::var_os("SWATH_PYTHON").map_or(venv, PathBuf::from);
    assert!(python.exists(), "no Python for the tests: run `cargo xtask test`, which makes .venv");
    let case = Case::new(TOY);
    succeeded(&case.train(&["--steps", "120"]));
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/read_events.py");
    let output = Command::new(python).arg(script).arg(case.path("out/toy-seed0")).output().unwrap();
    succeeded(&output);
    let scalars: Value = serde_json::from_slice(&output.stdout).unwrap();
    let text = std::fs::read_to_string(case.path("out/toy-seed0/progress.jsonl")).unwrap();
    let lines: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    for tag in ["reward_per_orbit", "success_rate", "t_pre_mean_s", "kl", "clip_fraction", "entropy"] {
        let points = scalars[tag].as_array().unwrap();
        assert_eq!(points.len(), 3, "{tag}");
        for (point, line) in points.iter().zip(&lines) {
            assert_eq!(point[0], line["steps"], "{tag}");
            let (found, wanted) = (point[1].as_f64().unwrap(), line[tag].as_f64().unwrap());
            assert!((found - wanted).abs() <= 1e-6 * wanted.abs().max(1.0), "{tag}: {found} {wanted}");
        }
    }
    for tag in ["return", "explained_variance", "gradient_norm", "steps_per_s"] {
        assert!(scalars[tag].is_array(), "{tag}");
    }
}

#[test]
fn a_full_disk_leaves_the_last_good_checkpoint() {
    let case = Case::new(TOY);
    succeeded(&case.train(&["--stop-after", "80"]));
    let good = case.path("out/toy-seed0/checkpoints/step-000000000080.safetensors");
    let before = std::fs::read(&good).unwrap();
    // No file may grow beyond one block: writes fail as they do on a full disk.
    let script = format!(
        "trap '' XFSZ; ulimit -f 1; exec {} train --config run.toml --out out --threads 1 --resume --stop-after 120",
        env!("CARGO_BIN_EXE_swath-train")
    );
    let output = Command::new("bash").args(["-c", &script]).current_dir(case.folder.path()).output().unwrap();
    case.refused(&output, &["cannot write", "the last good checkpoint is", "step-000000000080.safetensors"]);
    assert_eq!(checkpoints(good.parent().unwrap()), ["step-000000000080.safetensors"]);
    assert_eq!(std::fs::read(&good).unwrap(), before);
}

#[test]
fn bad_runs_are_refused_by_name() {
    let refused = |run: &str, texts: &[&str]| {
        let case = Case::new(run);
        case.refused(&case.train(&[]), texts);
    };
    refused(&TOY.replace("epochs = 2", "epoch = 2"), &["run.toml is not valid", "unknown field `epoch`"]);
    refused(&TOY.replace("encoder = [8]", "encoders = [8]"), &["unknown field `encoders`"]);
    refused(&TOY.replace("tokens = 4", "tokens = 4, n = 1"), &["unknown field `n`"]);
    refused(&TOY.replace("learning_rate = 1e-3", "learning_rate = nan"), &["ppo.learning_rate is NaN"]);
    refused(&TOY.replace("group = 2", "group = 3"), &["rollout.group is 3", "divisor"]);
    refused(&TOY.replace("encoder = [8]", "encoder = [8000000]"), &["network.encoder is 8000000"]);
    refused(&TOY.replace("name = \"toy\"", "name = \"../x\""), &["name is ../x"]);
    refused(&STRIPS.replace("orbits = 0.5", "orbits = -1.0"), &["orbits"]);
    refused("name =", &["run.toml is not valid"]);
    let case = Case::new(TOY);
    case.refused(&case.train(&["--resume"]), &["out/toy-seed0/checkpoints holds no checkpoint"]);
    std::fs::create_dir(case.path("empty")).unwrap();
    case.refused(&case.train(&["--resume", "empty"]), &["empty holds no checkpoint"]);
    case.refused(&case.train(&["--device", "tpu"]), &["device is tpu"]);
    case.refused(&case.run(&["train", "--config", "none.toml"]), &["cannot read none.toml"]);
}

#[test]
fn planners_are_compared_on_the_same_missions_whatever_the_threads() {
    let case = Case::new(STRIPS);
    succeeded(&case.train(&[]));
    let policy = "hop-ppo:out/strips-seed0/policy.safetensors";
    let evaluated = |threads: &str| {
        let args = ["evaluate", "--planner", "heuristic:90", "--planner", "random", "--planner", policy];
        let more = ["--episodes", "3", "--orbits", "0.5", "--requests", "300..400", "--seed", "7"];
        let last = ["--json", "-", "--threads", threads];
        let output = case.run(&[&args[..], &more[..], &last[..]].concat());
        succeeded(&output);
        output.stdout
    };
    let first = evaluated("1");
    assert_eq!(first, evaluated("3"));
    let whole: Value = serde_json::from_slice(&first).unwrap();
    let planners = whole["planners"].as_array().unwrap();
    assert_eq!(planners.len(), 3);
    for planner in planners {
        let missions = planner["missions"].as_array().unwrap();
        let seeds: Vec<u64> = missions.iter().map(|it| it["seed"].as_u64().unwrap()).collect();
        assert_eq!(seeds, [7, 8, 9]);
        let requests: Vec<_> = missions.iter().map(|it| &it["requests"]).collect();
        let same: Vec<_> = planners[0]["missions"].as_array().unwrap().iter().map(|it| &it["requests"]).collect();
        assert_eq!(requests, same);
        let mean = missions.iter().map(|it| it["reward_per_orbit"].as_f64().unwrap()).sum::<f64>() / 3.0;
        assert!((planner["reward_per_orbit"]["mean"].as_f64().unwrap() - mean).abs() < 1e-9);
    }
    assert_eq!(planners[0]["t_pre_s"]["mean"], 90.0);
    let wrong = case.run(&["evaluate", "--planner", "h-ppo:out/strips-seed0/policy.safetensors", "--episodes", "1"]);
    case.refused(&wrong, &["it holds a hop-ppo policy, not h-ppo"]);
    let missing = case.run(&["evaluate", "--planner", "hop-ppo:none", "--episodes", "1"]);
    case.refused(&missing, &["cannot read none"]);
    let other = case.run(&["evaluate", "--planner", "hop-ppo:run.toml", "--episodes", "1"]);
    case.refused(&other, &["run.toml cannot be used here: it is no policy and no checkpoint"]);
    let checkpoint = case.train(&["--resume", "out/strips-seed0/policy.safetensors"]);
    case.refused(&checkpoint, &["policy.safetensors cannot be used here: it is a policy, not a checkpoint"]);
}

#[test]
fn the_sweep_prints_all_twelve_times() {
    let case = Case::new(STRIPS);
    let output = case.run(&["sweep", "--json", "--episodes", "2", "--orbits", "0.5", "--requests", "500"]);
    succeeded(&output);
    let whole: Value = serde_json::from_slice(&output.stdout).unwrap();
    let sweep = whole["sweep"].as_array().unwrap();
    let times: Vec<f64> = sweep.iter().map(|it| it["t_pre_fixed_s"].as_f64().unwrap()).collect();
    assert_eq!(times, (1..=12).map(|k| 10.0 * f64::from(k)).collect::<Vec<_>>());
    let reward = |entry: &Value| entry["reward_per_orbit"]["mean"].as_f64().unwrap();
    let best = sweep.iter().max_by(|a, b| reward(a).total_cmp(&reward(b))).unwrap();
    assert_eq!(whole["best_t_pre_s"], best["t_pre_fixed_s"]);
}
