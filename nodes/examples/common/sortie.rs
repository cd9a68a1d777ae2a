//! Missions in which an operator asks for strips while something befalls them, and what must hold of them then.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use serde_json::Value;
use swath_ros::Environment;

use super::flight::{Flight, swath};
use super::look;
use super::operator::Operator;

/// How long a mission may go on after all that befalls it.
const LIMIT: Duration = Duration::from_secs(300);

/// The domain of this process: those of other tests and missions are others.
pub fn own_domain() -> u16 {
    let own = std::env::var("ROS_DOMAIN_ID").ok().and_then(|it| it.parse().ok());
    own.unwrap_or(100 + (std::process::id() % 130) as u16)
}

/// This host alone, in the domain of this process.
pub fn here() -> Result<Environment> {
    Ok(Environment { domain: own_domain(), localhost_only: true, ..Environment::read()? })
}

/// Flies a mission to its end while something befalls it and an operator asks for strips, and checks what must hold
/// whatever fails; what `befall` tells, and how many strips were acknowledged.
pub fn fly<T>(
    mut flight: Flight,
    out: &Path,
    environment: &Environment,
    befall: impl FnOnce() -> Result<T>,
) -> Result<(T, usize)> {
    flight.wait_for_tasks(1)?;
    let over = AtomicBool::new(false);
    let (told, acknowledged) = std::thread::scope(|scope| -> Result<_> {
        let submitter = scope.spawn(|| submit_until(&over, environment));
        let told = befall();
        let ended = wait_for_end(&mut flight);
        over.store(true, Ordering::Relaxed);
        let acknowledged = submitter.join().unwrap_or_else(|_| bail!("the operator has failed"));
        ended?;
        Ok((told?, acknowledged?))
    })
    .with_context(|| flight.said())?;
    let (_, summary, _) = flight.end()?;
    ensure!(summary.failure.is_none(), "it has failed: {:?}: {}", summary.failure, flight.said());
    look::check(out, &acknowledged)?;
    Ok((told, acknowledged.len()))
}

fn wait_for_end(flight: &mut Flight) -> Result<()> {
    let began = Instant::now();
    while flight.flies()? {
        ensure!(began.elapsed() < LIMIT, "it does not end by itself: {}", flight.said());
        std::thread::sleep(Duration::from_millis(50));
    }
    Ok(())
}

fn submit_until(over: &AtomicBool, environment: &Environment) -> Result<BTreeMap<String, u64>> {
    let mut operator = Operator::start_in(environment.clone())?;
    while !over.load(Ordering::Relaxed) {
        operator.turn()?;
    }
    Ok(operator.acknowledged)
}

/// What a mission has earned.
pub fn reward(out: &Path) -> Result<f64> {
    Ok(look::lines(&out.join("tasks.jsonl"))?.iter().filter_map(|it| it["reward"].as_f64()).sum())
}

/// What the mission earns where nothing fails: in one process.
pub fn nominal(file: &Path, out: &Path) -> Result<f64> {
    let mut launch = Command::new(swath()?);
    let flown = launch.arg("launch").arg(file).arg("--in-process").arg("--out").arg(out).output()?;
    ensure!(flown.status.success(), "{}", String::from_utf8_lossy(&flown.stderr));
    reward(out)
}

/// What has happened to an alarm of a mission so far; a last line that is not whole is left out.
pub fn events(out: &Path, name: &str) -> Vec<Value> {
    let text = std::fs::read_to_string(out.join("alarms.jsonl")).unwrap_or_default();
    let lines = text.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
    lines.filter(|line| line["name"] == name).collect()
}

/// Waits until something is there; how long that took [s].
pub fn until<T>(what: &str, limit: Duration, mut look: impl FnMut() -> Option<T>) -> Result<(T, f64)> {
    let began = Instant::now();
    loop {
        if let Some(found) = look() {
            return Ok((found, began.elapsed().as_secs_f64()));
        }
        ensure!(began.elapsed() < limit, "no {what} within {} s", limit.as_secs());
        std::thread::sleep(Duration::from_millis(2));
    }
}
