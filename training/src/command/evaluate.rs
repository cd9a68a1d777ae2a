//! `swath-train evaluate` and `sweep`: planners on the same missions, as a table and as JSON.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Args;
use serde_json::{Value, json};
use swath_sim::config::SimConfig;
use swath_sim::learn::episode::EpisodeConfig;
use swath_sim::planner::PlannerSpec;
use swath_sim::requests::scenario::ScenarioConfig;
use swath_sim::vehicle::errors::PlantErrors;
use swath_training::evaluate::{Mission, Missions, Spread, fly, spread, spread_of};
use swath_training::process;

/// Which missions are flown.
#[derive(Debug, Args)]
pub struct MissionArgs {
    /// Missions flown by each planner
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    episodes: u64,
    /// Length of a mission [orbits]
    #[arg(long, default_value_t = 15.0)]
    orbits: f64,
    /// Strips asked for: a number, or a range such as 2000..5000
    #[arg(long, default_value = "2000..5000", value_parser = range)]
    requests: [u32; 2],
    /// Seed of the first mission
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Share of the strips that come in flight, as a Poisson stream; the others are known at the start
    #[arg(long, default_value_t = 0.0, value_name = "SHARE")]
    arrivals: f64,
    /// Simulation settings as TOML; the paper's by default
    #[arg(long, value_name = "FILE")]
    simulation: Option<PathBuf>,
    /// Threads; results do not depend on it
    #[arg(long, default_value_t = super::cores())]
    threads: usize,
}

/// How the satellite flown differs from the one that its guidance and planner believe in.
#[derive(Debug, Args)]
pub struct PlantArgs {
    /// Errors of the plant: none, or torque-10%, inertia+5% and the like, noise and delay, joined by commas, or a TOML
    /// file; may be given several times, for a table each
    #[arg(long = "plant", value_name = "NAME|FILE")]
    plants: Vec<String>,
}

impl PlantArgs {
    /// The plants by name; the exact one when none was asked for.
    pub fn named(&self) -> Result<Vec<(String, PlantErrors)>> {
        if self.plants.is_empty() {
            return Ok(vec![("none".to_owned(), PlantErrors::default())]);
        }
        self.plants.iter().map(|name| Ok((name.clone(), plant(name)?))).collect()
    }
}

fn plant(name: &str) -> Result<PlantErrors> {
    let path = Path::new(name);
    if path.extension().is_none_or(|extension| extension != "toml") {
        return Ok(name.parse()?);
    }
    let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {name}"))?;
    let errors: PlantErrors = toml::from_str(&text).with_context(|| format!("{name} is not valid"))?;
    errors.validate().with_context(|| format!("{name} is not valid"))?;
    Ok(errors)
}

/// Options of `swath-train evaluate`.
#[derive(Debug, Args)]
pub struct EvaluateArgs {
    /// A planner: random, heuristic:T, lookahead, beam, hop-ppo, hop-ppo-mlp, h-ppo, discrete-ppo or
    /// hop-ppo+lookahead, each policy also with :FILE; may be given several times, the first is what others are
    /// compared with
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

fn range(text: &str) -> Result<[u32; 2], String> {
    let number = |text: &str| text.parse().map_err(|_| format!("{text} is not a number of strips"));
    match text.split_once("..") {
        None => Ok([number(text)?; 2]),
        Some((least, most)) => Ok([number(least)?, number(most)?]),
    }
}

impl MissionArgs {
    /// The missions, on the plant without errors.
    pub fn missions(&self) -> Result<Missions> {
        process::make_threads(self.threads)?;
        let simulation = match &self.simulation {
            None => SimConfig::default(),
            Some(path) => {
                let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
                toml::from_str(&text).with_context(|| format!("{} is not valid", path.display()))?
            }
        };
        let scenario = ScenarioConfig { count: self.requests, ..ScenarioConfig::default() };
        Ok(Missions {
            simulation,
            episode: EpisodeConfig { orbits: self.orbits, scenario, arrivals: self.arrivals },
            plant: PlantErrors::default(),
            first_seed: self.seed,
            count: self.episodes,
        })
    }

    /// What was asked for.
    pub fn describe(&self) -> Value {
        json!({
            "episodes": self.episodes,
            "orbits": self.orbits,
            "requests": self.requests,
            "first_seed": self.seed,
            "arrivals": self.arrivals,
        })
    }
}

/// Runs `evaluate`.
pub fn evaluate(args: &EvaluateArgs) -> Result<()> {
    let mut missions = args.missions.missions()?;
    let (plants, mut by_plant) = (args.plants.named()?, Vec::new());
    for (name, errors) in &plants {
        missions.plant = errors.clone();
        let flown = fly(&missions, &args.planners)?;
        let base = best_fixed(&args.planners, &flown);
        let results = args.planners.iter().zip(&flown);
        let entries: Vec<Value> = results.clone().map(|(planner, own)| entry(planner, own, &flown[0], base)).collect();
        by_plant.push(json!({ "plant": name, "errors": errors, "planners": entries }));
        let mut table = if args.plants.plants.is_empty() { String::new() } else { format!("plant {name}\n") };
        table += HEADING;
        for (planner, own) in results {
            table += &row(&planner.to_string(), own, &flown[0], base);
        }
        if args.json.as_deref() != Some(Path::new("-")) {
            print(&table)?;
        }
    }
    let mut whole = json!({ "missions": args.missions.describe() });
    if args.plants.plants.is_empty() {
        whole["planners"] = by_plant[0]["planners"].take();
    } else {
        whole["plants"] = json!(by_plant);
    }
    args.json.as_deref().map_or(Ok(()), |path| write_json(path, &whole))
}

/// Missions of the heuristic with the best fixed transition time, if one was flown.
fn best_fixed<'a>(planners: &[PlannerSpec], flown: &'a [Vec<Mission>]) -> Option<&'a [Mission]> {
    let fixed = planners.iter().zip(flown).filter(|(planner, _)| matches!(planner, PlannerSpec::Heuristic(_)));
    let reward = |own: &[Mission]| spread(own, |it| it.reward_per_orbit).mean;
    fixed.map(|(_, own)| own.as_slice()).max_by(|a, b| reward(a).total_cmp(&reward(b)))
}

/// Runs `sweep`: the fixed-T heuristic with T of 10 to 120 s.
pub fn sweep(args: &SweepArgs) -> Result<()> {
    let times: Vec<f64> = (1..=12).map(|k| 10.0 * f64::from(k)).collect();
    let planners: Vec<PlannerSpec> = times.iter().map(|&t| PlannerSpec::Heuristic(t)).collect();
    let flown = fly(&args.missions.missions()?, &planners)?;
    let rewards = flown.iter().map(|own| spread(own, |it| it.reward_per_orbit).mean);
    let best = times.iter().zip(rewards).max_by(|a, b| a.1.total_cmp(&b.1));
    let Some((best_s, _)) = best else {
        bail!("no mission was flown");
    };
    let entries: Vec<Value> = times
        .iter()
        .zip(&flown)
        .map(|(t_pre_s, own)| {
            let mut entry = summary(own);
            entry["t_pre_fixed_s"] = json!(t_pre_s);
            entry
        })
        .collect();
    let whole = json!({
        "missions": args.missions.describe(), "best_t_pre_s": best_s, "sweep": entries,
    });
    if let Some(path) = args.json.as_deref() {
        return write_json(path, &whole);
    }
    let mut table = String::from(HEADING);
    for (planner, own) in planners.iter().zip(&flown) {
        table += &row(&planner.to_string(), own, &flown[0], best_fixed(&planners, &flown));
    }
    print(&format!("{table}\nbest: T* = {best_s} s\n"))
}

const HEADING: &str = "\
planner                            reward/orbit   ± 95 %  deviation  of first    of T*  success  attempts  imaged  T_pre s  T_acq s  priority\n";

fn row(name: &str, own: &[Mission], first: &[Mission], best_fixed: Option<&[Mission]>) -> String {
    let reward = spread(own, |it| it.reward_per_orbit);
    let mean = |quantity: fn(&Mission) -> f64| spread(own, quantity).mean;
    format!(
        "{name:<34} {:>12.3} {:>8.3} {:>10.3} {:>8.1}% {:>8} {:>7.1}% {:>9.1} {:>7.1} {:>8.1} {:>8.1} {:>9.3}\n",
        reward.mean,
        reward.confidence_95,
        reward.deviation,
        gain(own, first).mean * 100.0,
        best_fixed.map_or_else(|| "-".to_owned(), |base| format!("{:.1}%", gain(own, base).mean * 100.0)),
        pooled_success(own) * 100.0,
        mean(|it| it.attempts_per_orbit),
        mean(|it| it.imaged_per_orbit),
        mean(|it| it.t_pre_s),
        mean(|it| it.t_acq_s),
        mean(|it| it.priority),
    )
}

/// Successes over attempts of all missions together.
pub(super) fn pooled_success(own: &[Mission]) -> f64 {
    let sum = |quantity: fn(&Mission) -> f64| own.iter().map(quantity).sum::<f64>();
    sum(|it| it.imaged_per_orbit) / sum(|it| it.attempts_per_orbit)
}

/// Relative gain of the mean reward over the first planner, with the spread of the paired differences.
fn gain(own: &[Mission], first: &[Mission]) -> Spread {
    let base = spread(first, |it| it.reward_per_orbit).mean;
    let pairs = own.iter().zip(first);
    let differences: Vec<f64> =
        pairs.map(|(own, first)| (own.reward_per_orbit - first.reward_per_orbit) / base).collect();
    spread_of(&differences)
}

fn entry(planner: &PlannerSpec, own: &[Mission], first: &[Mission], best_fixed: Option<&[Mission]>) -> Value {
    let mut entry = summary(own);
    entry["planner"] = json!(planner.to_string());
    entry["gain_over_first"] = json!(gain(own, first));
    entry["gain_over_best_fixed"] = json!(best_fixed.map(|base| gain(own, base)));
    entry["by_density"] = json!(by_density(own));
    entry["missions"] = json!(own);
    entry
}

fn summary(own: &[Mission]) -> Value {
    let of = |quantity: fn(&Mission) -> f64| json!(spread(own, quantity));
    json!({
        "success_rate": pooled_success(own),
        "reward_per_orbit": of(|it| it.reward_per_orbit),
        "attempts_per_orbit": of(|it| it.attempts_per_orbit),
        "imaged_per_orbit": of(|it| it.imaged_per_orbit),
        "t_pre_s": of(|it| it.t_pre_s),
        "t_acq_s": of(|it| it.t_acq_s),
        "priority": of(|it| it.priority),
        "wait_s_per_orbit": of(|it| it.wait_s_per_orbit),
        "failed_attitude": of(|it| it.failed_attitude),
        "failed_elevation": of(|it| it.failed_elevation),
    })
}

/// Summaries of missions grouped by thousands of requests.
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

pub(super) fn write_json(path: &Path, value: &Value) -> Result<()> {
    let text = serde_json::to_string_pretty(value).context("cannot write the results as JSON")?;
    if path == Path::new("-") {
        return print(&(text + "\n"));
    }
    std::fs::write(path, text + "\n").with_context(|| format!("cannot write {}", path.display()))
}

pub(super) fn print(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    out.write_all(text.as_bytes()).context("cannot write to standard output")
}
