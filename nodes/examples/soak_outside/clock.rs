//! A machine whose clock is moved by an hour, forwards and back, under the nodes.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use anyhow::{Result, ensure};
use serde_json::{Value, json};

use crate::common::flight::{Flight, swath};
use crate::common::sortie;
use crate::{Mission, needs};

/// What moves the clock of the processes that load it.
const LIBRARY: &str = "/usr/lib/x86_64-linux-gnu/faketime/libfaketimeMT.so.1";
/// The clock, one after the other.
const CLOCKS: [&str; 5] = ["+3600", "-3600", "+0", "+3600", "+0"];

/// The clock of all nodes is moved several times, in a paced mission with an operator, and in one in lockstep, which has
/// the tasks of the same mission in one process.
pub fn moves(mission: &Mission) -> Result<Value> {
    needs(LIBRARY, "install Debian's libfaketime")?;
    let now = mission.out("now");
    let environment = sortie::here()?;
    let launch = |file: &Path, out: &Path, words: &[&str]| {
        set(&now, "+0")?;
        let mut swath = Command::new(swath()?);
        swath.env("ROS_DOMAIN_ID", environment.domain.to_string()).env("ROS_LOCALHOST_ONLY", "1");
        swath.env("LD_PRELOAD", LIBRARY).env("FAKETIME_TIMESTAMP_FILE", &now).env("FAKETIME_NO_CACHE", "1");
        swath.env("FAKETIME_DONT_FAKE_MONOTONIC", "1").env("DONT_FAKE_MONOTONIC", "1");
        Flight::start(swath, file, out, words)
    };
    let file = mission.file("clock", 0.9, 100.0, "")?;
    let out = mission.out("clock");
    let pushed = || {
        CLOCKS.iter().try_for_each(|clock| {
            set(&now, clock)?;
            flies_on(&out)
        })
    };
    let ((), acknowledged) = sortie::fly(launch(&file, &out, &[])?, &out, &environment, pushed)?;
    let nominal = sortie::nominal(&file, &mission.out("nominal"))?;
    let file = mission.file("lockstep", 12.0, 0.0, "")?;
    let out = mission.out("lockstep");
    let mut flight = launch(&file, &out, &["--no-bag"])?;
    flight.wait_for_tasks(1)?;
    for clock in CLOCKS {
        ensure!(flight.flies()?, "it ended before its clock was moved");
        set(&now, clock)?;
        std::thread::sleep(Duration::from_secs(3));
    }
    let (well, _, tasks) = flight.end()?;
    ensure!(well, "the mission in lockstep has failed: {}", flight.said());
    let mut alone = Flight::launch(&file, &mission.out("alone"), environment.domain, &["--in-process"])?;
    ensure!(alone.end()?.2 == tasks, "other tasks in lockstep than in one process");
    Ok(json!({ "clock_acknowledged": acknowledged, "clock_reward": [sortie::reward(&mission.out("clock"))?],
        "clock_reward_nominal": [nominal], "clock_alarms": alarms(&mission.out("clock"))? }))
}

/// Moves the clock by so many seconds.
fn set(file: &Path, clock: &str) -> Result<()> {
    let next = file.with_extension("next");
    fs::write(&next, clock)?;
    Ok(fs::rename(next, file)?)
}

/// The mission flies on: three more tasks.
fn flies_on(out: &Path) -> Result<()> {
    let tasks = || fs::read_to_string(out.join("tasks.jsonl")).map_or(0, |text| text.lines().count());
    let before = tasks();
    sortie::until("more tasks", Duration::from_secs(20), || (tasks() > before + 2).then_some(()))?;
    std::thread::sleep(Duration::from_secs(2));
    Ok(())
}

/// How many alarms were raised.
fn alarms(out: &Path) -> Result<usize> {
    let journal = crate::common::look::lines(&out.join("alarms.jsonl"))?;
    Ok(journal.iter().filter(|line| line["event"] == "raised").count())
}
