//! What readers of CycloneDDS that sleep, die or lag cost a mission: `cargo xtask soak guests`, or `soak_guests FIRST COUNT`
//! for some seeds; prints one JSON object.
//!
//! For each seed a mission is flown in lockstep and paced: alone, with one reader of every state that is stopped, with
//! ten that read, and with ten of which two are stopped, two are killed and one takes ten messages a second. Speeds are
//! told as shares: with one that is stopped of that alone, with ten of that with ten that read. The tasks must be those
//! of the same mission in one process.
#![allow(clippy::print_stdout, missing_docs, reason = "a measuring tool")]

#[path = "common/mod.rs"]
#[allow(dead_code, reason = "others use more of it")]
mod common;

use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use anyhow::{Context, Result, ensure};
use serde_json::Value;

use crate::common::company::{Kind, Pairing};
use crate::common::flight::{python, signal};
use crate::common::{company, soak};

const DOMAIN: u16 = 149;
const MISSION: &str = "planner = \"lookahead\"\n[requests.random]\ncount = [3000, 3000]\n";
/// Orbits and paces of the two kinds of missions: twenty seconds each.
const KINDS: [Kind; 2] = [("lockstep", "20", "0"), ("paced", "2", "500")];
const STATES: &str = "/swath/spacecraft/state";

fn main() -> Result<()> {
    soak::run(5, measure)
}

fn measure(seeds: std::ops::Range<u64>) -> Result<Value> {
    company::measure(seeds, (MISSION, &KINDS, DOMAIN), |mission| {
        let mut fly = |name: &str, guests: &[Habit]| fly(mission, name, guests);
        let (alone, stopped) = (fly("alone", &[])?, fly("one-stopped", &[Habit::Stopped])?);
        let (healthy, mixed) = (fly("ten-healthy", &[Habit::Healthy; 10])?, fly("ten-mixed", &Habit::MIXED)?);
        mission.share("one_stopped", stopped / alone);
        mission.share("ten_mixed", mixed / healthy);
        Ok(())
    })
}

/// Flies a mission with guests; its speed.
fn fly(mission: &mut Pairing<'_>, name: &str, guests: &[Habit]) -> Result<f64> {
    let mut guests = guests.iter().map(|habit| Guest::start(*habit)).collect::<Result<Vec<_>>>()?;
    for guest in &mut guests {
        ensure!(guest.line()? == "ready", "a reader did not come up");
    }
    let mut flight = mission.launch(name)?;
    flight.wait_for_tasks(1)?;
    for guest in &mut guests {
        ensure!(guest.line()? == "reading", "a reader does not read");
    }
    guests.iter().for_each(Guest::misbehave);
    mission.land(name, flight)
}

#[derive(Clone, Copy)]
enum Habit {
    Healthy,
    Stopped,
    Killed,
    Slow,
}

impl Habit {
    const MIXED: [Self; 10] = [
        Self::Stopped,
        Self::Stopped,
        Self::Killed,
        Self::Killed,
        Self::Slow,
        Self::Healthy,
        Self::Healthy,
        Self::Healthy,
        Self::Healthy,
        Self::Healthy,
    ];
}

/// A reader of CycloneDDS in a process of its own.
struct Guest {
    habit: Habit,
    child: Child,
    lines: BufReader<std::process::ChildStdout>,
}

impl Guest {
    fn start(habit: Habit) -> Result<Self> {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("ros/tests/python/reader.py");
        let mut command = Command::new(python()?);
        command.arg("-u").arg(script).args([&DOMAIN.to_string(), STATES, &u64::MAX.to_string()]);
        if matches!(habit, Habit::Slow) {
            command.arg("10");
        }
        command.env("CYCLONEDDS_URI", "<General><Interfaces><NetworkInterface name='lo'/></Interfaces></General>");
        let mut child = command.stdout(Stdio::piped()).spawn()?;
        let lines = BufReader::new(child.stdout.take().context("a reader without output")?);
        Ok(Self { habit, child, lines })
    }

    fn line(&mut self) -> Result<String> {
        let mut line = String::new();
        self.lines.read_line(&mut line)?;
        Ok(line.trim().to_owned())
    }

    fn misbehave(&self) {
        match self.habit {
            Habit::Stopped => signal(self.child.id(), "-STOP"),
            Habit::Killed => signal(self.child.id(), "-KILL"),
            Habit::Healthy | Habit::Slow => {}
        }
    }
}

impl Drop for Guest {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
