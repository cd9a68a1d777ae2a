//! How long orders take over the radio: orders that come at random through a day, for one, three and seven stations,
//! beside a link that is always open. Prints a Markdown table.
//!
//! ```sh
//! cargo run --release -p swath-mission --example response_times -- 10
//! ```
#![allow(clippy::print_stdout, reason = "a measuring tool")]

use anyhow::{Context, Result};
use rand::RngExt as _;
use swath_mission::file::Mission;
use swath_mission::in_process::InProcessMission;
use swath_mission::link::ground::WayLine;
use swath_mission::link::response::{LinkSummary, Times};
use swath_mission::orders::action::{Act, Action};
use swath_mission::orders::order::Order;
use swath_sim::planner::Beam;
use swath_sim::requests::scenario::ScenarioConfig;
use swath_sim::rng;
use swath_sim::task::Totals;
use swath_sim::time::{Tick, TickPeriod};
use swath_sim::world::strip::StripId;

/// About a day.
const ORBITS: f64 = 15.0;
/// Orders a day.
const ORDERS: usize = 1000;
/// Links that are compared: name, and what `[link]` says.
const LINKS: [(&str, &str); 4] = [
    ("always", "mode = \"always\""),
    (
        "7 stations",
        "stations = [\"boulder\", \"merritt\", \"singapore\", \"weilheim\", \"santiago\", \"dongara\", \"hawaii\"]",
    ),
    ("3 stations", "stations = [\"puertollano\", \"awarua\", \"punta-arenas\"]"),
    ("1 station", "stations = [\"puertollano\"]"),
];

fn main() -> Result<()> {
    let seeds: u64 = std::env::args().nth(1).map_or(Ok(10), |text| text.parse()).context("SEEDS is a number")?;
    println!("| link | loss | reward | on board | imaged | known | image down |");
    println!("| --- | --- | --- | --- | --- | --- | --- |");
    for (name, link) in LINKS {
        for loss in [0.0, 0.2] {
            let (mut lines, mut reward, mut period) = (Vec::new(), 0.0, TickPeriod::from_frequency(2.0)?);
            for seed in 1..=seeds {
                let mission = mission(seed, &format!("{link}\nloss = {loss}"))?;
                let mut flight = InProcessMission::with_actions(&mission, arrivals(&mission)?)?;
                let mut totals = Totals::default();
                flight.run(&mut Beam::default(), |settled, _| totals.add(settled))?;
                reward += totals.reward / seeds as f64;
                period = flight.model().period;
                lines.extend(flight.ways());
            }
            println!("| {name} | {:.0} % | {reward:.1} | {} |", loss * 100.0, columns(&lines, period));
        }
    }
    Ok(())
}

fn mission(seed: u64, link: &str) -> Result<Mission> {
    let text = format!("seed = {seed}\norbits = {ORBITS}\n[link]\n{link}\n");
    let mission: Mission = toml::from_str(&text)?;
    mission.validate()?;
    Ok(mission.resolved())
}

/// Orders that come at any time of the mission, the same for every link.
fn arrivals(mission: &Mission) -> Result<Vec<Action>> {
    let horizon = mission.horizon(&mission.model()?);
    let mut rng = rng::stream(mission.seed, rng::ARRIVALS);
    let requests = ScenarioConfig::default().generate(&mut rng, ORDERS, mission.sim.earth.radius_m);
    let mut actions: Vec<Action> = (1..)
        .zip(requests)
        .map(|(number, request)| {
            let order = Order::new(format!("order-{number}"), format!("order {number}"), request);
            let at = Tick(rng.random_range(0..horizon.0));
            let act = Act::Submit(StripId(0), Box::new(order));
            Action { at, initial: false, actor: "operator".to_owned(), reason: String::new(), act }
        })
        .collect();
    actions.sort_by_key(|action| action.at);
    Ok(actions)
}

/// Medians and ninth tenths [min] of how many.
fn columns(lines: &[WayLine], period: TickPeriod) -> String {
    let text = |times: &Option<Times>| {
        times.map_or("-".to_owned(), |it| {
            format!("{:.1} / {:.0} min ({})", it.median_s / 60.0, it.nine_tenths_s / 60.0, it.count)
        })
    };
    let summary = LinkSummary::new(lines.iter().cloned(), period);
    [&summary.on_board, &summary.imaged, &summary.known, &summary.delivered].map(text).join(" | ")
}
