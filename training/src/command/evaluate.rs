//! `swath-train evaluate` and `sweep`: planners on the same missions, as a table and as JSON.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use serde_json::{Value, json};
use swath_sim::config::SimConfig;
use swath_sim::planner::PlannerSpec;
use swath_training::TrainingError;
use swath_training::evaluate::{Mission, Spread, fly, spread, spread_of};
use swath_training::planners::{PolicyOrigin, Prepared};

use super::missions::{MissionArgs, PlantArgs, cell, percent, pooled_success, strips};
use super::output::{JsonTarget, missions_bar, print, tell_other_satellite};

/// Options of `swath-train evaluate`.
#[derive(Debug, Args)]
pub struct EvaluateArgs {
    /// A planner: random, heuristic:SECONDS, lookahead, lookahead:TICKS for a margin that is not adapted, beam,
    /// beam:WIDTHxDEPTH, repair, repair:TICKS for another budget, aspen, these two also with -annealing or -squeaky, or a
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
    let bar = missions_bar(args.missions.episodes * plants.len() as u64)?;
    let mut by_plant = Vec::new();
    for (name, errors) in &plants {
        missions.plant = errors.clone();
        let flown = fly(&missions, &planners, || bar.inc(1))?;
        let base = best_fixed(&args.planners, &flown);
        let results = args.planners.iter().zip(&flown);
        let entries: Vec<Value> = results.clone().map(|(planner, own)| entry(planner, own, &flown[0], base)).collect();
        by_plant.push(json!({ "plant": name, "errors": errors, "planners": entries }));
        let mut table = if args.plants.plants.is_empty() { String::new() } else { format!("plant {name}\n") };
        table += HEADING;
        for (planner, own) in results {
            table += &row(&planner.to_string(), own, &flown[0], base);
        }
        if json.leaves_stdout() {
            bar.suspend(|| print(&(table + &strips(&flown[0]))))?;
        }
    }
    bar.finish_and_clear();
    let mut whole = args.missions.describe(&missions);
    whole["policies"] = json!(policies);
    if args.plants.plants.is_empty() {
        whole["planners"] = by_plant[0]["planners"].take();
    } else {
        whole["plants"] = json!(by_plant);
    }
    json.write(&whole)
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

/// Missions of the heuristic with the best fixed transition time, if one was flown.
fn best_fixed<'a>(planners: &[PlannerSpec], flown: &'a [Vec<Mission>]) -> Option<&'a [Mission]> {
    let fixed = planners.iter().zip(flown).filter(|(planner, _)| matches!(planner, PlannerSpec::Heuristic(_)));
    fixed.map(|(_, own)| own.as_slice()).max_by(|a, b| mean_reward(a).total_cmp(&mean_reward(b)))
}

/// Mean reward per orbit; every mission has one.
fn mean_reward(own: &[Mission]) -> f64 {
    spread(own, |it| Some(it.reward_per_orbit)).map_or(0.0, |reward| reward.mean)
}

/// Runs `sweep`: the fixed-T heuristic with T of 10 to 120 s.
pub fn sweep(args: &SweepArgs) -> Result<()> {
    let json = JsonTarget::new(args.json.as_deref())?;
    let times: Vec<f64> = (1..=12).map(|k| 10.0 * f64::from(k)).collect();
    let specs: Vec<PlannerSpec> = times.iter().map(|&t| PlannerSpec::Heuristic(t)).collect();
    let planners = specs.iter().map(Prepared::new).collect::<Result<Vec<_>, _>>()?;
    let missions = args.missions.missions()?;
    let bar = missions_bar(args.missions.episodes)?;
    let flown = fly(&missions, &planners, || bar.inc(1))?;
    bar.finish_and_clear();
    let rewarded = times.iter().zip(&flown).map(|(t, own)| (t, mean_reward(own))).filter(|(_, reward)| *reward > 0.0);
    let Some((best_s, _)) = rewarded.max_by(|a, b| a.1.total_cmp(&b.1)) else {
        return Err(TrainingError::NoResult("no strip was imaged with any transition time".into()).into());
    };
    let mut whole = args.missions.describe(&missions);
    whole["policies"] = json!([]);
    whole["best_t_pre_s"] = json!(best_s);
    let entries = times.iter().zip(&flown).map(|(t_pre_s, own)| {
        let mut entry = summary(own);
        entry["t_pre_fixed_s"] = json!(t_pre_s);
        entry
    });
    whole["sweep"] = entries.collect();
    if args.json.is_some() {
        return json.write(&whole);
    }
    let mut table = String::from(HEADING);
    for (planner, own) in specs.iter().zip(&flown) {
        table += &row(&planner.to_string(), own, &flown[0], best_fixed(&specs, &flown));
    }
    print(&format!("{table}{}\nbest: T* = {best_s} s\n", strips(&flown[0])))
}

const HEADING: &str = "\
planner                            reward/orbit   ± 95 %  deviation  of first    of T*  success  attempts  imaged  T_pre s  T_acq s  priority\n";

fn row(name: &str, own: &[Mission], first: &[Mission], best_fixed: Option<&[Mission]>) -> String {
    let reward = spread(own, |it| Some(it.reward_per_orbit));
    let mean = |quantity: fn(&Mission) -> Option<f64>| spread(own, quantity).map(|it| it.mean);
    format!(
        "{name:<34} {:>12} {:>8} {:>10} {:>9} {:>8} {:>8} {:>9} {:>7} {:>8} {:>8} {:>9}\n",
        cell(reward.map(|it| it.mean), 3),
        cell(reward.and_then(|it| it.confidence_95), 3),
        cell(reward.and_then(|it| it.deviation), 3),
        percent(gain(own, first).map(|it| it.mean)),
        percent(best_fixed.and_then(|base| gain(own, base)).map(|it| it.mean)),
        percent(pooled_success(own)),
        cell(mean(|it| Some(it.attempts_per_orbit)), 1),
        cell(mean(|it| Some(it.imaged_per_orbit)), 1),
        cell(mean(|it| it.t_pre_s), 1),
        cell(mean(|it| it.t_acq_s), 1),
        cell(mean(|it| it.priority), 3),
    )
}

/// Relative gain of the mean reward over another planner, with the spread of the paired differences; `None` over one
/// that earns nothing.
fn gain(own: &[Mission], other: &[Mission]) -> Option<Spread> {
    let base = mean_reward(other);
    let pairs = own.iter().zip(other);
    let differences: Vec<f64> =
        pairs.map(|(own, other)| (own.reward_per_orbit - other.reward_per_orbit) / base).collect();
    spread_of(&differences).filter(|_| base > 0.0)
}

fn entry(planner: &PlannerSpec, own: &[Mission], first: &[Mission], best_fixed: Option<&[Mission]>) -> Value {
    let mut entry = summary(own);
    entry["planner"] = json!(planner.to_string());
    entry["gain_over_first"] = json!(gain(own, first));
    entry["gain_over_best_fixed"] = json!(best_fixed.and_then(|base| gain(own, base)));
    entry["by_density"] = json!(by_density(own));
    entry["missions"] = json!(own);
    entry
}

fn summary(own: &[Mission]) -> Value {
    let of = |quantity: fn(&Mission) -> Option<f64>| json!(spread(own, quantity));
    json!({
        "success_rate": pooled_success(own),
        "requests": of(|it| Some(it.requests as f64)),
        "reachable": of(|it| Some(it.reachable as f64)),
        "reward_per_orbit": of(|it| Some(it.reward_per_orbit)),
        "attempts_per_orbit": of(|it| Some(it.attempts_per_orbit)),
        "imaged_per_orbit": of(|it| Some(it.imaged_per_orbit)),
        "t_pre_s": of(|it| it.t_pre_s),
        "t_acq_s": of(|it| it.t_acq_s),
        "priority": of(|it| it.priority),
        "wait_s_per_orbit": of(|it| Some(it.wait_s_per_orbit)),
        "failed_attitude": of(|it| it.failed_attitude),
        "failed_elevation": of(|it| it.failed_elevation),
    })
}

/// Summaries of missions grouped by thousands of strips asked for.
fn by_density(own: &[Mission]) -> Vec<Value> {
    let mut groups: std::collections::BTreeMap<usize, Vec<Mission>> = Default::default();
    for mission in own {
        groups.entry(mission.requests / 1000 * 1000).or_default().push(*mission);
    }
    let summarised = groups.iter().map(|(least, missions)| {
        let mut entry = summary(missions);
        entry["requests"] = json!([least, least + 999]);
        entry["missions"] = json!(missions.len());
        entry
    });
    summarised.collect()
}
