//! A planner of one's own: the strip whose window closes first, after the shortest transition that should do, flown in
//! one process and compared with `beam`. `cargo run --release -p swath-nodes --example own_planner`
#![allow(clippy::print_stdout, reason = "an example")]

use std::path::Path;

use anyhow::Result;
use swath_mission::file::Mission;
use swath_mission::in_process::InProcessMission;
use swath_sim::planner::{Beam, Decision, DecisionContext, Planner, PlannerError};

/// Images what closes first.
struct EarliestDeadline;

impl Planner for EarliestDeadline {
    fn name(&self) -> String {
        "earliest-deadline".into()
    }

    fn decide(&mut self, context: &DecisionContext<'_>) -> Result<Decision, PlannerError> {
        let t_pre = context.model.period.ticks_ceil(80.0);
        let imaging = context.situation.now.after(t_pre);
        let open = |&i: &usize| context.candidates[i].window.contains(imaging);
        let in_time = (0..context.candidates.len()).filter(open);
        Ok(match in_time.min_by_key(|&i| context.candidates[i].window.close) {
            Some(candidate) => Decision::Image { candidate, t_pre },
            None => Decision::Wait { ticks: context.model.period.ticks_ceil(10.0) },
        })
    }
}

fn main() -> Result<()> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/missions/one_orbit.toml");
    let mission = Mission::read(&file)?;
    let planners: [Box<dyn Planner>; 2] = [Box::new(EarliestDeadline), Box::new(Beam::default())];
    for mut planner in planners {
        let mut reward = 0.0;
        InProcessMission::new(&mission)?.run(&mut *planner, |task, _| reward += task.reward)?;
        println!("{:20} reward {reward:.2}", planner.name());
    }
    Ok(())
}
