//! `swath-train evaluate` and `sweep`: planners on the same missions, as a table and as JSON.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use serde_json::json;
use swath_sim::config::SimConfig;
use swath_sim::planner::PlannerSpec;
use swath_training::evaluate::fly;
use swath_training::planners::{PolicyOrigin, Prepared};

use super::campaign::{Campaign, Part};
use super::comparison::{Evaluation, OnPlant, Sweep};
use super::missions::{MissionArgs, PlantArgs};
use super::output::{JsonTarget, missions_bar, print, tell_other_satellite};

/// Options of `swath-train evaluate`.
#[derive(Debug, Args)]
pub struct EvaluateArgs {
    /// A planner: random, heuristic:SECONDS, lookahead, lookahead:TICKS for a margin that is not adapted, beam,
    /// beam:WIDTHxDEPTH, frugal, beam+handmade:SHARE, repair, repair:TICKS for another budget, aspen, these two also with -annealing or -squeaky, or a
    /// policy: hop-ppo, hop-ppo-mlp, h-ppo or discrete-ppo, each also with +lookahead to fly its proposals in the head,
    /// and with :FILE for a policy or checkpoint that is not shipped. May be given several times: the first is what
    /// others are compared with
    #[arg(long = "planner", required = true)]
    planners: Vec<PlannerSpec>,
    #[command(flatten)]
    plants: PlantArgs,
    #[command(flatten)]
    missions: MissionArgs,
    /// Write everything, every mission included, to this file (- for standard output)
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// Options of `swath-train sweep`.
#[derive(Debug, Args)]
pub struct SweepArgs {
    #[command(flatten)]
    missions: MissionArgs,
    /// Print JSON to standard output instead of a table, or write it to a file
    #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = "-")]
    json: Option<PathBuf>,
}

/// Runs `evaluate`.
pub fn evaluate(args: &EvaluateArgs) -> Result<()> {
    let json = JsonTarget::new(args.json.as_deref())?;
    let mut missions = args.missions.missions()?;
    let planners = args.planners.iter().map(Prepared::new).collect::<Result<Vec<_>, _>>()?;
    let policies = policies(&planners, &missions.simulation)?;
    let plants = args.plants.named()?;
    let bar = missions_bar(missions.own() * plants.len() as u64)?;
    let named = !args.plants.plants.is_empty();
    let mut found = Evaluation::new(args.planners.clone(), named);
    for (plant, errors) in plants {
        missions.plant = errors.clone();
        let flown = fly(&missions, &planners, || bar.inc(1))?;
        let own = OnPlant::new(plant, errors, flown);
        if json.leaves_stdout() && args.missions.shard.is_none() {
            bar.suspend(|| print(&found.table(&own)))?;
        }
        found.plants.push(own);
    }
    bar.finish_and_clear();
    let mut head = args.missions.describe(&missions);
    head["policies"] = json!(policies);
    if let Some(shard) = args.missions.shard {
        return Part::new(shard, head, Campaign::Evaluate(found)).write(&json);
    }
    json.write(&found.whole(head))
}

/// Which policies fly; those that were trained on another satellite are told.
fn policies(planners: &[Prepared], satellite: &SimConfig) -> Result<Vec<PolicyOrigin>> {
    let mut found = Vec::new();
    for planner in planners {
        let Some(origin) = planner.origin(satellite)? else { continue };
        tell_other_satellite(&origin);
        found.push(origin);
    }
    Ok(found)
}

/// Runs `sweep`: the fixed-T heuristic with T of 10 to 120 s.
pub fn sweep(args: &SweepArgs) -> Result<()> {
    let json = JsonTarget::new(args.json.as_deref())?;
    let planners = Sweep::planners().iter().map(Prepared::new).collect::<Result<Vec<_>, _>>()?;
    let missions = args.missions.missions()?;
    let bar = missions_bar(missions.own())?;
    let found = Sweep { flown: fly(&missions, &planners, || bar.inc(1))? };
    bar.finish_and_clear();
    let mut head = args.missions.describe(&missions);
    head["policies"] = json!([]);
    if let Some(shard) = args.missions.shard {
        return Part::new(shard, head, Campaign::Sweep(found)).write(&json);
    }
    let whole = found.whole(head)?;
    if args.json.is_some() {
        return json.write(&whole);
    }
    print(&found.table()?)
}
