//! What being supervised costs a mission in lockstep: `cargo xtask soak supervision`, or `soak_supervision FIRST COUNT`
//! for some seeds; prints one JSON object.
//!
//! For each seed a mission is flown by `swath launch`, and by the same nodes without a launcher: nobody listens to their
//! signs of life, keeps alarms or follows the mission. Speeds, between the first decision and the end, are told as
//! shares of that without, the middle of three pairs.
#![allow(clippy::print_stdout, missing_docs, reason = "a measuring tool")]

#[path = "common/mod.rs"]
#[allow(dead_code, reason = "others use more of it")]
mod common;

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use serde_json::json;
use swath_ros::{Environment, Node, RosArgs, Subscription, graph};

use crate::common::flight::{Flight, signal, swath};
use crate::common::soak;

const DOMAIN: u16 = 153;
const PROGRAMS: [&str; 4] = ["swath-spacecraft", "swath-guidance", "swath-planner", "swath-requests"];
const PAIRS: usize = 3;
const LIMIT: Duration = Duration::from_secs(300);

fn main() -> Result<()> {
    soak::run(5, |seeds| {
        let (mut shares, mut supervised_s, mut alone_s) = (Vec::new(), Vec::new(), Vec::new());
        for seed in seeds {
            let (with, without) = measure(seed)?;
            let mut pairs: Vec<f64> = with.iter().zip(&without).map(|(with, without)| without / with).collect();
            pairs.sort_by(f64::total_cmp);
            shares.push(pairs[PAIRS / 2]);
            supervised_s.extend(with);
            alone_s.extend(without);
        }
        Ok(json!({ "supervised_share": shares, "supervised_s": supervised_s, "alone_s": alone_s }))
    })
}

/// How long each flight of a mission took, with supervision and without [s].
fn measure(seed: u64) -> Result<(Vec<f64>, Vec<f64>)> {
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("mission.toml");
    let text =
        format!("orbits = 10.0\nseed = {seed}\nplanner = \"heuristic:90\"\n[requests.random]\ncount = [1500, 1500]\n");
    std::fs::write(&file, text)?;
    let (mut with, mut without) = (Vec::new(), Vec::new());
    for pair in 0..PAIRS {
        let supervised = || fly_supervised(&file, &folder.path().join(format!("out-{pair}")));
        // Which of them comes first changes, should the machine change with time.
        if pair.is_multiple_of(2) {
            with.push(supervised()?);
            without.push(fly_alone(&file)?);
        } else {
            without.push(fly_alone(&file)?);
            with.push(supervised()?);
        }
    }
    Ok((with, without))
}

fn fly_supervised(file: &Path, out: &Path) -> Result<f64> {
    let clock = Clock::start()?;
    let mut flight = Flight::launch(file, out, DOMAIN, &["--no-bag"])?;
    let seconds = clock.seconds().with_context(|| flight.said())?;
    flight.end()?;
    Ok(seconds)
}

fn fly_alone(file: &Path) -> Result<f64> {
    let clock = Clock::start()?;
    let start = |program: &&str| -> Result<Alone> {
        let mut command = Command::new(swath()?.with_file_name(program));
        command.args(["--ros-args", "-p", &format!("mission:={}", file.display())]);
        command.env("ROS_DOMAIN_ID", DOMAIN.to_string()).env("ROS_LOCALHOST_ONLY", "1");
        Ok(Alone(command.stdout(Stdio::null()).stderr(Stdio::null()).spawn()?))
    };
    let _nodes = PROGRAMS.iter().map(start).collect::<Result<Vec<_>>>()?;
    clock.seconds()
}

/// A node without a launcher.
struct Alone(Child);

impl Drop for Alone {
    fn drop(&mut self) {
        signal(self.0.id(), "-INT");
        // It has ended, or does so now.
        let _ = self.0.wait();
    }
}

/// Sees the first decision of a mission, and the last one.
struct Clock {
    points: Subscription<swath_msgs::swath_msgs::DecisionPoint>,
    node: Node,
}

impl Clock {
    fn start() -> Result<Self> {
        let environment = Environment { domain: DOMAIN, localhost_only: true, ..Environment::read()? };
        let node = Node::start_in(environment, "listener", &RosArgs::default())?;
        Ok(Self { points: node.subscription(&graph::DECISION_POINT)?, node })
    }

    fn seconds(&self) -> Result<f64> {
        let (began, mut first) = (Instant::now(), None);
        while began.elapsed() < LIMIT {
            while let Some(point) = self.points.take()? {
                let first = *first.get_or_insert_with(Instant::now);
                if point.mission_over {
                    return Ok(first.elapsed().as_secs_f64());
                }
            }
            self.node.wait(Duration::from_millis(100))?;
        }
        bail!("it has not ended")
    }
}
