//! Missions over the radio whose nodes are killed: `cargo xtask soak link`, or `soak_link FIRST COUNT` for some seeds;
//! prints one JSON object.
//!
//! For each seed a mission is flown over 1, 3 and 7 stations, without loss and with a loss of 20 %, in one process and
//! over DDS; over DDS link, catalogue and request manager are killed at random moments on the way. Tasks and the ways of
//! all requests must be the same, byte by byte.
#![allow(clippy::unwrap_used, clippy::print_stdout, missing_docs, reason = "a measuring tool")]

#[path = "common/mod.rs"]
#[allow(dead_code, reason = "others use more of it")]
mod common;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::Result;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

use crate::common::flight::{Flight, signal};
use crate::common::soak;

const DOMAIN: u16 = 151;
/// Stations and orbits: as many kills fit into each.
const STATIONS: [(&str, &str); 3] = [
    ("\"merritt\"", "15"),
    ("\"puertollano\", \"awarua\", \"punta-arenas\"", "10"),
    ("\"boulder\", \"merritt\", \"singapore\", \"weilheim\", \"santiago\", \"dongara\", \"hawaii\"", "8"),
];
/// Nodes that are killed every few seconds are not given up.
const KILLED_OFTEN: &str = "[supervision]\nstarts = 1000\nbackoff_max_s = 0.5";
const VICTIMS: [&str; 3] = ["swath-link", "swath-catalogue", "swath-requests"];

fn main() -> Result<()> {
    soak::run(20, measure)
}

fn measure(seeds: std::ops::Range<u64>) -> Result<Value> {
    let folder = tempfile::tempdir()?;
    let mut counts: BTreeMap<String, u64> = BTreeMap::new();
    let mut add = |key: &str, count: u64| *counts.entry(key.to_owned()).or_default() += count;
    for seed in seeds {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        for (number, (stations, orbits)) in STATIONS.iter().enumerate() {
            for loss in ["0.0", "0.2"] {
                let mission = folder.path().join("mission.toml");
                let link =
                    format!("[link]\nstations = [{stations}]\nstrip_bits = 50e6\nuplink_bps = 16e3\nloss = {loss}");
                std::fs::write(&mission, format!("[requests.random]\ncount = [1500, 1500]\n{link}\n{KILLED_OFTEN}\n"))?;
                let words = ["--seed", &seed.to_string(), "--orbits", orbits, "--planner", "lookahead", "--no-bag"];
                let out = |kind: &str| folder.path().join(format!("{seed}-{number}-{loss}-{kind}"));
                let alone = [&words[..], &["--in-process"]].concat();
                Flight::launch(&mission, &out("alone"), DOMAIN, &alone)?.end()?;
                let mut flight = Flight::launch(&mission, &out("killed"), DOMAIN, &words)?;
                flight.wait_for_tasks(1)?;
                while flight.flies()? {
                    std::thread::sleep(Duration::from_millis(rng.random_range(500..4000)));
                    let victim = VICTIMS[rng.random_range(0..VICTIMS.len())];
                    for process in processes(victim, &out("killed")) {
                        signal(process, "-KILL");
                        add(&format!("{victim}_killed"), 1);
                    }
                }
                let (well, _, _) = flight.end()?;
                add("missions", 1);
                add("missions_that_failed", u64::from(!well));
                let same = |name: &str| -> Result<u64> {
                    let read = |kind: &str| std::fs::read_to_string(out(kind).join(name));
                    Ok(u64::from(read("killed")? != read("alone")?))
                };
                add("missions_with_other_tasks", same("tasks.jsonl")?);
                add("missions_with_other_ways_of_strips", same("strips.jsonl")?);
            }
        }
    }
    Ok(json!(counts))
}

/// Processes of a program that work for the mission in a folder.
fn processes(program: &str, out: &Path) -> Vec<u32> {
    let ours = |folder: PathBuf| {
        let process: u32 = folder.file_name()?.to_str()?.parse().ok()?;
        let words = std::fs::read(folder.join("cmdline")).ok()?;
        let words: Vec<String> = words.split(|&byte| byte == 0).map(|it| String::from_utf8_lossy(it).into()).collect();
        let out = out.display().to_string();
        (words.first()?.ends_with(program) && words.iter().any(|word| word.contains(&out))).then_some(process)
    };
    let all = std::fs::read_dir("/proc").into_iter().flatten().filter_map(Result::ok);
    all.filter_map(|entry| ours(entry.path())).collect()
}
