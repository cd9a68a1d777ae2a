//! Missions flown by planners on the same seeds, and statistics of what came out.

use std::sync::Arc;

use rayon::prelude::*;
use serde::Serialize;
use swath_sim::config::SimConfig;
use swath_sim::learn::episode::{Env, EpisodeConfig};
use swath_sim::model::Model;
use swath_sim::planner::{Planner, PlannerSpec};
use swath_sim::task::Totals;
use swath_sim::vehicle::errors::PlantErrors;

use crate::error::{Result, TrainingError};
use crate::planners;

/// Which missions to fly.
#[derive(Debug, Clone, PartialEq)]
pub struct Missions {
    /// The satellite.
    pub simulation: SimConfig,
    /// Length and requests.
    pub episode: EpisodeConfig,
    /// How the satellite flown differs from the one that planners believe in.
    pub plant: PlantErrors,
    /// Seed of the first mission; the others follow it.
    pub first_seed: u64,
    /// How many.
    pub count: u64,
}

/// One mission flown.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Mission {
    /// Its seed.
    pub seed: u64,
    /// Strips asked for by its end, without those that could not be flown.
    pub requests: usize,
    /// Sum of the priorities of imaged strips, per orbit.
    pub reward_per_orbit: f64,
    /// Share of the attempts that succeeded.
    pub success_rate: f64,
    /// Attempts per orbit.
    pub attempts_per_orbit: f64,
    /// Strips imaged per orbit.
    pub imaged_per_orbit: f64,
    /// Mean transition time of attempts [s].
    pub t_pre_s: f64,
    /// Mean acquisition time of attempts [s].
    pub t_acq_s: f64,
    /// Mean priority of imaged strips.
    pub priority: f64,
    /// Time spent waiting, per orbit [s].
    pub wait_s_per_orbit: f64,
    /// Share of the attempts that failed for attitude.
    pub failed_attitude: f64,
    /// Share of the attempts that failed for elevation.
    pub failed_elevation: f64,
}

/// A mean over missions.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Spread {
    /// Mean.
    pub mean: f64,
    /// Standard deviation over missions.
    pub deviation: f64,
    /// Half the width of the mean's 95 % confidence interval.
    pub confidence_95: f64,
}

/// Flies every mission with every planner; results are by planner, then by seed.
///
/// # Errors
/// A planner that cannot be made or fails; settings out of range.
pub fn fly(missions: &Missions, planners: &[PlannerSpec]) -> Result<Vec<Vec<Mission>>> {
    let failed = |error: swath_sim::error::SimError| TrainingError::Environment(error.to_string());
    missions.episode.validate().map_err(failed)?;
    let model = Arc::new(Model::new(missions.simulation.clone()).map_err(failed)?);
    let seeds = missions.first_seed..missions.first_seed + missions.count;
    let by_seed: Vec<Vec<Mission>> = seeds
        .into_par_iter()
        .map(|seed| {
            // One catalogue serves all planners: its windows take longer than flying.
            let mut env = Env::episode(model.clone(), &missions.episode, seed);
            env.differ(&missions.plant, seed).map_err(failed)?;
            let flown = planners.iter().map(|spec| {
                let mut planner = planners::make(spec, seed)?;
                mission(env.clone(), planner.as_mut(), seed, missions.episode.orbits)
            });
            flown.collect::<Result<Vec<Mission>>>()
        })
        .collect::<Result<_>>()?;
    let of = |index: usize| by_seed.iter().map(|row| row[index]).collect();
    Ok((0..planners.len()).map(of).collect())
}

/// Flies one mission to its end and adds up.
///
/// # Errors
/// When the planner fails.
pub fn mission(mut env: Env, planner: &mut dyn Planner, seed: u64, orbits: f64) -> Result<Mission> {
    let period = env.model().period;
    let mut totals = Totals::default();
    env.run(planner, |record| totals.add(record)).map_err(|error| TrainingError::Environment(error.to_string()))?;
    let attempts = totals.attempts as f64;
    let seconds = |ticks: u64| ticks as f64 * period.seconds();
    Ok(Mission {
        seed,
        requests: env.catalogue().len(),
        reward_per_orbit: totals.reward / orbits,
        success_rate: totals.success_rate(),
        attempts_per_orbit: attempts / orbits,
        imaged_per_orbit: totals.fulfilled as f64 / orbits,
        t_pre_s: seconds(totals.t_pre_ticks) / attempts,
        t_acq_s: seconds(totals.t_acq_ticks) / attempts,
        priority: totals.reward / totals.fulfilled as f64,
        wait_s_per_orbit: seconds(totals.wait_ticks) / orbits,
        failed_attitude: totals.failed_attitude as f64 / attempts,
        failed_elevation: totals.failed_elevation as f64 / attempts,
    })
}

/// Mean, deviation and confidence of some quantity over missions.
pub fn spread(missions: &[Mission], quantity: impl Fn(&Mission) -> f64) -> Spread {
    let values: Vec<f64> = missions.iter().map(quantity).collect();
    spread_of(&values)
}

/// Mean, deviation and confidence of numbers.
pub fn spread_of(values: &[f64]) -> Spread {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    let deviation = if count > 1.0 { (squares / (count - 1.0)).sqrt() } else { 0.0 };
    Spread { mean, deviation, confidence_95: student_975(count - 1.0) * deviation / count.sqrt() }
}

/// The 97.5 % quantile of Student's t, by the expansion of Abramowitz & Stegun 26.7.5.
fn student_975(freedom: f64) -> f64 {
    let x: f64 = 1.959_963_984_540_054;
    let g1 = (x.powi(3) + x) / 4.0;
    let g2 = (5.0 * x.powi(5) + 16.0 * x.powi(3) + 3.0 * x) / 96.0;
    let g3 = (3.0 * x.powi(7) + 19.0 * x.powi(5) + 17.0 * x.powi(3) - 15.0 * x) / 384.0;
    if freedom < 1.0 {
        return 0.0;
    }
    x + g1 / freedom + g2 / freedom.powi(2) + g3 / freedom.powi(3)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::{assert_abs_diff_eq, assert_relative_eq};

    #[test]
    fn spreads_follow_student() {
        let found = spread_of(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0]);
        assert_relative_eq!(found.mean, 6.0);
        assert_relative_eq!(found.deviation, 11.0f64.sqrt(), epsilon = 1e-12);
        // t(0.975, 10) = 2.2281
        assert_abs_diff_eq!(found.confidence_95, 2.2281, epsilon = 2e-3);
    }
}
