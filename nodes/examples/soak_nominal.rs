//! A day on which nothing fails: `cargo xtask soak nominal`, or `soak_nominal FIRST COUNT` for some seeds; prints one
//! JSON object.
//!
//! For each seed a mission of more than 24 hours is flown over DDS in lockstep, recorded. It must end well, and no alarm
//! may be raised.
#![allow(clippy::print_stdout, missing_docs, reason = "a measuring tool")]

#[path = "common/mod.rs"]
#[allow(dead_code, reason = "others use more of it")]
mod common;

use anyhow::{Result, ensure};
use serde_json::json;

use crate::common::flight::Flight;
use crate::common::soak;

const DOMAIN: u16 = 154;
/// More than a day.
const MISSION: &str = "orbits = 15.4\nplanner = \"lookahead\"\n[requests.random]\ncount = [30000, 30000]\n";

fn main() -> Result<()> {
    soak::run(3, |seeds| {
        let folder = tempfile::tempdir()?;
        let mission = folder.path().join("mission.toml");
        std::fs::write(&mission, MISSION)?;
        let (mut hours, mut alarms, mut imaged) = (0.0, 0, 0);
        for seed in seeds {
            let out = folder.path().join(seed.to_string());
            let mut flight = Flight::launch(&mission, &out, DOMAIN, &["--seed", &seed.to_string()])?;
            let (well, summary, tasks) = flight.end()?;
            ensure!(well, "the mission failed: {}", flight.said());
            hours += summary.sim_seconds / 3600.0;
            imaged += tasks.matches("\"success\":true").count();
            // There is no such file where nothing happened to alarms.
            alarms += std::fs::read_to_string(out.join("alarms.jsonl")).unwrap_or_default().lines().count();
        }
        Ok(json!({ "hours": hours, "imaged": imaged, "alarm_lines": alarms }))
    })
}
