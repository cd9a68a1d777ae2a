//! What only the evaluator flies: errors of the plant and requests that come in flight; and a few steps of training.

use serde_json::Value;

use crate::pins::golden;
use crate::pins::place::{Place, sha256};

/// Runs a command that prints JSON; the program's revision, which is another after every commit, is left out.
fn json(place: &Place, line: &str) -> String {
    let mut value: Value = serde_json::from_str(&place.succeed(line)).unwrap();
    assert!(value["program"].as_object_mut().unwrap().remove("revision").is_some());
    format!("$ {line}\n{value:#}\n")
}

#[test]
fn plant_errors() {
    let place = Place::new();
    place.write("plant.toml", "torque_limit_scale = 0.85\nrate_noise_rad_s = 2e-5\nplanning_delay_s = 0.6\n");
    let text = json(
        &place,
        "swath-train evaluate --planner heuristic:80 --planner beam:4x2 --planner hop-ppo --plant none \
         --plant torque-10%,inertia+5% --plant noise --plant delay --plant plant.toml \
         --episodes 2 --orbits 0.4 --requests 1200 --seed 3 --json -",
    );
    golden::check("training/plant_errors.txt", &text);
}

#[test]
fn arrivals() {
    let place = Place::new();
    let text = json(
        &place,
        "swath-train evaluate --planner random --planner lookahead --planner hop-ppo+lookahead --planner discrete-ppo \
         --arrivals 0.6 --episodes 2 --orbits 0.6 --requests 500..1500 --seed 11 --json -",
    );
    let both = json(
        &place,
        "swath-train evaluate --planner lookahead --plant noise,delay --arrivals 0.8 --episodes 2 --orbits 0.5 \
         --requests 1000 --seed 21 --json -",
    );
    golden::check("training/arrivals.txt", &(text + &both));
}

#[test]
fn sweep() {
    let line = "swath-train sweep --episodes 3 --orbits 0.5 --requests 800..1600 --seed 5 --json";
    golden::check("training/sweep.txt", &json(&Place::new(), line));
}

#[test]
fn ground_plans() {
    let line = "swath-train ground-plan --width 8 --branches 4 --weakness 0.1 --plant none --plant torque-10% \
                --episodes 2 --orbits 0.3 --requests 600 --seed 2 --json -";
    golden::check("training/ground_plan.txt", &json(&Place::new(), line));
}

/// An evaluation in a simulation of its own, told as a table.
#[test]
fn tables() {
    let place = Place::new();
    place.write("simulation.toml", "[orbit]\naltitude_km = 600.0\n[imaging]\nelevation_min_deg = 20.0\n");
    let mut text = String::new();
    for line in [
        "swath-train evaluate --planner random --planner heuristic:60 --planner lookahead --episodes 3 --orbits 0.3 \
         --requests 900 --simulation simulation.toml",
        "swath-train sweep --episodes 2 --orbits 0.2 --requests 500",
        "swath-train ground-plan --width 4 --branches 3 --episodes 1 --orbits 0.2 --requests 300",
    ] {
        text += &format!("$ {line}\n{}\n", place.succeed(line));
    }
    golden::check("training/tables.txt", &text);
}

/// Figures of the shipped policies' learning curves and of a small evaluation.
#[test]
fn figures() {
    let place = Place::new();
    place.succeed(
        "swath-train evaluate --planner heuristic:80 --planner lookahead --episodes 3 --orbits 0.3 --requests 700 \
         --json evaluation.json",
    );
    let curve =
        |label: &str, name: &str| format!("--curve {label}=<repository>/training/policies/{name}.progress.jsonl");
    let line = format!(
        "swath-train figures --out figures {} {} --evaluation fig4=evaluation.json --density evaluation.json",
        curve("hop-ppo", "hop_ppo_scratch"),
        curve("h-ppo", "h_ppo"),
    );
    place.succeed(&line);
    let mut text = format!("$ {line}\n");
    for name in ["fig3.svg", "fig4.svg", "fig5.svg"] {
        let svg = place.read(&format!("figures/{name}"));
        text += &format!("{name}: {} lines {}\n", svg.lines().count(), sha256(&svg));
    }
    golden::check("training/figures.txt", &text);
}

const RUN: &str = r#"name = "strips"
steps = 96
[environment]
kind = "strips"
observation = "OBSERVATION"
episode = { orbits = 0.4, scenario = { count = [400, 400] }, arrivals = 0.3 }
[network]
kind = "hop-ppo"
dim = 8
heads = 2
layers = 1
feed_forward = 8
head = "pointer"
discrete = [8]
continuous = [8]
critic = [8]
[rollout]
environments = 2
group = 1
[ppo]
batch = 48
minibatch = 24
epochs = 2
"#;

/// What follows the header of a safetensors file, which also names the program's revision.
fn weights(path: &std::path::Path) -> Vec<u8> {
    let mut bytes = std::fs::read(path).unwrap();
    let header = u64::from_le_bytes(bytes[..8].try_into().unwrap());
    bytes.split_off(8 + usize::try_from(header).unwrap())
}

/// Each set of observations, seen by a small network that learns for two updates.
#[test]
fn training() {
    let mut text = String::new();
    for observation in ["table1", "table1-momentum", "dynamics"] {
        let place = Place::new();
        place.write("run.toml", RUN.replace("OBSERVATION", observation));
        let line = "swath-train train --config run.toml --out out --seed 4 --threads 2";
        place.succeed(line);
        text += &format!("$ {line}  # observation {observation}\n");
        for update in place.read("out/strips-seed4/progress.jsonl").lines() {
            let mut update: Value = serde_json::from_str(update).unwrap();
            assert!(update.as_object_mut().unwrap().remove("steps_per_s").is_some());
            text += &format!("{update}\n");
        }
        text += &format!("weights {}\n\n", sha256(weights(&place.path("out/strips-seed4/policy.safetensors"))));
    }
    golden::check("training/training.txt", &text);
}
