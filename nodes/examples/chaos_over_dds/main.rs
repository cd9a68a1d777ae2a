//! Flies missions whose faults are drawn from seeds over DDS, with an operator who asks for strips, and checks from the
//! outside what must hold whatever fails: `chaos_over_dds FIRST_SEED COUNT`.
//!
//! Prints one JSON object. Exit code 1 when something did not hold; each failure tells one command that repeats it.
#![allow(missing_docs, clippy::print_stdout, reason = "a program for people")]

#[path = "../common/mod.rs"]
#[allow(dead_code, reason = "others use more of it")]
mod common;
mod mission;

use std::path::Path;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use serde_json::json;
use swath_mission::file::Mission;

use crate::common::flight::Flight;
use crate::common::operator::Acknowledged;
use crate::common::{look, operator};

/// How long a mission may take in all, restarts and hung nodes included.
const LIMIT: Duration = Duration::from_secs(300);

/// What a mission tells for the figures.
#[derive(Default)]
struct Flown {
    faults: usize,
    alarms: usize,
    acknowledged: usize,
    seconds: f64,
}

fn main() -> ExitCode {
    let numbers: Vec<u64> = std::env::args().skip(1).filter_map(|word| word.parse().ok()).collect();
    let [first, count] = numbers[..] else {
        eprintln!("usage: chaos_over_dds FIRST_SEED COUNT");
        return ExitCode::FAILURE;
    };
    let (mut failed, mut sum, mut longest) = (Vec::new(), Flown::default(), 0.0_f64);
    for seed in first..first.saturating_add(count) {
        match fly_and_check(seed) {
            Ok(flown) => {
                sum.faults += flown.faults;
                sum.alarms += flown.alarms;
                sum.acknowledged += flown.acknowledged;
                longest = longest.max(flown.seconds);
            }
            Err(error) => {
                failed.push(seed);
                eprintln!(
                    "seed {seed}: {error:#}\n  repeat with: cargo xtask chaos --first {seed} --seeds 1 --over-dds"
                );
            }
        }
    }
    let ok = failed.is_empty();
    let figures = json!({
        "missions": count, "failed": failed, "faults": sum.faults, "alarm_lines": sum.alarms,
        "acknowledged": sum.acknowledged, "max_seconds": longest,
    });
    println!("{figures}");
    if ok { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// The domain of this process: those of other tests and missions are others.
fn domain() -> u16 {
    let own = std::env::var("ROS_DOMAIN_ID").ok().and_then(|it| it.parse().ok());
    own.unwrap_or(100 + (std::process::id() % 130) as u16)
}

fn fly_and_check(seed: u64) -> Result<Flown> {
    let folder = tempfile::tempdir()?;
    let (text, plan) = mission::over_dds(seed)?;
    let told = plan.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
    let file = folder.path().join("mission.toml");
    std::fs::write(&file, text)?;
    let out = folder.path().join("out");
    let flown = fly(seed, &file, &out).with_context(|| format!("faults {told}"));
    let acknowledged = flown?;
    check(seed, &file, &out, &acknowledged).with_context(|| format!("faults {told}"))?;
    Ok(Flown {
        faults: plan.len(),
        alarms: look::lines(&out.join("alarms.jsonl"))?.len(),
        acknowledged: acknowledged.requests.len(),
        seconds: acknowledged.seconds,
    })
}

fn check(seed: u64, file: &Path, out: &Path, acknowledged: &Acknowledged) -> Result<()> {
    look::check(out, &acknowledged.requests)?;
    look::check_alarms(file, out)?;
    match (mission::has_operator(seed), mission::is_recorded(&Mission::read(file)?)) {
        (true, true) => look::same_again(out),
        // What was asked for while nothing was recorded, nobody knows.
        (true, false) => Ok(()),
        (false, _) => look::same_in_one_process(file, out),
    }
}

/// Flies a mission to its end; every other one with an operator.
fn fly(seed: u64, file: &Path, out: &Path) -> Result<Acknowledged> {
    let began = Instant::now();
    let mut flight = Flight::launch(file, out, domain(), &[])?;
    let mut operator = if mission::has_operator(seed) { Some(operator::Operator::start(domain())?) } else { None };
    while flight.flies()? {
        if began.elapsed() > LIMIT {
            bail!("it has not ended within {} s: {}", LIMIT.as_secs(), flight.said());
        }
        match &mut operator {
            Some(operator) => operator.turn()?,
            None => std::thread::sleep(Duration::from_millis(50)),
        }
    }
    let (_, summary, _) = flight.end()?;
    ensure!(summary.failure.is_none(), "it has failed: {:?}: {}", summary.failure, flight.said());
    let requests = operator.map(|it| it.acknowledged).unwrap_or_default();
    Ok(Acknowledged { requests, seconds: began.elapsed().as_secs_f64() })
}
