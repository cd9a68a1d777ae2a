//! `swath-train ground-plan`: how good a plan could be, and what one made on the ground is worth in flight.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use serde::Serialize;
use serde_json::{Value, json};
use swath_sim::foresight::GroundSettings;
use swath_sim::vehicle::errors::PlantErrors;
use swath_training::evaluate::{Mission, Spread, spread, spread_of};
use swath_training::ground::{Bracket, brackets};

use super::missions::{MissionArgs, PlantArgs, cell, percent, pooled_success, strips};
use super::output::{JsonTarget, missions_bar, print};

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
    let bar = missions_bar(args.missions.episodes)?;
    let found = brackets(&missions, &errors, &settings, || bar.inc(1))?;
    bar.finish_and_clear();
    let of = |quantity: fn(&Bracket) -> f64| spread_of(&found.iter().map(quantity).collect::<Vec<f64>>());
    let (known, bound) = (of(|it| it.best_known), of(|it| it.upper_bound));
    let flown: Vec<Flown> = plants
        .iter()
        .enumerate()
        .map(|(number, (name, errors))| {
            let missions: Vec<Mission> = found.iter().map(|it| it.flown[number]).collect();
            let reward_per_orbit = spread(&missions, |it| Some(it.reward_per_orbit));
            Flown { plant: name, errors, reward_per_orbit, success_rate: pooled_success(&missions), missions }
        })
        .collect();
    if json.leaves_stdout() {
        print(&table(bound, known, &flown))?;
    }
    let each: Vec<Value> = found
        .iter()
        .map(|it| json!({ "seed": it.seed, "best_known": it.best_known, "upper_bound": it.upper_bound, "ticks": it.ticks }))
        .collect();
    let mut whole = args.missions.describe(&missions);
    for (key, value) in [
        ("policies", json!([])),
        ("width", json!(args.width)),
        ("branches", json!(args.branches)),
        ("weakness", json!(args.weakness)),
        ("best_known", json!(known)),
        ("upper_bound", json!(bound)),
        ("brackets", json!(each)),
        ("flown_blindly", json!(flown)),
    ] {
        whole[key] = value;
    }
    json.write(&whole)
}

/// The plans as they were flown on one plant.
#[derive(Serialize)]
struct Flown<'a> {
    plant: &'a str,
    errors: &'a PlantErrors,
    reward_per_orbit: Option<Spread>,
    success_rate: Option<f64>,
    missions: Vec<Mission>,
}

fn table(bound: Option<Spread>, known: Option<Spread>, flown: &[Flown]) -> String {
    let rewards = |name: &str, reward: Option<Spread>| {
        let (mean, confidence) = (reward.map(|it| it.mean), reward.and_then(|it| it.confidence_95));
        format!("{name:<34} {:>12} {:>8}", cell(mean, 3), cell(confidence, 3))
    };
    let mut table = format!(
        "                                   reward/orbit   ± 95 %\n{}\n{}\n\n\
         plan flown blindly                 reward/orbit   ± 95 %  success\n",
        rewards("no plan exceeds", bound),
        rewards("best plan found", known),
    );
    for it in flown {
        table += &format!("{} {:>8}\n", rewards(it.plant, it.reward_per_orbit), percent(it.success_rate));
    }
    table + &flown.first().map_or_else(String::new, |it| strips(&it.missions))
}
