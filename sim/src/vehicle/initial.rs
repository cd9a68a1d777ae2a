//! The state of the satellite at the epoch.

use nalgebra::Vector3;
use rand::RngExt;
use serde::{Deserialize, Serialize};

use crate::config::{RAD_S_PER_RPM, SimConfig};
use crate::rng::Rng;
use crate::vehicle::dynamics::BodyState;
use crate::world::orbit::OrbitPhase;

/// Where everything is at the epoch.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InitialState {
    /// Place on the orbit.
    pub orbit: OrbitPhase,
    /// Attitude, rate and wheel speeds.
    pub body: BodyState,
}

impl InitialState {
    /// Draws an initial state: node and phase uniform, σ uniform in the unit ball, rates and wheel speeds uniform up to
    /// the configuration's limits.
    #[must_use]
    pub fn draw(config: &SimConfig, rng: &mut Rng) -> Self {
        let orbit = OrbitPhase {
            raan_deg: rng.random_range(0.0..360.0),
            argument_of_latitude_deg: rng.random_range(0.0..360.0),
        };
        let sigma_BN = loop {
            let sigma = uniform_cube(rng, 1.0);
            if sigma.norm_squared() <= 1.0 {
                break sigma;
            }
        };
        let omega_BN_B = uniform_cube(rng, config.spacecraft.rate_initial_max_rad_s);
        let wheel_speed = uniform_cube(rng, config.spacecraft.wheel_speed_initial_max_rpm * RAD_S_PER_RPM);
        Self { orbit, body: BodyState { sigma_BN, omega_BN_B, wheel_speed } }
    }
}

fn uniform_cube(rng: &mut Rng, half: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| rng.random_range(-half..=half))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng;

    #[test]
    fn a_seed_gives_the_same_state_and_streams_differ() {
        let config = SimConfig::default();
        let draw = |seed, number| InitialState::draw(&config, &mut rng::stream(seed, number));
        assert_eq!(draw(7, 0), draw(7, 0));
        assert_ne!(draw(7, 0), draw(7, 1));
        assert_ne!(draw(7, 0), draw(8, 0));
    }
}
