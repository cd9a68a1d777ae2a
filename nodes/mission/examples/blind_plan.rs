//! What deciding on board is worth over the radio: reward of a satellite that decides by itself, beside one that flies
//! blindly what the ground has planned at its last pass, for one, three and seven stations and a link that is always
//! open, with a satellite that is as its model says and with one that is not. Orders come at random through a day.
//! Prints a Markdown table.
//!
//! ```sh
//! cargo run --release -p swath-mission --example blind_plan -- 3
//! ```
#![allow(clippy::print_stdout, reason = "a measuring tool")]

#[path = "common/arrivals.rs"]
mod arrivals;

use std::collections::VecDeque;

use anyhow::{Context, Result};
use arrivals::{LINKS, ORDERS, arrivals, mission};
use swath_mission::file::Mission;
use swath_mission::in_process::InProcessMission;
use swath_mission::link::config::LinkMode;
use swath_mission::mirror::Mirror;
use swath_sim::planner::{Decision, DecisionContext, Lookahead, Planner, PlannerError};
use swath_sim::task::Totals;
use swath_sim::time::Tick;
use swath_sim::world::strip::StripId;

/// Satellites that are flown: name, and what `[plant]` says.
const PLANTS: [(&str, &str); 3] = [
    ("as its model", ""),
    ("torque -1 %", "torque_limit_scale = 0.99"),
    ("sensor noise", "attitude_noise_rad = 1.94e-4\nrate_noise_rad_s = 6.2e-5"),
];
/// How long a blind satellite waits where its plan says nothing [s].
const LOOK_AGAIN_S: f64 = 10.0;

fn main() -> Result<()> {
    let seeds: u64 = std::env::args().nth(1).map_or(Ok(3), |text| text.parse()).context("SEEDS is a number")?;
    println!("{ORDERS} orders a day, {seeds} days\n");
    println!("| satellite | link | decides on board | success | ground plan, flown blindly | success | share |");
    println!("| --- | --- | --- | --- | --- | --- | --- |");
    for (plant_name, plant) in PLANTS {
        for (link_name, link) in LINKS {
            let (mut own, mut blind) = (Totals::default(), Totals::default());
            for seed in 1..=seeds {
                let mission = mission(seed, &format!("{link}\n[plant]\n{plant}"))?;
                let mut flight = InProcessMission::with_actions(&mission, arrivals(&mission)?)?;
                flight.run(&mut Lookahead::default(), |settled, _| own.add(settled))?;
                fly_blindly(&mission, &mut blind)?;
            }
            let mean = |totals: &Totals| totals.reward / seeds as f64;
            let success = |totals: &Totals| 100.0 * totals.success_rate();
            println!(
                "| {plant_name} | {link_name} | {:.1} | {:.1} % | {:.1} | {:.1} % | {:.0} % |",
                mean(&own),
                success(&own),
                mean(&blind),
                success(&blind),
                100.0 * mean(&blind) / mean(&own)
            );
        }
    }
    Ok(())
}

/// What the ground has planned, flown as it is.
#[derive(Default)]
struct Blind {
    /// Strips, and when the imaging of each begins.
    plan: VecDeque<(StripId, Tick)>,
}

impl Planner for Blind {
    fn name(&self) -> String {
        "blind".to_owned()
    }

    fn decide(&mut self, context: &DecisionContext<'_>) -> Result<Decision, PlannerError> {
        let now = context.situation.now;
        let again = context.model.period.ticks_ceil(LOOK_AGAIN_S);
        while let Some(&(id, imaging)) = self.plan.front() {
            let t_pre = imaging.since(now);
            if t_pre > i64::from(context.model.t_pre_max()) {
                let early = t_pre - i64::from(context.model.t_pre_max());
                return Ok(Decision::Wait { ticks: (early as u32).min(again) });
            }
            self.plan.pop_front();
            if let Some(candidate) = context.candidates.iter().position(|it| it.id == id).filter(|_| t_pre >= 0) {
                return Ok(Decision::Image { candidate, t_pre: t_pre as u32 });
            }
        }
        Ok(Decision::Wait { ticks: again })
    }
}

/// Flies what the ground plans with the same planner after each pass, from what has come down and with what has gone up;
/// where the link is always open, it plans anew every orbit.
fn fly_blindly(mission: &Mission, totals: &mut Totals) -> Result<()> {
    let mut flight = InProcessMission::watched(mission, arrivals(mission)?)?;
    let mut mirror = Mirror::new(mission, Box::new(Lookahead::default()))?;
    let (mut pilot, mut open, mut planned) = (Blind::default(), true, None::<Tick>);
    let radio = flight.link().context("the mission has a radio")?.radio().clone();
    let orbit = flight.model().period.ticks_ceil(flight.model().orbit_period_s());
    loop {
        for told in flight.take_told() {
            mirror.tell(&told)?;
        }
        let now = flight.now();
        let closed = std::mem::replace(&mut open, radio.open(now)) && !open;
        let passed = closed || planned.is_none_or(|last| now.since(last) >= i64::from(orbit) && open);
        if passed {
            // It is flown until the next pass is over.
            let always = radio.config().mode == LinkMode::Always;
            let next = radio.contacts().next(now.after(1)).filter(|_| !always);
            let ticks = next.map_or(u64::from(orbit), |(_, set)| set.since(now) as u64 + 1);
            let prediction = mirror.predict(now, if always || next.is_some() { ticks } else { u64::MAX })?;
            let imaged = prediction.tasks.iter().filter(|task| task.success());
            pilot.plan = imaged.filter_map(|task| Some((task.strip?, task.start.after(task.t_pre)))).collect();
            planned = Some(now);
        }
        match flight.step(&mut pilot, Tick(u64::MAX))? {
            Some((settled, _)) => totals.add(&settled),
            None => return Ok(()),
        }
    }
}
