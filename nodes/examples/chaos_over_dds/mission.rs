//! Missions with faults drawn from seeds, as they fly over DDS.

use anyhow::{Context, Result};
use rand::RngExt as _;
use swath_mission::faults::grammar::{Failure, Process};
use swath_mission::faults::{FaultPlan, PlannedFault, What};
use swath_mission::file::Mission;
use swath_sim::rng;

/// Most faults that are drawn for a mission, besides those of spacecraft and recorder.
const FAULTS: u64 = 5;
/// The radio of missions that have one.
const LINK: &str = "[link]\nmode = \"always\"\nprocessing_s = 2.0\nloss = 0.1\nstrip_bits = 50e6\n";
/// Length of a mission [orbits].
const ORBITS: f64 = 0.2;

/// Whether an operator asks for strips on the way.
pub fn has_operator(seed: u64) -> bool {
    seed % 2 == 1
}

/// Whether its recording has no gap.
pub fn is_recorded(mission: &Mission) -> bool {
    let gap = |fault: &PlannedFault| matches!(fault.what, What::Process(Process::Recorder, _) | What::BagFull);
    !mission.faults.plan.iter().any(gap)
}

/// The file of a seed's mission, and its faults.
pub fn over_dds(seed: u64) -> Result<(String, Vec<PlannedFault>)> {
    let planner = ["lookahead", "heuristic:90", "beam"][(seed / 2 % 3) as usize];
    // A third flies over a radio.
    let link = if seed % 3 == 2 { LINK } else { "" };
    let head = format!(
        "orbits = {ORBITS}\nseed = {seed}\nplanner = \"{planner}\"\n[requests.random]\ncount = [600, 600]\n{link}"
    );
    let random = 1 + seed % FAULTS;
    let drawn: Mission = toml::from_str(&format!("{head}[faults]\nrandom = {random}\n"))?;
    let model = drawn.model()?;
    let (horizon, period) = (drawn.horizon(&model), model.period);
    let mut plan = FaultPlan::default();
    let others = of_processes(seed, period.time_s(horizon));
    for fault in drawn.resolved().faults.plan.into_iter().chain(others) {
        let mut with = plan.clone();
        with.plan.push(as_over_dds(fault));
        if with.validate(horizon, period).is_ok() && with.fits_dds().is_ok() {
            plan = with;
        }
    }
    let faults: Vec<String> = plan.plan.iter().map(ToString::to_string).collect();
    let text = format!("{head}[faults]\nplan = {faults:?}\n");
    let mission: Mission = toml::from_str(&text)?;
    mission.validate().context("faults were drawn that cannot be flown")?;
    Ok((text, plan.plan))
}

/// Request manager and recorder are replaced at once.
fn as_over_dds(fault: PlannedFault) -> PlannedFault {
    match fault.what {
        What::Process(Process::RequestManager | Process::Recorder, _) => PlannedFault { for_s: None, ..fault },
        _ => fault,
    }
}

/// Faults of the nodes that no mission in one process has.
fn of_processes(seed: u64, end_s: f64) -> Vec<PlannedFault> {
    let mut rng = rng::stream(seed, rng::FAULTS + 1000);
    let mut draw = |process| {
        let failure = if rng.random_bool(0.7) { Failure::Kill } else { Failure::Hang };
        let at_s = (rng.random_range(0.05..0.9) * end_s * 10.0_f64).round() / 10.0;
        let drawn = PlannedFault { what: What::Process(process, failure), at_s: Some(at_s), for_s: None };
        rng.random_bool(0.5).then_some(drawn)
    };
    [Process::Spacecraft, Process::Recorder].into_iter().filter_map(&mut draw).collect()
}
