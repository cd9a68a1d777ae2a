//! Each node of a paced mission is killed at a random moment, or stopped for ten seconds: how long until its work is done
//! again, what is lost, and what the mission earns less. `soak_kills --plan`, or `soak_kills FIRST COUNT`; a seed is a
//! mission in which that happens to each of its five nodes, in every fifth one by stopping.
#![allow(missing_docs, clippy::print_stdout, reason = "a program for people")]

#[path = "../common/mod.rs"]
#[allow(dead_code, reason = "others use more of it")]
mod common;

use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use rand::rngs::StdRng;
use rand::seq::SliceRandom as _;
use rand::{RngExt as _, SeedableRng as _};
use serde_json::{Value, json};

use crate::common::flight::{Flight, signal};
use crate::common::witness::{NODES, Witness};
use crate::common::{soak, sortie, witness};

/// Missions of a whole figure.
const SEEDS: u64 = 50;
/// Simulated seconds a second.
const PACE: f64 = 100.0;
/// How long nodes are stopped.
const STOPPED: Duration = Duration::from_secs(10);
/// Between two kills [s].
const PAUSE_S: std::ops::Range<f64> = 1.0..3.0;

fn main() -> Result<()> {
    soak::run(SEEDS, |seeds| {
        let mut all = json!({ "kills": 0, "recovery_s": [], "stops": 0, "stopped_s": [], "acknowledged": 0, "reward": 0.0, "reward_nominal": 0.0,
            "failed": [] });
        for seed in seeds {
            match mission(seed) {
                Ok(one) => add(&mut all, &one),
                Err(error) => {
                    eprintln!("seed {seed}: {error:#}");
                    push(&mut all, "failed", seed.into());
                }
            }
        }
        Ok(all)
    })
}

/// What one mission tells.
struct Flown {
    stops: bool,
    recovery_s: Vec<(String, f64)>,
    acknowledged: usize,
    reward: f64,
    reward_nominal: f64,
}

fn push(all: &mut Value, key: &str, value: Value) {
    if let Some(list) = all[key].as_array_mut() {
        list.push(value);
    }
}

fn add(all: &mut Value, one: &Flown) {
    let (count, list) = if one.stops { ("stops", "stopped_s") } else { ("kills", "recovery_s") };
    all[count] = (all[count].as_u64().unwrap_or(0) + one.recovery_s.len() as u64).into();
    all["acknowledged"] = (all["acknowledged"].as_u64().unwrap_or(0) + one.acknowledged as u64).into();
    for (key, value) in [("reward", one.reward), ("reward_nominal", one.reward_nominal)] {
        all[key] = (all[key].as_f64().unwrap_or(0.0) + value).into();
    }
    for (node, seconds) in &one.recovery_s {
        push(all, list, json!([node, (seconds * 1000.0).round() / 1000.0]));
    }
}

fn mission(seed: u64) -> Result<Flown> {
    let stops = seed % 5 == 4;
    let orbits = if stops { 1.2 } else { 0.5 };
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("mission.toml");
    let text = format!(
        "orbits = {orbits}\nseed = {seed}\npace = {PACE:?}\nplanner = \"lookahead\"\n[requests.random]\n\
         count = [1500, 1500]\n"
    );
    std::fs::write(&file, text)?;
    let out = folder.path().join("out");
    let environment = sortie::here()?;
    let mut flight = Flight::launch(&file, &out, environment.domain, &[])?;
    flight.wait_for_tasks(1)?;
    let witness = Witness::start(environment.domain, &out)?;
    let strike = || strike_each(seed, stops, &witness, &out);
    let (recovery_s, acknowledged) = sortie::fly(flight, &out, &environment, strike)?;
    let reward_nominal = sortie::nominal(&file, &folder.path().join("nominal"))?;
    Ok(Flown { stops, recovery_s, acknowledged, reward: sortie::reward(&out)?, reward_nominal })
}

/// Kills or stops each node once, in random order and at random moments; how long it took until its work was done again
/// [s].
fn strike_each(seed: u64, stops: bool, witness: &Witness, out: &Path) -> Result<Vec<(String, f64)>> {
    let mut rng = StdRng::seed_from_u64(seed);
    let mut nodes = NODES;
    nodes.shuffle(&mut rng);
    let mut recovery_s = Vec::new();
    for node in nodes {
        std::thread::sleep(Duration::from_secs_f64(rng.random_range(PAUSE_S)));
        let before = witness.work(node)?;
        let pid = witness::process(node.1, out).with_context(|| format!("there is no {}", node.0))?;
        signal(pid, if stops { "-STOP" } else { "-KILL" });
        let struck = Instant::now();
        witness.wait_for_more(node, before)?;
        recovery_s.push((node.0.to_owned(), struck.elapsed().as_secs_f64()));
        if stops {
            std::thread::sleep(STOPPED.saturating_sub(struck.elapsed()));
            signal(pid, "-CONT");
        }
    }
    Ok(recovery_s)
}
