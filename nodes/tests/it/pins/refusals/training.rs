//! Runs that cannot be trained, and evaluations that make no sense.

use super::{Case, refuse};
use crate::pins::golden;
use crate::pins::place::Place;

const RUN: &str = r#"name = "toy"
steps = 40
environment = { kind = "toy", tokens = 4 }
network = { kind = "hop-ppo-mlp", encoder = [8], discrete = [8], continuous = [8], critic = [8] }
rollout = { environments = 4, group = 2 }
ppo = { batch = 40, minibatch = 20, epochs = 1 }
"#;

const EVALUATE: &[Case] = &[
    (&[], "swath-train learn"),
    (&[], "swath-train evaluate --planner clever"),
    (&[], "swath-train evaluate --planner hop-ppo:nowhere.safetensors --episodes 1"),
    (&[], "swath-train evaluate --planner hop-ppo:cut.safetensors --episodes 1"),
    (&[], "swath-train evaluate --planner h-ppo:<repository>/training/policies/hop_ppo.safetensors --episodes 1"),
    (&[], "swath-train evaluate --planner random --plant wobbly"),
    (&[], "swath-train evaluate --planner random --plant torque10%"),
    (&[], "swath-train evaluate --planner random --plant none,noise"),
    (&[], "swath-train evaluate --planner random --plant nowhere.toml"),
    (&[("plant.toml", "planning_delay_s = -1.0")], "swath-train evaluate --planner random --plant plant.toml"),
    (&[], "swath-train evaluate --planner random --orbits 0"),
    (&[], "swath-train evaluate --planner random --requests 5..2"),
    (&[], "swath-train evaluate --planner random --arrivals 1.5"),
    (&[], "swath-train evaluate --planner random --simulation nowhere.toml"),
    (&[("sim.toml", "[orbit]\naltitude_km = 1.0")], "swath-train sweep --simulation sim.toml"),
    (&[], "swath-train evaluate --planner random --episodes 1 --orbits 0.1 --requests 10 --json nowhere/e.json"),
    (&[], "swath-train figures --out figures --curve a=nowhere.jsonl"),
    (&[("e.json", "{}")], "swath-train figures --out figures --evaluation a=e.json"),
];

const TRAIN: &[Case] = &[
    (&[], "swath-train train --config nowhere.toml"),
    (&[("run.toml", "name = \"a\"")], "swath-train train --config run.toml"),
    (&[], "swath-train train --config toy.toml --device gpu"),
    (&[], "swath-train train --config toy.toml --resume"),
    (&[], "swath-train train --config toy.toml --resume nowhere.safetensors"),
    (&[], "swath-train train --config toy.toml --from <repository>/training/policies/h_ppo.safetensors"),
    (&[], "swath-train train --config name.toml"),
    (&[], "swath-train train --config group.toml"),
    (&[], "swath-train train --config batch.toml"),
    (&[], "swath-train train --config gamma.toml"),
];

fn place() -> Place {
    let place = Place::new();
    place.write("toy.toml", RUN);
    for (name, was, is) in [
        ("name", "name = \"toy\"", "name = \"../toy\""),
        ("group", "group = 2", "group = 3"),
        ("batch", "minibatch = 20", "minibatch = 50"),
        ("gamma", "epochs = 1", "gamma = nan"),
    ] {
        place.write(&format!("{name}.toml"), RUN.replace(was, is));
    }
    let policy = std::fs::read(golden::repository().join("training/policies/hop_ppo.safetensors")).unwrap();
    place.write("cut.safetensors", &policy[..policy.len() / 2]);
    place
}

#[test]
fn evaluations() {
    refuse("evaluations", &place(), EVALUATE);
}

#[test]
fn training_runs() {
    refuse("training_runs", &place(), TRAIN);
}
