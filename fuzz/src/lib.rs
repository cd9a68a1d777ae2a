//! What is fuzzed: each function takes bytes as they may come from outside, and panics where something is wrong.

use std::path::Path;

use clap::{Parser, Subcommand};
use swath_ground::{launch, operate, passes};
use swath_mission::faults::grammar::{PlannedFault, Process};
use swath_mission::faults::plan::FaultPlan;
use swath_mission::file::Mission;
use swath_msgs::RosMessage;
use swath_ros::{Cdr, RosArgs, decode, encode};
use swath_sim::time::{Tick, TickPeriod};

macro_rules! table {
    ($($kind:ty),* $(,)?) => {
        /// Every type of message, and what services send.
        const KINDS: &[fn(&[u8])] = &[$(read::<$kind>),*];
    };
}
swath_msgs::every_type!(table);

/// The bytes of a message; the first two say of which type. What can be read is written again, and is then the same.
pub fn cdr(bytes: &[u8]) {
    if let Some((&[low, high], message)) = bytes.split_first_chunk::<2>() {
        KINDS[usize::from(u16::from_le_bytes([low, high])) % KINDS.len()](message);
    }
}

fn read<M: RosMessage>(bytes: &[u8]) {
    let Ok(message) = decode::<M>(&Cdr::from_bytes(bytes.to_vec())) else { return };
    let written = encode(&message).unwrap_or_else(|error| panic!("{message:?} was read: {error}"));
    let again: M = decode(&written).unwrap_or_else(|error| panic!("{message:?} was written: {error}"));
    assert_eq!(encode(&again).ok(), Some(written), "{message:?} against {again:?}");
}

/// The text of a mission file. A mission that is valid is the same when it is written and read again.
pub fn missions(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let file = Path::new("/missions/mission.toml");
    let Ok(mission) = Mission::parse(text, file) else { return };
    let written = toml::to_string(&mission).unwrap_or_else(|error| panic!("{mission:?} was read: {error}"));
    let again = Mission::parse(&written, file).unwrap_or_else(|error| panic!("{written} was written: {error}"));
    assert_eq!(toml::to_string(&again).ok(), Some(written));
}

/// A fault plan, as TOML or one fault a line. What is valid can be scheduled, and is written as it is read.
pub fn faults(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    for fault in text.lines().filter_map(|line| line.parse::<PlannedFault>().ok()) {
        let written = fault.to_string();
        assert_eq!(written.parse::<PlannedFault>().as_ref(), Ok(&fault), "{written}");
    }
    let Ok(plan) = toml::from_str::<FaultPlan>(text) else { return };
    let Ok(period) = TickPeriod::from_frequency(2.0) else { return };
    let horizon = Tick(200_000);
    if plan.validate(horizon, period).is_err() {
        return;
    }
    let plan = plan.resolved(7, bytes.len() % 2 == 1, horizon, period);
    assert_eq!(plan.validate(horizon, period), Ok(()));
    let scheduled = plan.scheduled(period);
    assert!(scheduled.iter().all(|it| it.from <= it.until), "{scheduled:?}");
    let _ = plan.vehicle(period);
    let _ = (plan.fits_dds().is_ok(), plan.fits_one_process().is_ok());
    let _ = Process::ALL.map(|process| plan.of(process, period));
}

#[derive(Parser)]
#[command(name = "swath")]
struct Words {
    #[command(subcommand)]
    _command: Command,
}

/// What operators say; the commands without a library of their own have words of the same kinds.
#[derive(Subcommand)]
enum Command {
    Launch(launch::LaunchArgs),
    Strips(operate::StripsArgs),
    Planner(operate::PlannerArgs),
    Alarms(operate::AlarmsArgs),
    Link(operate::LinkArgs),
    Fault(operate::FaultArgs),
    Passes(passes::PassesArgs),
}

/// A command line, one word a line: what ROS takes of it, and what the program does.
pub fn words(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    // Files may be devices that never end.
    if text.contains("params-file") {
        return;
    }
    let Ok((words, ros)) = RosArgs::split(text.lines().map(str::to_owned)) else { return };
    if let Ok(names) = ros.names("/swath", "planner") {
        let _ = (ros.overrides(&names), ros.log_level_of(&names), names.resolve("~/x/y").is_ok());
    }
    let _ = Words::try_parse_from(std::iter::once("swath".to_owned()).chain(words)).is_ok();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_fuzzed_reaches_what_is_valid() {
        assert!(KINDS.len() > 100);
        for kind in 0..KINDS.len() as u16 {
            let [low, high] = kind.to_le_bytes();
            cdr(&[&[low, high, 0, 1, 0, 0][..], &[0; 4096]].concat());
        }
        missions(b"orbits = 2.0\nplanner = \"heuristic:80\"\n[faults]\nplan = [\"gyro:bias 0.01deg/s@700s\"]\n");
        faults(b"plan = [\"guidance:kill@120s\", \"wheel2:weak 50%@600s\"]\n");
        words(b"strips\nlist\n--ref\nx\n--ros-args\n-r\n__ns:=/sat2\n-p\npace:=2.0\n");
    }

    #[test]
    fn what_was_found_once_stays_mended() {
        let found = Path::new(env!("CARGO_MANIFEST_DIR")).join("found");
        type Target = fn(&[u8]);
        let targets: [(&str, Target); 4] = [("cdr", cdr), ("missions", missions), ("faults", faults), ("words", words)];
        for (name, target) in targets {
            for file in std::fs::read_dir(found.join(name)).into_iter().flatten() {
                target(&std::fs::read(file.unwrap().path()).unwrap());
            }
        }
    }
}
