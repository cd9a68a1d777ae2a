//! Flies missions whose faults are drawn from seeds, in this process, and checks from the outside what must hold
//! whatever fails: `chaos FIRST_SEED COUNT`.
//!
//! Prints one JSON object. Exit code 1 when something did not hold; each failure tells one command that repeats it.
#![allow(missing_docs, clippy::print_stdout, reason = "a program for people")]

use std::collections::{BTreeMap, BTreeSet};
use std::process::ExitCode;

use anyhow::{Context, Result, ensure};
use serde_json::json;
use swath_mission::alarms::Entry;
use swath_mission::approval::{Gate, GatedPlanner};
use swath_mission::fallback::GuardedPlanner;
use swath_mission::faults::What;
use swath_mission::faults::plan::Scheduled;
use swath_mission::file::Mission;
use swath_mission::in_process::InProcessMission;
use swath_mission::outcome::TaskLine;
use swath_mission::requests::lifecycle::State;
use swath_sim::planner::{Beam, Heuristic, Lookahead, Planner, Random};
use swath_sim::time::Tick;
use swath_sim::vehicle::faults::FOR_GOOD;
use swath_sim::world::strip::StripId;

/// Faults of a mission.
const FAULTS: u64 = 6;

fn main() -> ExitCode {
    let numbers: Vec<u64> = std::env::args().skip(1).filter_map(|word| word.parse().ok()).collect();
    let [first, count] = numbers[..] else {
        eprintln!("usage: chaos FIRST_SEED COUNT");
        return ExitCode::FAILURE;
    };
    let (mut failed, mut faults, mut alarms, mut reward) = (Vec::new(), 0, 0, 0.0);
    for seed in first..first.saturating_add(count) {
        match fly_and_check(seed) {
            Ok((planned, flown)) => {
                faults += planned;
                alarms += flown.journal.len();
                reward += flown.lines.iter().map(|line| line.reward).sum::<f64>();
            }
            Err(error) => {
                failed.push(seed);
                eprintln!("seed {seed}: {error:#}\n  repeat with: cargo xtask chaos --first {seed} --seeds 1");
            }
        }
    }
    let ok = failed.is_empty();
    let figures = json!({
        "missions": count, "failed": failed, "faults": faults, "alarm_lines": alarms, "reward": reward,
    });
    println!("{figures}");
    if ok { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// What a mission left behind.
#[derive(PartialEq)]
struct Flown {
    lines: Vec<TaskLine>,
    journal: Vec<Entry>,
    /// States of all requests, their priorities, and the other way of each.
    requests: Vec<(State, f64, Option<StripId>)>,
}

fn mission(seed: u64) -> Result<Mission> {
    let noise = seed.is_multiple_of(3);
    let plant = if noise { "[plant]\nattitude_noise_rad = 2e-4\nrate_noise_rad_s = 6e-5\n" } else { "" };
    // A quarter flies over a radio.
    let link = if seed % 4 == 3 {
        "[link]\nmode = \"always\"\nprocessing_s = 2.0\nloss = 0.1\nstrip_bits = 50e6\n"
    } else {
        ""
    };
    let random = 1 + seed % FAULTS;
    let text = format!(
        "orbits = 0.25\nseed = {seed}\n[requests.random]\ncount = [800, 800]\n{plant}{link}[faults]\nrandom = {random}\n"
    );
    let mission: Mission = toml::from_str(&text).context("the mission is not valid")?;
    let mission = mission.resolved();
    mission.validate().context("faults were drawn that cannot be flown")?;
    Ok(mission)
}

fn planner(seed: u64) -> Box<dyn Planner + Send> {
    match seed % 8 {
        0..3 => Box::new(Lookahead::default()),
        3 => Box::new(Beam::default()),
        4 => Box::new(Random { seed }),
        _ => Box::new(Heuristic { t_pre_s: 90.0 }),
    }
}

fn fly(seed: u64) -> Result<(Mission, Flown)> {
    let mission = mission(seed)?;
    let mut flight = InProcessMission::new(&mission)?;
    let gate = Gate::new(&mission.approval, flight.model().period);
    let mut planner = GatedPlanner { gate, planner: GuardedPlanner::new(planner(seed)) };
    let mut lines = Vec::new();
    flight.run(&mut planner, |_, line| lines.push(line))?;
    let requests = (1..=flight.requests().len() as u64).map(StripId).filter_map(|id| {
        let request = flight.requests().request(id)?;
        let linked = flight.requests().strip(id).and_then(|strip| strip.linked);
        Some((request.state, request.order.request.priority, linked))
    });
    let requests = requests.collect();
    let journal = flight.board().take_journal();
    Ok((mission, Flown { lines, journal, requests }))
}

/// Number of its faults, and what it left.
fn fly_and_check(seed: u64) -> Result<(usize, Flown)> {
    let (mission, flown) = fly(seed)?;
    let plan = mission.faults.plan.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
    check(&mission, &flown).with_context(|| format!("faults {plan}"))?;
    ensure!(fly(seed)?.1 == flown, "the same seed twice gives two missions; faults {plan}");
    Ok((mission.faults.plan.len(), flown))
}

fn check(mission: &Mission, flown: &Flown) -> Result<()> {
    let model = mission.model()?;
    let horizon = mission.horizon(&model);
    check_tasks(flown, horizon)?;
    check_requests(mission, flown)?;
    check_journal(flown, horizon)?;
    for scheduled in mission.faults.scheduled(model.period) {
        check_alarm(&scheduled, flown, horizon)?;
    }
    Ok(())
}

/// Tasks follow each other in number and time, and the mission goes on to its end.
fn check_tasks(flown: &Flown, horizon: Tick) -> Result<()> {
    let mut end = 0;
    for (number, line) in (0..).zip(&flown.lines) {
        ensure!(line.task == number, "task {} is told as number {number}", line.task);
        ensure!(line.start_tick >= end && line.end_tick >= line.start_tick, "task {number} begins before its time");
        ensure!(line.end_tick <= horizon.0, "task {number} ends after the mission");
        ensure!(line.max_attitude_error.is_finite() && line.reward.is_finite(), "task {number} tells no numbers");
        end = line.end_tick;
    }
    // Guidance may be lost at the end for as long as a fault is drawn to last.
    ensure!(end + 300 >= horizon.0, "the last task ends at {end}, the mission at {}", horizon.0);
    Ok(())
}

/// What was asked for is there; what was imaged is imaged once, and pays its priority.
fn check_requests(mission: &Mission, flown: &Flown) -> Result<()> {
    let accepted = InProcessMission::new(mission)?.counts().1;
    ensure!(flown.requests.len() == accepted, "{accepted} requests were accepted, {} are there", flown.requests.len());
    let mut imaged = BTreeSet::new();
    for line in flown.lines.iter().filter(|line| line.success) {
        let id = line.strip.context("a task without a strip has succeeded")?;
        let (state, priority, linked) = flown.requests.get(id as usize - 1).context("an unknown strip was imaged")?;
        ensure!(imaged.insert(id), "strip {id} was imaged twice");
        ensure!(linked.is_none_or(|other| !imaged.contains(&other.0)), "strip {id} was imaged both ways");
        ensure!(line.reward == *priority, "strip {id} paid {}, its priority is {priority}", line.reward);
        ensure!(*state == State::Completed, "strip {id} was imaged and is {}", state.name());
    }
    ensure!(flown.lines.iter().all(|line| line.success || line.reward == 0.0), "a failure was paid for");
    let completed = flown.requests.iter().filter(|(state, ..)| *state == State::Completed).count();
    ensure!(completed >= imaged.len(), "{} strips were imaged, {completed} are completed", imaged.len());
    Ok(())
}

/// Lines are numbered, in order of time, and each alarm is raised and returns in turn.
fn check_journal(flown: &Flown, horizon: Tick) -> Result<()> {
    let (mut before, mut standing) = (Tick(0), BTreeMap::new());
    for (number, entry) in (1..).zip(&flown.journal) {
        ensure!(entry.number == number && entry.tick >= before && entry.tick <= horizon, "the journal is out of order");
        before = entry.tick;
        let raised = entry.event == swath_mission::alarms::Event::Raised;
        let was = standing.insert(entry.key.clone(), raised).unwrap_or(false);
        ensure!(was != raised, "{} of {} is {:?} twice", entry.key.name, entry.key.node, entry.event);
    }
    Ok(())
}

/// What is told of by order is raised at its tick; what shows by itself is raised while it acts, if it shows.
fn check_alarm(scheduled: &Scheduled, flown: &Flown, horizon: Tick) -> Result<()> {
    let name = match scheduled.what {
        What::Process(process, _) => format!("{} lost", process.name()),
        What::Drop(_) => "messages dropped".to_owned(),
        What::FramesLost(_) => "frames lost".to_owned(),
        What::StoreFull => "store full".to_owned(),
        What::BagFull => "bag full".to_owned(),
        // A wheel shows when it is asked for torque, a bias when it stands out of the noise.
        What::Vehicle(_) => return Ok(()),
    };
    let from = scheduled.from;
    let of = |entry: &&Entry| entry.key.name == name && entry.tick >= from;
    let first = flown.journal.iter().find(of).with_context(|| format!("{name} at {from} raised no alarm"))?;
    ensure!(first.tick == from || scheduled.until == from, "{name} at {from} was raised at {}", first.tick);
    if scheduled.until != FOR_GOOD && scheduled.until.after(10) < horizon {
        let last = scheduled.until.after(10);
        let returned =
            flown.journal.iter().any(|entry| of(&entry) && !entry.beneath.eq(&first.beneath) && entry.tick <= last);
        ensure!(returned, "{name} did not return by {last}");
    }
    Ok(())
}
