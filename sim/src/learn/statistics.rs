//! What came of a mission: reward, attempts and why they failed, per orbit.

use serde::{Deserialize, Serialize};

use crate::learn::episode::Env;
use crate::task::Totals;

/// One mission flown. What no attempt, or no image, tells is `None`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Score {
    /// Its seed.
    pub seed: u64,
    /// Strips asked for.
    pub requests: usize,
    /// Those of them that have a window in which they can be imaged, up to 1.5 orbits past the mission's end.
    pub reachable: usize,
    /// Sum of the priorities of imaged strips, per orbit.
    pub reward_per_orbit: f64,
    /// Share of the attempts that succeeded.
    pub success_rate: Option<f64>,
    /// Attempts per orbit.
    pub attempts_per_orbit: f64,
    /// Strips imaged per orbit.
    pub imaged_per_orbit: f64,
    /// Mean transition time of attempts [s].
    pub t_pre_s: Option<f64>,
    /// Mean acquisition time of attempts [s].
    pub t_acq_s: Option<f64>,
    /// Mean priority of imaged strips.
    pub priority: Option<f64>,
    /// Time spent waiting, per orbit [s].
    pub wait_s_per_orbit: f64,
    /// Share of the attempts that failed for attitude.
    pub failed_attitude: Option<f64>,
    /// Share of the attempts that failed for elevation.
    pub failed_elevation: Option<f64>,
    /// What came to the ground and what failed, where resources have bounds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub resources: Option<ResourceScore>,
}

/// What came to the ground in a mission, and what failed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ResourceScore {
    /// Sum of the priorities of strips whose images are on the ground, per orbit.
    pub delivered_per_orbit: f64,
    /// Images that are on the ground, per orbit.
    pub strips_per_orbit: f64,
    /// Times that the charge fell below the battery's floor.
    pub floor_violations: u64,
    /// Times that the battery was empty or a wheel over its limit.
    pub failures: u64,
}

impl Score {
    /// The score of a mission of `orbits` orbits that was flown to its end, in which `requests` strips were asked for.
    #[must_use]
    pub fn of(env: &Env, totals: &Totals, orbits: f64, seed: u64, requests: usize) -> Self {
        let seconds = |ticks: u64| ticks as f64 * env.model().period.seconds();
        let of_attempts = |sum: f64| (totals.attempts > 0).then(|| sum / totals.attempts as f64);
        Self {
            seed,
            requests,
            reachable: env.catalogue().len(),
            reward_per_orbit: totals.reward / orbits,
            success_rate: of_attempts(totals.fulfilled as f64),
            attempts_per_orbit: totals.attempts as f64 / orbits,
            imaged_per_orbit: totals.fulfilled as f64 / orbits,
            t_pre_s: of_attempts(seconds(totals.t_pre_ticks)),
            t_acq_s: of_attempts(seconds(totals.t_acq_ticks)),
            priority: (totals.fulfilled > 0).then(|| totals.reward / totals.fulfilled as f64),
            wait_s_per_orbit: seconds(totals.wait_ticks) / orbits,
            failed_attitude: of_attempts(totals.failed_attitude as f64),
            failed_elevation: of_attempts(totals.failed_elevation as f64),
            resources: env.onboard().map(|_| {
                let delivered = env.delivered();
                ResourceScore {
                    delivered_per_orbit: delivered.reward / orbits,
                    strips_per_orbit: delivered.strips as f64 / orbits,
                    floor_violations: delivered.floor_violations,
                    failures: delivered.failures,
                }
            }),
        }
    }
}
