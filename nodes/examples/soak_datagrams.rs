//! Missions in storms of damaged datagrams: `cargo xtask soak datagrams`, or `soak_datagrams FIRST COUNT` for some seeds;
//! prints one JSON object.
//!
//! For each seed a mission is flown in lockstep and paced, and a stranger sends back, damaged, what its nodes sent to it:
//! 5000 datagrams, each to all of them. It must end by itself, with the tasks of the same mission in one process.
#![allow(clippy::unwrap_used, clippy::print_stdout, missing_docs, reason = "a measuring tool")]

#[path = "common/mod.rs"]
#[allow(dead_code, reason = "others use more of it")]
mod common;
#[path = "../tests/it/storm.rs"]
mod storm;
#[path = "../ros/tests/it/stranger.rs"]
#[allow(dead_code, reason = "others use more of it")]
mod stranger;

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use anyhow::{Result, ensure};
use serde_json::{Value, json};
use storm::Storm;

use crate::common::flight::Flight;
use crate::common::soak;

const DOMAIN: u16 = 148;
const MISSION: &str = "planner = \"lookahead\"\n[requests.random]\ncount = [3000, 3000]\n";
/// Orbits and paces of the two kinds of missions: half a minute each under a storm.
const KINDS: [(&str, &str, &str); 2] = [("lockstep", "12", "0"), ("paced", "1.5", "500")];
const DATAGRAMS: u64 = 5000;

fn main() -> Result<()> {
    soak::run(20, measure)
}

fn measure(seeds: std::ops::Range<u64>) -> Result<Value> {
    let folder = tempfile::tempdir()?;
    let mission = folder.path().join("mission.toml");
    std::fs::write(&mission, MISSION)?;
    let mut counts: BTreeMap<String, u64> = BTreeMap::new();
    let mut add = |key: String, count: u64| *counts.entry(key).or_default() += count;
    for seed in seeds {
        for (kind, orbits, pace) in KINDS {
            let words = ["--seed", &seed.to_string(), "--orbits", orbits, "--pace", pace, "--no-bag"];
            let out = |name: &str| folder.path().join(format!("{kind}-{seed}-{name}"));
            let alone = Flight::launch(&mission, &out("alone"), DOMAIN, &[&words[..], &["--in-process"]].concat());
            let (_, _, expected) = alone?.end()?;
            let mut flight = Flight::launch(&mission, &out("storm"), DOMAIN, &words)?;
            flight.wait_for_tasks(1)?;
            let mut storm = Storm::gather(DOMAIN, seed);
            ensure!(storm.kinds().len() >= 7, "only these kinds of submessages were heard: {:x?}", storm.kinds());
            let sent = storm.rage(DATAGRAMS, || flight.flies().unwrap_or(false));
            let flew_on = flight.flies()?;
            let (well, summary, tasks) = flight.end()?;
            if !well {
                eprintln!("{kind}, seed {seed}: {}", flight.said());
            }
            eprintln!("{kind}, seed {seed}: {sent} datagrams, {:.0} times real time", summary.real_time_factor);
            add(format!("{kind}_datagrams"), sent);
            add(format!("{kind}_missions"), 1);
            add(format!("{kind}_missions_that_ended_before_the_storm"), u64::from(!flew_on));
            add(format!("{kind}_missions_that_failed"), u64::from(!well));
            add(format!("{kind}_missions_with_other_tasks"), u64::from(tasks != expected));
            for alarm in alarms(&out("storm")) {
                add(format!("{kind}_missions_with_alarm_{alarm}"), 1);
            }
        }
    }
    Ok(json!(counts))
}

/// The names of the alarms of a mission.
fn alarms(out: &Path) -> BTreeSet<String> {
    let journal = std::fs::read_to_string(out.join("alarms.jsonl")).unwrap_or_default();
    let lines = journal.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
    lines.filter_map(|alarm| Some(alarm["name"].as_str()?.replace(' ', "_"))).collect()
}
