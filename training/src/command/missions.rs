//! Which missions the commands fly, and on which satellites.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;
use serde_json::{Value, json};
use swath_sim::config::SimConfig;
use swath_sim::learn::episode::EpisodeConfig;
use swath_sim::requests::scenario::ScenarioConfig;
use swath_sim::vehicle::errors::PlantErrors;
use swath_training::evaluate::{Mission, Missions, Shard, spread};
use swath_training::process;
use swath_training::program::Program;

/// Which missions are flown.
#[derive(Debug, Args)]
pub struct MissionArgs {
    /// Missions flown by each planner
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    pub episodes: u64,
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
    /// Settings of the satellite as TOML: the tables of a mission's [sim] section, such as [spacecraft], or a whole
    /// mission file, of which that section is taken; the defaults without
    #[arg(long, value_name = "FILE")]
    simulation: Option<PathBuf>,
    /// Fly only this share of the missions, such as 2/8, and write a part for `swath-train merge` to --json
    #[arg(long, value_name = "I/N", requires = "json")]
    pub shard: Option<Shard>,
    /// Threads; results do not depend on it
    #[arg(long, default_value_t = super::cores())]
    threads: usize,
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
        let scenario = ScenarioConfig { count: self.requests, ..ScenarioConfig::default() };
        let missions = Missions {
            simulation: self.simulation.as_deref().map_or_else(|| Ok(SimConfig::default()), simulation)?,
            episode: EpisodeConfig { orbits: self.orbits, scenario, arrivals: self.arrivals },
            plant: PlantErrors::default(),
            first_seed: self.seed,
            count: self.episodes,
            shard: self.shard,
        };
        missions.seeds()?;
        Ok(missions)
    }

    /// What every result begins with: the missions as they were asked for, the program, and the settings that were
    /// resolved.
    pub fn describe(&self, missions: &Missions) -> Value {
        json!({
            "missions": {
                "episodes": self.episodes,
                "orbits": self.orbits,
                "requests": self.requests,
                "first_seed": self.seed,
                "arrivals": self.arrivals,
            },
            "program": Program::THIS,
            "configuration": { "simulation": missions.simulation, "episode": missions.episode },
        })
    }
}

/// Reads the satellite's settings, from a mission file too.
fn simulation(path: &Path) -> Result<SimConfig> {
    let name = path.display();
    let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {name}"))?;
    let invalid = || format!("{name} is not valid");
    let table: toml::Table = toml::from_str(&text).with_context(invalid)?;
    let config: SimConfig = match table.get("sim") {
        Some(section) => section.clone().try_into().with_context(|| format!("[sim] of mission {name} is not valid"))?,
        None => toml::from_str(&text).with_context(|| {
            format!(
                "{name} is not valid: --simulation takes the tables of a mission's [sim] section, or a mission with one"
            )
        })?,
    };
    config.validate().with_context(invalid)?;
    Ok(config)
}

/// How the satellite flown differs from the one that its guidance and planner believe in.
#[derive(Debug, Args)]
pub struct PlantArgs {
    /// Errors of the plant: none, or torque-10%, inertia+5% and the like, noise and delay, joined by commas, or a TOML
    /// file; may be given several times, for a table each
    #[arg(long = "plant", value_name = "NAME|FILE")]
    pub plants: Vec<String>,
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

/// Strips asked for and reachable, as a line under a table.
pub fn strips(missions: &[Mission]) -> String {
    let mean =
        |quantity: fn(&Mission) -> usize| cell(spread(missions, |it| Some(quantity(it) as f64)).map(|it| it.mean), 1);
    format!("strips a mission: {} asked for, {} reachable\n", mean(|it| it.requests), mean(|it| it.reachable))
}

/// A number of a table, `-` for one that is unknown.
pub fn cell(number: Option<f64>, decimals: usize) -> String {
    number.map_or_else(|| "-".to_owned(), |number| format!("{number:.decimals$}"))
}

/// A share in percent, `-` for one that is unknown.
pub fn percent(share: Option<f64>) -> String {
    share.map_or_else(|| "-".to_owned(), |share| format!("{:.1}%", share * 100.0))
}

/// Successes over attempts of all missions together; `None` without attempts.
pub fn pooled_success(own: &[Mission]) -> Option<f64> {
    let sum = |quantity: fn(&Mission) -> f64| own.iter().map(quantity).sum::<f64>();
    let attempts = sum(|it| it.attempts_per_orbit);
    (attempts > 0.0).then(|| sum(|it| it.imaged_per_orbit) / attempts)
}
