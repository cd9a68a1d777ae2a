//! Nodes that stop for ten seconds, or start and fail again and again: `cargo xtask soak stops`, or
//! `soak_stops FIRST COUNT`. A seed stops one of the five nodes: at first each is killed by the launcher when it gives no
//! sign of life, then each again in a mission whose launcher cannot kill, so that the stopped node comes to life beside
//! the one that has taken its place, and then planner and guidance fail whenever they are started again.
//!
//! What must hold of every mission holds: what was acknowledged is kept, once, tasks follow each other, the bag is valid.
#![allow(missing_docs, clippy::print_stdout, reason = "a program for people")]

#[path = "../common/mod.rs"]
#[allow(dead_code, reason = "others use more of it")]
mod common;
mod looping;
mod withheld;

use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use serde_json::{Value, json};

use crate::common::flight::{Flight, signal, swath};
use crate::common::witness::{NODES, Name, Witness};
use crate::common::{soak, sortie, witness};

/// Five nodes that are killed, five that cannot be, and two that fail again and again.
const SEEDS: u64 = 12;
/// How long nodes are stopped.
const STOPPED: Duration = Duration::from_secs(10);
/// How long it may take until something is seen, or a node replaced.
const LIMIT: Duration = Duration::from_secs(20);

fn main() -> Result<()> {
    soak::run(SEEDS, |seeds| {
        let mut all = json!({ "failed": [] });
        for seed in seeds {
            let found = match seed {
                0..5 => stop(NODES[seed as usize], true),
                5..10 => stop(NODES[seed as usize - 5], false),
                _ => looping::fails_again_and_again(seed),
            };
            match found {
                Ok(found) => all[format!("{seed}")] = found,
                Err(error) => {
                    eprintln!("seed {seed}: {error:#}");
                    all["failed"].as_array_mut().into_iter().for_each(|list| list.push(seed.into()));
                }
            }
        }
        Ok(all)
    })
}

/// A node stops for ten seconds.
fn stop(node: Name, killed: bool) -> Result<Value> {
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("mission.toml");
    let text = "orbits = 0.9\nseed = 7\npace = 100.0\nplanner = \"lookahead\"\n[requests.random]\ncount = [1500, 1500]\n\
         [supervision]\norphaned_s = 10.0\n";
    std::fs::write(&file, text)?;
    let out = folder.path().join("out");
    let environment = sortie::here()?;
    let mut launch = Command::new(swath()?);
    launch.env("ROS_DOMAIN_ID", environment.domain.to_string()).env("ROS_LOCALHOST_ONLY", "1");
    if !killed {
        withheld::cannot_kill(&mut launch);
    }
    let mut flight = Flight::start(launch, &file, &out, &[])?;
    flight.wait_for_tasks(1)?;
    let witness = Witness::start(environment.domain, &out)?;
    let (found, acknowledged) = sortie::fly(flight, &out, &environment, || watch(node, &witness, &out, killed))?;
    let mut told = json!({ "node": node.0, "killed": killed, "acknowledged": acknowledged });
    for (key, seconds) in found {
        told[key] = ((seconds * 1000.0).round() / 1000.0).into();
    }
    Ok(told)
}

/// Stops a node and watches what comes of it; seconds since it was stopped, or was let go on.
fn watch(node: Name, witness: &Witness, out: &Path, killed: bool) -> Result<Vec<(&'static str, f64)>> {
    std::thread::sleep(Duration::from_secs(2));
    let before = witness.work(node)?;
    let pid = witness::process(node.1, out).with_context(|| format!("there is no {}", node.0))?;
    signal(pid, "-STOP");
    let struck = Instant::now();
    let raised = |name: &str| sortie::events(out, &format!("{} {name}", node.0)).into_iter().next();
    let (_, seen) = sortie::until("warning", LIMIT, || raised("silent"))?;
    sortie::until("alarm", LIMIT, || raised("lost"))?;
    let lost = struck.elapsed().as_secs_f64();
    witness.wait_for_more(node, before)?;
    let works = struck.elapsed().as_secs_f64();
    std::thread::sleep(STOPPED.saturating_sub(struck.elapsed()));
    signal(pid, "-CONT");
    let told = vec![("seen_s", seen), ("lost_s", lost), ("works_again_s", works)];
    if killed {
        return Ok(told);
    }
    ensure!(Path::new(&format!("/proc/{pid}")).exists(), "it was killed after all");
    let (_, ended) = sortie::until("end of its own", LIMIT, || withheld::has_ended(pid).then_some(()))?;
    // The one in its place is another one, and works.
    let now = witness::process(node.1, out).filter(|other| *other != pid).context("nobody is in its place")?;
    let tasks = || std::fs::read_to_string(out.join("tasks.jsonl")).map_or(0, |text| text.lines().count());
    let before = tasks();
    sortie::until("more tasks", LIMIT, || (tasks() > before + 2).then_some(()))?;
    ensure!(witness::process(node.1, out) == Some(now), "the one in its place was replaced, too");
    Ok([told, vec![("ended_by_itself_s", ended)]].concat())
}
