//! Messages that are lost on their way, and a network that parts operator and satellite for a while.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use serde_json::{Value, json};
use swath_ros::Environment;

use crate::common::flight::{Flight, swath};
use crate::common::operator::Operator;
use crate::common::{look, sortie};
use crate::{Mission, command, rewards};

/// Simulated seconds a second.
const PACE: f64 = 20.0;
/// Length of missions whose messages are lost.
const ORBITS: f64 = 0.5;
/// The word for the operator's side of a network that parts.
pub const OPERATOR: &str = "--operator";
/// How a mission ends whose recorder has missed messages.
const LACKS_MESSAGES: &str = "node recorder has failed (exit code 3";
/// How long operator and satellite are parted.
const PARTED: Duration = Duration::from_secs(60);

/// A fifth of the messages is dropped by the endpoints, by order.
pub fn drops(mission: &Mission) -> Result<Value> {
    let file = mission.file("drops", ORBITS, PACE, "[faults]\nplan = [\"topic:drop 20%@1s+100000s\"]\n")?;
    let (reward, nominal, _) = compare(mission, "drops", &file)?;
    Ok(rewards("drops", reward, nominal))
}

/// The network loses a fifth of all datagrams.
pub fn loses(mission: &Mission) -> Result<Value> {
    let file = mission.file("loses", ORBITS, PACE, "")?;
    nft("add table inet f")?;
    nft("add chain inet f in { type filter hook input priority 0 ; }")?;
    nft("add rule inet f in meta l4proto udp numgen random mod 100 < 20 counter drop")?;
    let (reward, nominal, lacks) = compare(mission, "loses", &file)?;
    let counted = command("nft", &["list", "table", "inet", "f"])?;
    let dropped = counted.split_whitespace().skip_while(|word| *word != "packets").nth(1);
    let dropped: u64 = dropped.and_then(|it| it.parse().ok()).context("nft counts nothing")?;
    ensure!(dropped > 1000, "only {dropped} datagrams were lost");
    let mut told = rewards("loses", reward, nominal);
    told["loses_datagrams"] = dropped.into();
    told["loses_bags_that_lack_messages"] = u64::from(lacks).into();
    Ok(told)
}

/// Flies a mission without an operator, as nothing else changes its tasks; its reward, that in one process, and whether
/// its recorder has missed messages, which it says at its end.
fn compare(mission: &Mission, name: &str, file: &Path) -> Result<(f64, f64, bool)> {
    let out = mission.out(name);
    let mut flight = Flight::launch(file, &out, sortie::own_domain(), &[])?;
    let (_, summary, _) = flight.end()?;
    let lacks = |failure: &String| failure.starts_with(LACKS_MESSAGES);
    let well = summary.failure.as_ref().is_none_or(lacks);
    ensure!(well, "it has failed: {:?}: {}", summary.failure, flight.said());
    look::check(&out, &BTreeMap::new())?;
    let nominal = sortie::nominal(file, &mission.out("nominal"))?;
    Ok((sortie::reward(&out)?, nominal, summary.failure.is_some()))
}

/// Operator and satellite, in networks of their own, are parted for a minute.
pub fn parts(mission: &Mission) -> Result<Value> {
    let file = mission.file("parts", 0.45, PACE, "")?;
    let (out, noted) = (mission.out("parts"), mission.out("noted.json"));
    command("ip", &["link", "add", "space", "type", "veth", "peer", "name", "ground"])?;
    let mut apart = Command::new("unshare");
    apart.arg("--net").arg(std::env::current_exe()?).arg(OPERATOR).arg(&noted).stdin(Stdio::piped());
    let mut operator = apart.spawn().context("cannot run unshare")?;
    let pid = operator.id().to_string();
    std::thread::sleep(Duration::from_millis(500));
    command("ip", &["link", "set", "ground", "netns", &pid])?;
    command("ip", &["address", "add", "10.62.0.1/24", "dev", "space"])?;
    command("ip", &["link", "set", "space", "up"])?;
    let mut swath = Command::new(swath()?);
    swath.env("ROS_DOMAIN_ID", sortie::own_domain().to_string()).env("ROS_LOCALHOST_ONLY", "0");
    let mut flight = Flight::start(swath, &file, &out, &[])?;
    flight.wait_for_tasks(1)?;
    let parted = part(&out, &pid)?;
    let (_, summary, _) = flight.end()?;
    ensure!(summary.failure.is_none(), "it has failed: {:?}: {}", summary.failure, flight.said());
    drop(operator.stdin.take());
    ensure!(operator.wait()?.success(), "the operator has failed");
    let (acknowledged, answered_s): Noted = serde_json::from_slice(&std::fs::read(&noted)?)?;
    look::check(&out, &acknowledged)?;
    let after = answered_s.iter().find(|it| **it > parted.1).context("no answer after the partition")?;
    let during = answered_s.iter().filter(|it| (parted.0 + 1.0..parted.1).contains(it)).count();
    ensure!(during == 0, "{during} answers came through the partition");
    ensure!(answered_s.iter().any(|it| *it < parted.0), "no answer before the partition");
    Ok(json!({ "parts_acknowledged": acknowledged.len(), "parts_answered_after_s": [after - parted.1] }))
}

/// Parts the networks for a while, on the operator's side: what the satellite's nodes say to each other goes over their
/// end of the line, too. From when to when [s since 1970].
fn part(out: &Path, operator: &str) -> Result<(f64, f64)> {
    std::thread::sleep(Duration::from_secs(15));
    let nft = |words: &str| {
        let there = ["-t", operator, "-n", "nft"].into_iter().chain(words.split(' ')).collect::<Vec<_>>();
        command("nsenter", &there)
    };
    nft("add table inet f")?;
    nft("add chain inet f in { type filter hook input priority 0 ; }")?;
    nft("add chain inet f out { type filter hook output priority 0 ; }")?;
    nft("add rule inet f in iifname ground drop")?;
    nft("add rule inet f out oifname ground drop")?;
    let began = now();
    let tasks = || std::fs::read_to_string(out.join("tasks.jsonl")).map(|text| text.lines().count());
    let before = tasks()?;
    std::thread::sleep(PARTED);
    ensure!(tasks()? > before + 3, "the satellite does not fly on without its operator");
    nft("delete table inet f")?;
    Ok((began, now()))
}

fn nft(words: &str) -> Result<()> {
    command("nft", &words.split(' ').collect::<Vec<_>>()).map(|_| ())
}

fn now() -> f64 {
    std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default().as_secs_f64()
}

/// What an operator notes: numbers by reference of what was acknowledged, and when something was [s since 1970].
type Noted = (BTreeMap<String, u64>, Vec<f64>);

/// The operator's side: asks for strips until its stdin ends, and notes what it was answered.
pub fn operate(words: &[String]) -> Result<()> {
    let [noted] = words else { anyhow::bail!("an operator needs a file to note in") };
    command("ip", &["link", "set", "lo", "up", "multicast", "on"])?;
    let began = Instant::now();
    while command("ip", &["address", "add", "10.62.0.2/24", "dev", "ground"]).is_err() {
        ensure!(began.elapsed() < Duration::from_secs(20), "there is no network");
        std::thread::sleep(Duration::from_millis(100));
    }
    command("ip", &["link", "set", "ground", "up"])?;
    let environment = Environment { domain: sortie::own_domain(), localhost_only: false, ..Environment::read()? };
    let mut operator = Operator::start_in(environment)?;
    let (over, ends) = std::sync::mpsc::channel::<()>();
    std::thread::spawn(move || {
        let _ = std::io::copy(&mut std::io::stdin(), &mut std::io::sink());
        drop(over);
    });
    let mut answered_s = Vec::new();
    while ends.try_recv() == Err(std::sync::mpsc::TryRecvError::Empty) {
        let before = operator.acknowledged.len();
        operator.turn()?;
        if operator.acknowledged.len() > before {
            answered_s.push(now());
        }
    }
    Ok(std::fs::write(noted, serde_json::to_vec(&(&operator.acknowledged, answered_s))?)?)
}
