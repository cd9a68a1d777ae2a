//! Each node of a paced mission is killed at a random moment, or stopped for ten seconds: how long until its work is done
//! again, what is lost, and what the mission earns less. `soak_kills --plan`, or `soak_kills FIRST COUNT`; a seed is a
//! mission in which that happens to each of its five nodes, in every fifth one by stopping.
#![allow(missing_docs, clippy::print_stdout, reason = "a program for people")]

#[path = "../common/flight.rs"]
#[allow(dead_code, reason = "others use more of it")]
mod flight;
#[path = "../chaos_over_dds/look.rs"]
#[allow(dead_code, reason = "others use more of it")]
mod look;
#[path = "../chaos_over_dds/operator.rs"]
#[allow(dead_code, reason = "others use more of it")]
mod operator;
#[path = "../common/request.rs"]
mod request;
#[path = "../common/soak.rs"]
mod soak;
mod witness;

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use rand::rngs::StdRng;
use rand::seq::SliceRandom as _;
use rand::{RngExt as _, SeedableRng as _};
use serde_json::{Value, json};

use crate::flight::{Flight, signal, swath};
use crate::operator::Operator;
use crate::witness::{NODES, Witness};

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
    let domain = own_domain();
    let mut flight = Flight::launch(&file, &out, domain, &[])?;
    flight.wait_for_tasks(1)?;
    let witness = Witness::start(domain, &out)?;
    let over = AtomicBool::new(false);
    let (recovery_s, acknowledged) = std::thread::scope(|scope| -> Result<_> {
        let submitter = scope.spawn(|| submit_until(&over, domain));
        let killed = strike_each(seed, stops, &witness, &out);
        let ended = wait_for_end(&mut flight);
        over.store(true, Ordering::Relaxed);
        let acknowledged = submitter.join().unwrap_or_else(|_| anyhow::bail!("the operator has failed"));
        ended?;
        Ok((killed?, acknowledged?))
    })
    .with_context(|| flight.said())?;
    let (_, summary, _) = flight.end()?;
    ensure!(summary.failure.is_none(), "it has failed: {:?}: {}", summary.failure, flight.said());
    look::check(&out, &acknowledged)?;
    let nominal = nominal(&file, &folder.path().join("nominal"))?;
    let reward = look::lines(&out.join("tasks.jsonl"))?.iter().filter_map(|it| it["reward"].as_f64()).sum();
    Ok(Flown { stops, recovery_s, acknowledged: acknowledged.len(), reward, reward_nominal: nominal })
}

fn own_domain() -> u16 {
    let own = std::env::var("ROS_DOMAIN_ID").ok().and_then(|it| it.parse().ok());
    own.unwrap_or(100 + (std::process::id() % 130) as u16)
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

fn wait_for_end(flight: &mut Flight) -> Result<()> {
    let began = Instant::now();
    while flight.flies()? {
        ensure!(began.elapsed() < Duration::from_secs(200), "it does not end by itself: {}", flight.said());
        std::thread::sleep(Duration::from_millis(50));
    }
    Ok(())
}

fn submit_until(over: &AtomicBool, domain: u16) -> Result<BTreeMap<String, u64>> {
    let mut operator = Operator::start(domain)?;
    while !over.load(Ordering::Relaxed) {
        operator.turn()?;
    }
    Ok(operator.acknowledged)
}

/// What the mission earns where nothing fails.
fn nominal(file: &Path, out: &Path) -> Result<f64> {
    let mut launch = Command::new(swath()?);
    let flown = launch.arg("launch").arg(file).arg("--in-process").arg("--out").arg(out).output()?;
    ensure!(flown.status.success(), "{}", String::from_utf8_lossy(&flown.stderr));
    Ok(look::lines(&out.join("tasks.jsonl"))?.iter().filter_map(|it| it["reward"].as_f64()).sum())
}
