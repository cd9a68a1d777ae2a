//! How well the ground predicts what the satellite does: shares of imaging tasks that were exactly as predicted and of
//! strips that were imaged about when they were predicted to be, and the time until flight and prediction part, for an
//! exact plant and for others, with nothing lost and with a fifth of the frames lost. Prints a Markdown table.
//!
//! ```sh
//! cargo run --release -p swath-mission --example prediction -- 3
//! ```
#![allow(clippy::print_stdout, reason = "a measuring tool")]

use anyhow::{Context, Result};
use swath_mission::file::Mission;
use swath_mission::in_process::InProcessMission;
use swath_mission::mirror::parting::Cause;
use swath_mission::mirror::{Mirror, Score};
use swath_sim::planner::Lookahead;
use swath_sim::time::Tick;

/// Half a day.
const ORBITS: f64 = 8.0;
/// Satellites that are flown: name, and what `[plant]` says.
const PLANTS: [(&str, &str); 4] = [
    ("as its model", ""),
    ("torque -1 %", "torque_limit_scale = 0.99"),
    ("inertia +1 %", "inertia_scale = 1.01"),
    ("sensor noise", "attitude_noise_rad = 1.94e-4\nrate_noise_rad_s = 6.2e-5"),
];

fn main() -> Result<()> {
    let seeds: u64 = std::env::args().nth(1).map_or(Ok(3), |text| text.parse()).context("SEEDS is a number")?;
    println!(
        "| satellite | loss | tasks | exactly as predicted | strips foretold | partings | median time until | causes |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- |");
    for (name, plant) in PLANTS {
        for loss in [0.0, 0.2] {
            let scores = (1..=seeds).map(|seed| fly(seed, plant, loss)).collect::<Result<Vec<_>>>()?;
            println!("| {name} | {:.0} % | {} |", loss * 100.0, columns(&scores));
        }
    }
    Ok(())
}

/// Flies a mission over three stations with the mirror beside, which looks at what came down after each pass.
fn fly(seed: u64, plant: &str, loss: f64) -> Result<Score> {
    let text = format!(
        "seed = {seed}\norbits = {ORBITS}\nplanner = \"lookahead\"\n[requests.random]\ncount = [1500, 1500]\n[plant]\n{plant}\n\
         [link]\nstations = [\"puertollano\", \"awarua\", \"punta-arenas\"]\nloss = {loss}\n"
    );
    let mission: Mission = toml::from_str(&text)?;
    mission.validate()?;
    let mission = mission.resolved();
    let mut flight = InProcessMission::watched(&mission, Vec::new())?;
    let mut mirror = Mirror::new(&mission, Box::new(Lookahead::default()))?;
    let mut planner = Lookahead::default();
    loop {
        for told in flight.take_told() {
            mirror.tell(&told)?;
        }
        if flight.step(&mut planner, Tick(u64::MAX))?.is_none() {
            break;
        }
    }
    mirror.look(flight.horizon())?;
    Ok(mirror.score().clone())
}

fn columns(scores: &[Score]) -> String {
    let sum = |of: fn(&Score) -> u64| scores.iter().map(of).sum::<u64>();
    let share = |of: u64, all: u64| if all == 0 { 100.0 } else { 100.0 * of as f64 / all as f64 };
    let partings: Vec<_> = scores.iter().flat_map(|score| &score.partings).collect();
    let mut times: Vec<i64> = partings.iter().map(|it| it.at.since(it.since)).collect();
    times.sort_unstable();
    let median = times.get(times.len() / 2).map_or("-".to_owned(), |ticks| format!("{:.1} min", *ticks as f64 / 120.0));
    let count = |is: fn(&Cause) -> bool| partings.iter().filter(|it| is(&it.cause)).count();
    let causes = [
        ("radio", count(|it| matches!(it, Cause::Radio { .. }))),
        ("attitude", count(|it| matches!(it, Cause::Attitude { .. }))),
        ("tracking", count(|it| matches!(it, Cause::Tracking { .. }))),
        ("decision", count(|it| matches!(it, Cause::Decision))),
    ];
    let causes: Vec<String> =
        causes.iter().filter(|it| it.1 > 0).map(|(name, count)| format!("{name} {count}")).collect();
    format!(
        "{} | {:.1} % | {:.1} % | {} | {median} | {}",
        sum(|it| it.tasks),
        share(sum(|it| it.equal), sum(|it| it.tasks)),
        share(sum(|it| it.foretold), sum(|it| it.imaged)),
        partings.len(),
        causes.join(", ")
    )
}
