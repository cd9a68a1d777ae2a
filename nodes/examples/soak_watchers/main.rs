//! What those who look cost a mission: `cargo xtask soak watchers`, or `soak_watchers FIRST COUNT` for some seeds;
//! prints one JSON object.
//!
//! For each seed a mission is flown in lockstep and paced, with a console and a bridge: with nobody who looks, with ten
//! readers of the console's facts, with fifty clients of Foxglove that take every topic, and with the same of which one
//! takes nothing. Speeds are told as shares of that with nobody who looks. Those who look run at the lowest priority,
//! so that what is told is what serving them costs. The tasks must be those of the same mission in one process.
#![allow(clippy::print_stdout, missing_docs, reason = "a measuring tool")]

#[path = "../common/flight.rs"]
#[allow(dead_code, reason = "others use more of it")]
mod flight;
#[path = "../common/server.rs"]
#[allow(dead_code, reason = "others use more of it")]
mod server;
#[path = "../common/soak.rs"]
mod soak;
mod watchers;

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Result, ensure};
use flight::Flight;
use serde_json::{Value, json};
use server::Server;
use watchers::Watchers;

const DOMAIN: u16 = 147;
const MISSION: &str = "planner = \"heuristic:90\"\n[requests.random]\ncount = [3000, 3000]\n";
/// Orbits and paces of the two kinds of missions.
const KINDS: [(&str, &str, &str); 2] = [("lockstep", "5", "0"), ("paced", "1", "300")];
/// Who looks: readers of facts, clients of Foxglove, and how many of these are stuck.
const CROWDS: [(&str, [usize; 3]); 3] =
    [("ten_consoles", [10, 0, 0]), ("fifty_foxglove", [0, 50, 0]), ("fifty_foxglove_one_stuck", [0, 49, 1])];

fn main() -> Result<()> {
    soak::run(3, measure)
}

fn measure(seeds: std::ops::Range<u64>) -> Result<Value> {
    let folder = tempfile::tempdir()?;
    let mission = folder.path().join("mission.toml");
    std::fs::write(&mission, MISSION)?;
    let mut shares: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    let (mut differ, mut told) = (0, 0);
    for seed in seeds {
        for (kind, orbits, pace) in KINDS {
            let words = ["--seed", &seed.to_string(), "--orbits", orbits, "--pace", pace, "--no-bag"];
            let out = |name: &str| folder.path().join(format!("{kind}-{seed}-{name}"));
            let alone = Flight::launch(&mission, &out("in-process"), DOMAIN, &[&words[..], &["--in-process"]].concat());
            let (_, _, expected) = alone?.end()?;
            let mut fly = |name: &str, crowd: [usize; 3]| -> Result<f64> {
                let (factor, tasks, bytes) = fly(&mission, &out(name), &words, crowd)?;
                differ += u64::from(tasks != expected);
                told += bytes;
                eprintln!("{kind}, seed {seed}, {name}: {factor:.0} times real time, {bytes} B told");
                Ok(factor)
            };
            let nobody = fly("nobody", [0; 3])?;
            for (name, crowd) in CROWDS {
                shares.entry(format!("{kind}_{name}_share")).or_default().push(fly(name, crowd)? / nobody);
            }
        }
    }
    let mut result = json!(shares);
    result["missions_with_other_tasks"] = differ.into();
    result["bytes_told"] = told.into();
    Ok(result)
}

/// Flies a mission before a crowd: its speed, its tasks, and how much the crowd was told [B].
fn fly(mission: &Path, out: &Path, words: &[&str], crowd: [usize; 3]) -> Result<(f64, String, u64)> {
    let [readers, clients, stuck] = crowd;
    let (console, bridge) = (Server::start("console", DOMAIN, &[])?, Server::start("bridge", DOMAIN, &[])?);
    let mut watchers = Watchers::default();
    let mut flight = Flight::launch(mission, out, DOMAIN, words)?;
    for _ in 0..readers {
        watchers.read_facts(&console.address)?;
    }
    for number in 0..clients + stuck {
        watchers.take_topics(&bridge.address, number >= clients)?;
    }
    let (well, summary, tasks) = flight.end()?;
    ensure!(well, "the mission failed: {}", flight.said());
    drop((console, bridge));
    let told = watchers.told();
    ensure!(told > 0 || readers + clients == 0, "nobody was told anything");
    Ok((summary.real_time_factor, tasks, told))
}
