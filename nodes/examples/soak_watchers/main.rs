//! What those who look cost a mission: `cargo xtask soak watchers`, or `soak_watchers FIRST COUNT` for some seeds;
//! prints one JSON object.
//!
//! For each seed a mission is flown in lockstep and paced, with a console and a bridge: with nobody who looks, with ten
//! readers of the console's facts, with fifty clients of Foxglove that take every topic, and with the same of which one
//! takes nothing. Speeds are told as shares of that with nobody who looks. Those who look run at the lowest priority,
//! so that what is told is what serving them costs. The tasks must be those of the same mission in one process.
#![allow(clippy::print_stdout, missing_docs, reason = "a measuring tool")]

#[path = "../common/mod.rs"]
#[allow(dead_code, reason = "others use more of it")]
mod common;
mod watchers;

use anyhow::{Result, ensure};
use serde_json::Value;
use watchers::Watchers;

use crate::common::company::{Kind, Pairing};
use crate::common::server::Server;
use crate::common::{company, soak};

const DOMAIN: u16 = 147;
const MISSION: &str = "planner = \"heuristic:90\"\n[requests.random]\ncount = [3000, 3000]\n";
/// Orbits and paces of the two kinds of missions.
const KINDS: [Kind; 2] = [("lockstep", "5", "0"), ("paced", "1", "300")];
/// Who looks: readers of facts, clients of Foxglove, and how many of these are stuck.
const CROWDS: [(&str, [usize; 3]); 3] =
    [("ten_consoles", [10, 0, 0]), ("fifty_foxglove", [0, 50, 0]), ("fifty_foxglove_one_stuck", [0, 49, 1])];

fn main() -> Result<()> {
    soak::run(3, measure)
}

fn measure(seeds: std::ops::Range<u64>) -> Result<Value> {
    let mut told = 0;
    let mut result = company::measure(seeds, (MISSION, &KINDS, DOMAIN), |mission| {
        let mut fly = |name: &str, crowd: [usize; 3]| -> Result<f64> {
            let (factor, bytes) = fly(mission, name, crowd)?;
            told += bytes;
            Ok(factor)
        };
        let nobody = fly("nobody", [0; 3])?;
        let crowds = CROWDS.map(|(name, crowd)| (name, fly(name, crowd)));
        for (name, factor) in crowds {
            mission.share(name, factor? / nobody);
        }
        Ok(())
    })?;
    result["bytes_told"] = told.into();
    Ok(result)
}

/// Flies a mission before a crowd: its speed, and how much the crowd was told [B].
fn fly(mission: &mut Pairing<'_>, name: &str, crowd: [usize; 3]) -> Result<(f64, u64)> {
    let [readers, clients, stuck] = crowd;
    let (console, bridge) = (Server::start("console", DOMAIN, &[])?, Server::start("bridge", DOMAIN, &[])?);
    let mut watchers = Watchers::default();
    let flight = mission.launch(name)?;
    for _ in 0..readers {
        watchers.read_facts(&console.address)?;
    }
    for number in 0..clients + stuck {
        watchers.take_topics(&bridge.address, number >= clients)?;
    }
    let factor = mission.land(name, flight)?;
    drop((console, bridge));
    let told = watchers.told();
    ensure!(told > 0 || readers + clients == 0, "nobody was told anything");
    Ok((factor, told))
}
