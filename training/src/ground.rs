//! Plans made on the ground for whole missions, flown blindly, beside what no plan can exceed.

use std::sync::Arc;

use rayon::prelude::*;
use serde::Serialize;
use swath_sim::foresight::{CANDIDATES, GroundSettings, OpenLoop, Plan, plan, upper_bound};
use swath_sim::learn::episode::{Env, EpisodeConfig};
use swath_sim::model::Model;
use swath_sim::vehicle::errors::PlantErrors;

use crate::error::{Result, TrainingError};
use crate::evaluate::{Mission, Missions, mission};

/// What is known of one mission's best plan.
#[derive(Debug, Clone, PartialEq, Serialize)]
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
/// without a margin.
///
/// # Errors
/// Settings out of range.
pub fn brackets(missions: &Missions, plants: &[PlantErrors], settings: &GroundSettings) -> Result<Vec<Bracket>> {
    let failed = |error: swath_sim::error::SimError| TrainingError::Environment(error.to_string());
    missions.episode.validate().map_err(failed)?;
    let mut simulation = missions.simulation.clone();
    simulation.planning.candidates = CANDIDATES;
    let model = Arc::new(Model::new(simulation).map_err(failed)?);
    let bracket = |seed: u64| {
        let all_known = EpisodeConfig { arrivals: 0.0, ..missions.episode.clone() };
        let env = Env::episode(model.clone(), &all_known, seed);
        let best = plan(&env, &GroundSettings { weakness: 0.0, ..*settings });
        let per_orbit = |reward: f64| reward / missions.episode.orbits;
        let upper_bound = per_orbit(upper_bound(&env));
        let (env, to_fly) = if missions.episode.arrivals > 0.0 || settings.weakness > 0.0 {
            let env = Env::episode(model.clone(), &missions.episode, seed);
            let careful = plan(&env, settings);
            (env, careful)
        } else {
            (env, best.clone())
        };
        let flown = plants.iter().map(|plant| blindly(&env, &to_fly, plant, seed, missions.episode.orbits));
        let flown = flown.collect::<Result<_>>()?;
        Ok(Bracket { seed, best_known: per_orbit(best.reward), upper_bound, ticks: best.ticks, flown })
    };
    (missions.first_seed..missions.first_seed + missions.count).into_par_iter().map(bracket).collect()
}

fn blindly(env: &Env, plan: &Plan, plant: &PlantErrors, seed: u64, orbits: f64) -> Result<Mission> {
    let mut env = env.clone();
    // What was planned before the flight comes without delay.
    let plant = PlantErrors { planning_delay_s: 0.0, ..plant.clone() };
    env.differ(&plant, seed).map_err(|error| TrainingError::Environment(error.to_string()))?;
    mission(env, &mut OpenLoop::new(plan), seed, orbits)
}
