//! What a foreign peer costs a mission that floods it under its own nodes' names: `cargo xtask soak flood`, or
//! `soak_flood FIRST COUNT` for some seeds; prints one JSON object.
//!
//! For each seed a mission is flown in lockstep and paced, alone and with a peer that is called `spacecraft` and sends
//! 10 000 messages a second on the mission's topics: such as its nodes send, such as nobody can read, and such of other
//! types. The tasks must be those of the same mission in one process; speeds are told as shares of that alone.
#![allow(clippy::print_stdout, missing_docs, reason = "a measuring tool")]

#[path = "common/mod.rs"]
#[allow(dead_code, reason = "others use more of it")]
mod common;

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Result, bail, ensure};
use serde_json::Value;
use swath_msgs::RosMessage;
use swath_msgs::swath_msgs as msg;
use swath_ros::{Cdr, Environment, Node, RawPublisher, RosArgs, encode, graph};

use crate::common::company::{Kind, Pairing};
use crate::common::{company, soak};

const DOMAIN: u16 = 152;
const MISSION: &str = "planner = \"lookahead\"\n[requests.random]\ncount = [3000, 3000]\n";
/// Orbits and paces of the two kinds of missions.
const KINDS: [Kind; 2] = [("lockstep", "20", "0"), ("paced", "0.3", "20")];
/// Messages a second.
const RATE: f64 = 10_000.0;
/// How often the peer sends what is due.
const TURN: Duration = Duration::from_millis(1);

fn main() -> Result<()> {
    soak::run(3, measure)
}

fn measure(seeds: std::ops::Range<u64>) -> Result<Value> {
    let mut sent_a_second = Vec::new();
    let mut result = company::measure(seeds, (MISSION, &KINDS, DOMAIN), |mission| {
        let flight = mission.launch("alone")?;
        let alone = mission.land("alone", flight)?;
        let (flooded, rate) = flood(mission)?;
        mission.share("flooded", flooded / alone);
        sent_a_second.push(rate);
        Ok(())
    })?;
    result["sent_a_second"] = sent_a_second.into();
    Ok(result)
}

/// Flies a mission in a flood; its speed, and how many messages were sent a second.
fn flood(mission: &mut Pairing<'_>) -> Result<(f64, f64)> {
    let mut flight = mission.launch("flooded")?;
    flight.wait_for_tasks(1)?;
    let over = AtomicBool::new(false);
    let (speed, rate) = std::thread::scope(|scope| {
        let peer = scope.spawn(|| Peer::start()?.flood_until(&over));
        let speed = mission.land("flooded", flight);
        over.store(true, Ordering::Relaxed);
        (speed, peer.join().unwrap_or_else(|_| bail!("the peer has failed")))
    });
    Ok((speed?, rate?))
}

/// A peer that has the name of one of the mission's nodes.
struct Peer {
    writers: Vec<(RawPublisher, Cdr)>,
    _node: Node,
}

impl Peer {
    fn start() -> Result<Self> {
        let environment = Environment { domain: DOMAIN, localhost_only: true, ..Environment::read()? };
        // As one that is started again it does not mind that there is one of this name.
        let words = ["spacecraft", "--ros-args", "-p", "epoch:=9"].map(str::to_owned);
        let node = Node::start_in(environment, graph::SPACECRAFT, &RosArgs::split(words)?.1)?;
        let mut writers = Vec::new();
        let mut add = |entry: &graph::Entry, type_name: &str, cdr: Cdr| -> Result<()> {
            writers.push((node.raw_publisher(entry.name, type_name, &entry.profile.qos())?, cdr));
            Ok(())
        };
        let garbage = || Cdr::from_bytes([&[0, 1, 0, 0][..], &[0xff; 60]].concat());
        let state = encode(&msg::SpacecraftState { tick: 1 << 40, ..Default::default() })?;
        let torque = encode(&msg::WheelTorque { tick: 1 << 40, ..Default::default() })?;
        let task = encode(&msg::ImagingTask::default())?;
        let point = encode(&msg::DecisionPoint::default())?;
        for (entry, valid) in [
            (graph::SPACECRAFT_STATE.entry, state),
            (graph::WHEEL_TORQUE.entry, torque),
            (graph::PLANNER_TASK.entry, task),
            (graph::DECISION_POINT.entry, point),
        ] {
            add(&entry, entry.type_name, valid)?;
            add(&entry, entry.type_name, garbage())?;
            add(&entry, msg::StripRequest::TYPE_NAME, encode(&msg::StripRequest::default())?)?;
        }
        Ok(Self { writers, _node: node })
    }

    /// Sends messages until the mission is over; how many a second.
    fn flood_until(&self, over: &AtomicBool) -> Result<f64> {
        let (began, mut sent) = (Instant::now(), 0.0);
        while !over.load(Ordering::Relaxed) {
            while sent < began.elapsed().as_secs_f64() * RATE && !over.load(Ordering::Relaxed) {
                for (writer, cdr) in &self.writers {
                    // One that has no room for it has a reader that does not listen.
                    let _ = writer.publish(cdr.clone());
                    sent += 1.0;
                }
            }
            std::thread::sleep(TURN);
        }
        let rate = sent / began.elapsed().as_secs_f64();
        ensure!(rate > 0.0, "nothing was sent");
        Ok(rate)
    }
}
