//! Evaluation on satellites that differ from their model, with requests that come in flight, and of ground plans.

use std::process::{Command, Output};

use serde_json::Value;

fn run(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_swath-train")).args(args).output().unwrap()
}

fn json(args: &[&str]) -> Value {
    let output = run(&[args, &["--json", "-"]].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

const SHORT: [&str; 6] = ["--episodes", "2", "--orbits", "1", "--requests", "3000"];

#[test]
fn planners_are_compared_on_each_plant_by_name_and_by_file() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("weak.toml");
    std::fs::write(&file, "torque_limit_scale = 0.9\n").unwrap();
    let file = file.to_str().unwrap();
    let planners = ["--planner", "heuristic:80", "--planner", "heuristic:100", "--planner", "lookahead"];
    let plants = ["--plant", "none", "--plant", "torque-10%", "--plant", file];
    let found = json(&[&["evaluate"], &planners[..], &plants, &SHORT].concat());
    let plants = found["plants"].as_array().unwrap();
    let names: Vec<_> = plants.iter().map(|plant| plant["plant"].as_str().unwrap()).collect();
    assert_eq!(names, ["none", "torque-10%", file]);
    assert_eq!(plants[1]["planners"], plants[2]["planners"], "by name and by file");
    let reward =
        |plant: &Value, planner: usize| plant["planners"][planner]["reward_per_orbit"]["mean"].as_f64().unwrap();
    let gain = |plant: &Value| plant["planners"][2]["gain_over_best_fixed"]["mean"].as_f64().unwrap();
    for plant in plants {
        let best = reward(plant, 0).max(reward(plant, 1));
        assert!((gain(plant) - (reward(plant, 2) / best - 1.0)).abs() < 1e-9);
        assert!(gain(plant) > 0.4, "{plant:#}");
    }
    assert!(reward(&plants[1], 2) < reward(&plants[0], 2));
}

#[test]
fn faults_in_plants_and_shares_are_told() {
    for (args, text) in [
        (["--plant", "torque"], "`torque` is no error of the plant"),
        (["--plant", "inertia+2000%"], "plant.inertia_scale is 21, outside 0.1 to 10"),
        (["--plant", "nowhere.toml"], "cannot read nowhere.toml"),
        (["--arrivals", "1.5"], "arrivals is 1.5, outside 0 to 1"),
    ] {
        let output = run(&[&["evaluate", "--planner", "random"], &SHORT[..], &args].concat());
        let error = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success() && error.contains(text), "{error}");
    }
}

#[test]
fn a_ground_plan_is_bracketed_and_loses_what_it_does_not_know() {
    let plan = ["ground-plan", "--width", "1", "--branches", "4", "--plant", "none", "--plant", "torque-10%"];
    let found = json(&[&plan[..], &SHORT].concat());
    let mean = |value: &Value| value["mean"].as_f64().unwrap();
    let flown = |found: &Value, plant: usize| mean(&found["flown_blindly"][plant]["reward_per_orbit"]);
    let (known, bound) = (mean(&found["best_known"]), mean(&found["upper_bound"]));
    assert!(known < bound, "{known} {bound}");
    assert!((flown(&found, 0) - known).abs() < 1e-9, "the true plant");
    assert!(flown(&found, 1) < 0.8 * known, "weaker wheels");
    let arrivals = json(&[&plan[..], &SHORT, &["--arrivals", "0.5"]].concat());
    assert_eq!(arrivals["best_known"], found["best_known"], "of all requests");
    assert!(flown(&arrivals, 0) < 0.9 * known, "half of the requests");
    let again = json(&[&plan[..], &SHORT, &["--threads", "2"]].concat());
    assert_eq!(again["brackets"], found["brackets"], "whatever the threads");
}
