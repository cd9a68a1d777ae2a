//! How long orders take over the radio: orders that come at random through a day, for one, three and seven stations,
//! beside a link that is always open. Prints a Markdown table, and draws the distributions without loss.
//!
//! ```sh
//! cargo run --release -p swath-mission --example response_times -- 10 training/figures/response_times.svg
//! ```
#![allow(clippy::print_stdout, reason = "a measuring tool")]

#[path = "common/arrivals.rs"]
#[allow(dead_code, reason = "others use more of it")]
mod arrivals;
#[path = "common/distribution.rs"]
mod distribution;

use std::path::Path;

use anyhow::{Context, Result};
use arrivals::{LINKS, arrivals, mission};
use distribution::{Curve, Panel};
use swath_mission::in_process::InProcessMission;
use swath_mission::link::ground::WayLine;
use swath_mission::link::response::{LinkSummary, Times};
use swath_sim::planner::Beam;
use swath_sim::task::Totals;
use swath_sim::time::{Tick, TickPeriod};

/// A step on the way of an order, and when it was come to.
type Step = (&'static str, fn(&WayLine) -> Option<Tick>);

const STEPS: [Step; 3] =
    [("on board", |line| line.on_board_tick), ("imaged", |line| line.imaged_tick), ("known", |line| line.known_tick)];

fn main() -> Result<()> {
    let seeds: u64 = std::env::args().nth(1).map_or(Ok(10), |text| text.parse()).context("SEEDS is a number")?;
    let mut panels = STEPS.map(|(step, _)| Panel { step, curves: Vec::new() });
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
            if loss == 0.0 {
                for (panel, (_, when)) in panels.iter_mut().zip(STEPS) {
                    let hours =
                        |line: &WayLine| Some(when(line)?.since(line.queued_tick) as f64 * period.seconds() / 3600.0);
                    let hours = lines.iter().filter_map(hours).collect();
                    panel.curves.push(Curve { name, orders: lines.len(), hours });
                }
            }
        }
    }
    match std::env::args().nth(2) {
        Some(figure) => distribution::draw(Path::new(&figure), &panels),
        None => Ok(()),
    }
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
