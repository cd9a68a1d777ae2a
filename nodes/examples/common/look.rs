//! What must hold of a mission whatever failed, seen from the outside: by its files and by the programs of the suite.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use anyhow::{Context, Result, bail, ensure};
use serde_json::Value;
use swath_bags::{Bag, Filter};
use swath_mission::faults::What;
use swath_mission::file::Mission;
use swath_mission::requests::lifecycle::State;
use swath_msgs::rosgraph_msgs::Clock;
use swath_ros::{Cdr, decode};
use swath_sim::vehicle::faults::FOR_GOOD;

use super::flight::swath;
use super::operator::SUBMITTER;

/// Checks what must hold of every mission that has ended: `requests` were acknowledged.
pub fn check(out: &Path, requests: &BTreeMap<String, u64>) -> Result<()> {
    check_tasks(out)?;
    check_requests(out, requests)?;
    check_bag(out)
}

/// The recording flown again is the same mission, with what operators asked for, and when.
pub fn same_again(out: &Path) -> Result<()> {
    let again = run(Command::new(swath()?).arg("refly").arg(out.join("bag")))?;
    ensure!(again.status.success(), "flown again it is another mission: {}", said(&again));
    Ok(())
}

/// The values of a file, one a line.
pub fn lines(path: &Path) -> Result<Vec<Value>> {
    let text = if path.exists() { fs::read_to_string(path)? } else { String::new() };
    text.lines().map(|line| Ok(serde_json::from_str(line)?)).collect()
}

fn run(command: &mut Command) -> Result<Output> {
    command.output().with_context(|| format!("cannot run {command:?}"))
}

fn said(output: &Output) -> String {
    format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr))
}

/// Tasks follow each other in number and time, and nothing is imaged twice.
fn check_tasks(out: &Path) -> Result<()> {
    let (mut end, mut imaged) = (0, BTreeSet::new());
    for (number, line) in (0..).zip(lines(&out.join("tasks.jsonl"))?) {
        let tick = |key: &str| line[key].as_u64().with_context(|| format!("task {number} has no {key}"));
        ensure!(tick("task")? == number, "task {number} is told as {}", line["task"]);
        ensure!(tick("start_tick")? >= end && tick("end_tick")? >= tick("start_tick")?, "task {number} is out of time");
        end = tick("end_tick")?;
        if line["success"] == true {
            let strip = tick("strip")?;
            ensure!(imaged.insert(strip), "strip {strip} was imaged twice");
        }
    }
    Ok(())
}

/// What was acknowledged is kept, once, and went through legal states only.
fn check_requests(out: &Path, acknowledged: &BTreeMap<String, u64>) -> Result<()> {
    let store = out.join("requests.sqlite");
    let export = |words: &[&str]| -> Result<String> {
        let output = run(Command::new(swath()?).args(["strips", "export", "--store"]).arg(&store).args(words))?;
        ensure!(output.status.success(), "the store cannot be read: {}", said(&output));
        Ok(String::from_utf8(output.stdout)?)
    };
    let kept: Value = serde_json::from_str(&export(&[])?)?;
    let features = kept["features"].as_array().context("the store has no features")?;
    let mut ids = BTreeMap::new();
    for properties in features.iter().map(|it| &it["properties"]).filter(|it| it["submitter"] == SUBMITTER) {
        let reference = properties["client_ref"].as_str().unwrap_or_default().to_owned();
        let id = properties["id"].as_u64().unwrap_or_default();
        ensure!(ids.insert(reference.clone(), id).is_none(), "{reference} is kept twice");
    }
    for (reference, id) in acknowledged {
        ensure!(
            ids.get(reference) == Some(id),
            "{reference} was acknowledged as {id}, kept is {:?}",
            ids.get(reference)
        );
    }
    let trail: Result<Vec<Value>, _> = export(&["--trail"])?.lines().map(serde_json::from_str).collect();
    check_trail(&trail?)
}

fn check_trail(trail: &[Value]) -> Result<()> {
    let (mut states, mut completed) = (BTreeMap::new(), BTreeSet::new());
    for (number, line) in (1..).zip(trail) {
        ensure!(line["sequence"] == number, "the trail has a gap before {number}");
        let name = line["state"].as_str().unwrap_or_default();
        let Some(state) = State::ALL.into_iter().find(|state| state.name() == name) else {
            bail!("{name} is no state");
        };
        let id = line["strip"].as_u64().unwrap_or_default();
        let before = states.insert(id, state);
        let legal = id == 0 || before.is_none_or(|before| before.step(state).is_ok());
        ensure!(legal, "strip {id} was {before:?} and is {state:?}");
        ensure!(state != State::Completed || completed.insert(id), "strip {id} is completed twice");
    }
    Ok(())
}

/// Each alarm is raised and returns in turn, and each fault that is told of by order has its own.
pub fn check_alarms(file: &Path, out: &Path) -> Result<()> {
    let journal = lines(&out.join("alarms.jsonl"))?;
    let mut standing = BTreeMap::new();
    for entry in &journal {
        let raised = entry["event"] == "raised";
        let key = format!("{}", entry["key"]);
        let key = if entry["key"].is_null() { format!("{} {}", entry["node"], entry["name"]) } else { key };
        let was = standing.insert(key.clone(), raised).unwrap_or(false);
        ensure!(was != raised, "{key} is {} twice", entry["event"]);
    }
    let mission = Mission::read(file)?;
    let model = mission.model()?;
    let horizon = mission.horizon(&model);
    for it in mission.faults.scheduled(model.period) {
        let name = match it.what {
            What::Process(process, _) => format!("{} lost", process.name()),
            What::Drop(_) => "messages dropped".to_owned(),
            What::FramesLost(_) => "frames lost".to_owned(),
            What::StoreFull => "store full".to_owned(),
            What::BagFull => "bag full".to_owned(),
            What::Vehicle(_) => continue,
        };
        let of = |event: &str, from: u64, until: u64| {
            let is = |entry: &&Value| entry["name"] == name.as_str() && entry["event"] == event;
            let ticks = journal.iter().filter(is).filter_map(|entry| entry["tick"].as_u64());
            ticks.into_iter().any(|tick| (from..=until).contains(&tick))
        };
        ensure!(of("raised", it.from.0.saturating_sub(10), it.from.0), "{name} at {} raised no alarm", it.from);
        let last = it.until.0.saturating_add(10);
        if it.until != FOR_GOOD && last < horizon.0 {
            ensure!(of("returned", it.from.0, last), "{name} of {} did not return by {last}", it.from);
        }
    }
    Ok(())
}

/// The bag is valid, and time never goes back in it.
fn check_bag(out: &Path) -> Result<()> {
    let program = swath()?.with_file_name("swath-bag");
    let validated = run(Command::new(program).arg("validate").arg(out.join("bag")))?;
    ensure!(validated.status.success(), "the bag is not valid: {}", said(&validated));
    let bag = Bag::open(&out.join("bag"))?;
    let topics = swath_bags::TopicPattern::new(&["/clock".to_owned()], None, None)?;
    let mut messages = bag.messages(&Filter { topics, ..Filter::default() })?;
    let mut last = None;
    while let Some(message) = messages.next()? {
        let clock: Clock = decode(&Cdr::from_bytes(message.data.to_vec()))?;
        let now = (clock.clock.sec, clock.clock.nanosec);
        ensure!(last <= Some(now), "time went back from {last:?} to {now:?}");
        last = Some(now);
    }
    Ok(())
}

/// Tasks and what happened to alarms are those of the same mission in one process; what cannot fail there has its alarms
/// over DDS alone.
pub fn same_in_one_process(file: &Path, out: &Path) -> Result<()> {
    let mut mission = Mission::read(file)?;
    mission.faults = std::mem::take(&mut mission.faults).within_one_process();
    let alone = out.with_extension("alone.toml");
    fs::write(&alone, toml::to_string(&mission)?)?;
    let again = out.with_extension("alone");
    let mut launch = Command::new(swath()?);
    let flown = run(launch.arg("launch").arg(&alone).arg("--in-process").arg("--out").arg(&again))?;
    ensure!(matches!(flown.status.code(), Some(0 | 3)), "it cannot be flown in one process: {}", said(&flown));
    let tasks = |out: &Path| fs::read_to_string(out.join("tasks.jsonl"));
    ensure!(tasks(out)? == tasks(&again)?, "other tasks than in one process");
    let alarms = |out: &Path| -> Result<Vec<Value>> {
        let mut journal = lines(&out.join("alarms.jsonl"))?;
        journal.retain(|entry| entry["name"] != "spacecraft lost" && entry["name"] != "recorder lost");
        journal.iter_mut().filter_map(Value::as_object_mut).for_each(|entry| _ = entry.remove("number"));
        Ok(journal)
    };
    let (over_dds, in_process) = (alarms(out)?, alarms(&again)?);
    ensure!(over_dds == in_process, "other alarms than in one process: {over_dds:?} and {in_process:?}");
    Ok(())
}
