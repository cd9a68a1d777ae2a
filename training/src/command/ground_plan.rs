//! `swath-train ground-plan`: how good a plan could be, and what one made on the ground is worth in flight.

use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::Args;
use serde_json::{Value, json};
use swath_sim::foresight::GroundSettings;
use swath_training::evaluate::{Mission, spread, spread_of};
use swath_training::ground::{Bracket, brackets};

use super::evaluate::{MissionArgs, PlantArgs, pooled_success, print, write_json};

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
    let plants = args.plants.named()?;
    let errors: Vec<_> = plants.iter().map(|(_, errors)| errors.clone()).collect();
    let settings =
        GroundSettings { width: args.width as usize, branches: args.branches as usize, weakness: args.weakness };
    let found = brackets(&args.missions.missions()?, &errors, &settings)?;
    let of = |quantity: fn(&Bracket) -> f64| spread_of(&found.iter().map(quantity).collect::<Vec<f64>>());
    let (known, bound) = (of(|it| it.best_known), of(|it| it.upper_bound));
    let mut table = format!(
        "                                   reward/orbit   ± 95 %\n\
         {:<34} {:>12.3} {:>8.3}\n{:<34} {:>12.3} {:>8.3}\n\n\
         plan flown blindly                 reward/orbit   ± 95 %  success\n",
        "no plan exceeds", bound.mean, bound.confidence_95, "best plan found", known.mean, known.confidence_95,
    );
    let mut flown = Vec::new();
    for (number, (name, errors)) in plants.iter().enumerate() {
        let own: Vec<Mission> = found.iter().map(|it| it.flown[number]).collect();
        let reward = spread(&own, |it| it.reward_per_orbit);
        let success = pooled_success(&own);
        table += &format!("{name:<34} {:>12.3} {:>8.3} {:>7.1}%\n", reward.mean, reward.confidence_95, success * 100.0);
        flown.push(json!({
            "plant": name, "errors": errors, "reward_per_orbit": reward, "success_rate": success, "missions": own,
        }));
    }
    if args.json.as_deref() != Some(Path::new("-")) {
        print(&table)?;
    }
    let each: Vec<Value> = found
        .iter()
        .map(|it| json!({ "seed": it.seed, "best_known": it.best_known, "upper_bound": it.upper_bound, "ticks": it.ticks }))
        .collect();
    let whole = json!({
        "missions": args.missions.describe(), "width": args.width, "branches": args.branches, "weakness": args.weakness,
        "best_known": known, "upper_bound": bound, "brackets": each, "flown_blindly": flown,
    });
    args.json.as_deref().map_or(Ok(()), |path| write_json(path, &whole))
}
