//! Plans made on the ground for whole missions, flown blindly, beside what no plan can exceed.

use std::sync::Arc;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use swath_sim::foresight::{CANDIDATES, GroundSettings, OpenLoop, Plan, plan, upper_bound};
use swath_sim::learn::episode::{Env, EpisodeConfig};
use swath_sim::vehicle::errors::PlantErrors;
use swath_sim::vehicle::model::Model;

use crate::error::Result;
use crate::evaluate::{Mission, Missions, attempted, mission};

/// What is known of one mission's best plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Bracket {
    /// Its seed.
    pub seed: u64,
    /// Reward per orbit of the best plan found: no less can be had.
    pub best_known: f64,
    /// Reward per orbit that no plan exceeds.
    pub upper_bound: f64,
    /// Closed-loop ticks flown in the search.
    pub ticks: u64,
    /// Missions in which the plan was flown blindly, by plant.
    pub flown: Vec<Mission>,
}

/// Plans every mission with its whole catalogue known, and flies the plan blindly on each plant. With requests that come
/// in flight the plan that is flown knows only the others, and it keeps the margin; the brackets are for all requests and
/// without a margin. `each` is called after every mission.
///
/// # Errors
/// Settings out of range; missions in which nothing can be attempted.
pub fn brackets(
    missions: &Missions,
    plants: &[PlantErrors],
    settings: &GroundSettings,
    each: impl Fn() + Sync,
) -> Result<Vec<Bracket>> {
    missions.episode.validate()?;
    let mut simulation = missions.simulation.clone();
    simulation.planning.candidates = CANDIDATES;
    let model = Arc::new(Model::new(simulation)?);
    let bracket = |seed: u64| {
        let found = bracket(&model, &missions.episode, plants, settings, seed);
        each();
        found
    };
    let found = missions.seeds()?.map(bracket).collect::<Result<Vec<Bracket>>>()?;
    if missions.shard.is_none() {
        attempted(found.iter().flat_map(|it| &it.flown))?;
    }
    Ok(found)
}

fn bracket(
    model: &Arc<Model>,
    episode: &EpisodeConfig,
    plants: &[PlantErrors],
    settings: &GroundSettings,
    seed: u64,
) -> Result<Bracket> {
    let all_known = EpisodeConfig { arrivals: 0.0, ..episode.clone() };
    let env = Env::episode(model.clone(), &all_known, seed);
    let best = plan(&env, &GroundSettings { weakness: 0.0, ..*settings });
    let per_orbit = |reward: f64| reward / episode.orbits;
    let upper_bound = per_orbit(upper_bound(&env));
    let (env, to_fly) = if episode.arrivals > 0.0 || settings.weakness > 0.0 {
        let env = Env::episode(model.clone(), episode, seed);
        let careful = plan(&env, settings);
        (env, careful)
    } else {
        (env, best.clone())
    };
    let flown = plants.iter().map(|plant| blindly(&env, &to_fly, plant, episode, seed)).collect::<Result<_>>()?;
    Ok(Bracket { seed, best_known: per_orbit(best.reward), upper_bound, ticks: best.ticks, flown })
}

fn blindly(env: &Env, plan: &Plan, plant: &PlantErrors, episode: &EpisodeConfig, seed: u64) -> Result<Mission> {
    let mut env = env.clone();
    // What was planned before the flight comes without delay.
    let plant = PlantErrors { planning_delay_s: 0.0, ..plant.clone() };
    env.differ(&plant, seed)?;
    mission(env, &mut OpenLoop::new(plan), episode, seed)
}
