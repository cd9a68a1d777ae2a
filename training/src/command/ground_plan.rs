//! `swath-train ground-plan`: how good a plan could be, and what one made on the ground is worth in flight.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use serde_json::json;
use swath_sim::foresight::GroundSettings;
use swath_training::ground::brackets;

use super::campaign::{Campaign, Part};
use super::missions::{MissionArgs, PlantArgs};
use super::output::{JsonTarget, missions_bar, print};
use super::plans::Plans;

/// Options of `swath-train ground-plan`.
#[derive(Debug, Args)]
pub struct GroundPlanArgs {
    /// Beginnings of plans kept for each ten seconds; better plans and longer searches
    #[arg(long, default_value_t = GroundSettings::default().width as u64, value_parser = clap::value_parser!(u64).range(1..=1000))]
    width: u64,
    /// Strips that each of them is continued with
    #[arg(long, default_value_t = GroundSettings::default().branches as u64, value_parser = clap::value_parser!(u64).range(1..=100))]
    branches: u64,
    /// Margin of the plans that are flown: share of the wheels' torque limit that they do not count on
    #[arg(long, default_value_t = 0.0, value_parser = share)]
    weakness: f64,
    #[command(flatten)]
    plants: PlantArgs,
    #[command(flatten)]
    missions: MissionArgs,
    /// Write everything, every mission included, to this file (- for standard output)
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

fn share(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(share) if (0.0..=0.9).contains(&share) => Ok(share),
        _ => Err(format!("{text} is not a share from 0 to 0.9")),
    }
}

/// Runs `ground-plan`.
pub fn ground_plan(args: &GroundPlanArgs) -> Result<()> {
    let json = JsonTarget::new(args.json.as_deref())?;
    let plants = args.plants.named()?;
    let errors: Vec<_> = plants.iter().map(|(_, errors)| errors.clone()).collect();
    let settings =
        GroundSettings { width: args.width as usize, branches: args.branches as usize, weakness: args.weakness };
    let missions = args.missions.missions()?;
    let bar = missions_bar(missions.own())?;
    let brackets = brackets(&missions, &errors, &settings, || bar.inc(1))?;
    bar.finish_and_clear();
    let (width, branches, weakness) = (args.width, args.branches, args.weakness);
    let found = Plans { width, branches, weakness, plants, brackets };
    let mut head = args.missions.describe(&missions);
    head["policies"] = json!([]);
    if let Some(shard) = args.missions.shard {
        return Part::new(shard, head, Campaign::GroundPlan(found)).write(&json);
    }
    if json.leaves_stdout() {
        print(&found.table())?;
    }
    json.write(&found.whole(head))
}
