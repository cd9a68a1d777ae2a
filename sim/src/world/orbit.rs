//! Circular two-body orbits.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::config::SimConfig;
use crate::time::{Tick, TickPeriod};
use crate::world::turn::Turn;

/// Where on its orbit the satellite is at the epoch.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OrbitPhase {
    /// Right ascension of the ascending node [deg].
    pub raan_deg: f64,
    /// Argument of latitude at the epoch [deg].
    pub argument_of_latitude_deg: f64,
}

/// Circular two-body orbit.
#[derive(Clone, Debug)]
pub struct Orbit {
    /// Radius [m].
    pub radius: f64,
    /// Mean motion [rad/s].
    pub mean_motion: f64,
    /// Unit vector to the ascending node, in N.
    pub node_N: Vector3<f64>,
    /// Unit vector 90° ahead of the node in the orbit plane, in N.
    pub ahead_N: Vector3<f64>,
    /// Argument of latitude.
    pub argument: Turn,
}

impl Orbit {
    /// The orbit of a configuration and a phase.
    #[must_use]
    pub fn new(config: &SimConfig, phase: OrbitPhase, period: TickPeriod) -> Self {
        let radius = config.earth.radius_m + config.orbit.altitude_km * 1e3;
        let mean_motion = (config.earth.mu_m3_s2 / (radius * radius * radius)).sqrt();
        let (raan, i) = (phase.raan_deg.to_radians(), config.orbit.inclination_deg.to_radians());
        let (cr, sr, ci, si) = (libm::cos(raan), libm::sin(raan), libm::cos(i), libm::sin(i));
        Self {
            radius,
            mean_motion,
            node_N: Vector3::new(cr, sr, 0.0),
            ahead_N: Vector3::new(-sr * ci, cr * ci, si),
            argument: Turn::new(phase.argument_of_latitude_deg.to_radians(), mean_motion, period),
        }
    }

    /// The circular orbit through a position [m] and a velocity [m/s] in N at a tick.
    #[must_use]
    pub fn through(r_BN_N: &Vector3<f64>, v_BN_N: &Vector3<f64>, now: Tick, period: TickPeriod) -> Self {
        let radius = r_BN_N.norm();
        let node_N = r_BN_N / radius;
        let ahead_N = (v_BN_N - node_N * v_BN_N.dot(&node_N)).normalize();
        let mean_motion = v_BN_N.norm() / radius;
        let phase = -mean_motion * period.time_s(now);
        Self { radius, mean_motion, node_N, ahead_N, argument: Turn::new(phase, mean_motion, period) }
    }

    /// Position r_BN_N [m] at a tick.
    #[inline]
    pub fn position(&mut self, tick: Tick) -> Vector3<f64> {
        let (c, s) = self.argument.cos_sin(tick);
        (self.node_N * c + self.ahead_N * s) * self.radius
    }

    /// Velocity v_BN_N [m/s] at a tick.
    pub fn velocity(&mut self, tick: Tick) -> Vector3<f64> {
        let (c, s) = self.argument.cos_sin(tick);
        (self.ahead_N * c - self.node_N * s) * (self.radius * self.mean_motion)
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    #[test]
    fn the_orbit_is_circular_with_keplers_period() {
        let period = TickPeriod::from_frequency(2.0).unwrap();
        let config = SimConfig::default();
        let phase = OrbitPhase { raan_deg: 30.0, argument_of_latitude_deg: 40.0 };
        let mut orbit = Orbit::new(&config, phase, period);
        let (r, v) = (orbit.position(Tick(777)), orbit.velocity(Tick(777)));
        assert_relative_eq!(r.norm(), 6_898_136.6, epsilon = 1e-6);
        assert_relative_eq!(r.dot(&v), 0.0, epsilon = 1e-3);
        // Vis viva on a circle: v² = μ/r.
        assert_relative_eq!(v.norm_squared(), 3.986_004_418e14 / r.norm(), max_relative = 1e-12);
        assert_relative_eq!(r.cross(&v).normalize().z, libm::cos(45f64.to_radians()), epsilon = 1e-12);
    }

    #[test]
    fn the_orbit_through_a_state_is_the_orbit_that_it_came_from() {
        let period = TickPeriod::from_frequency(2.0).unwrap();
        let phase = OrbitPhase { raan_deg: 30.0, argument_of_latitude_deg: 40.0 };
        let mut orbit = Orbit::new(&SimConfig::default(), phase, period);
        let now = Tick(100_000);
        let mut again = Orbit::through(&orbit.position(now), &orbit.velocity(now), now, period);
        for tick in [now, Tick(100_700)] {
            assert_relative_eq!(again.position(tick), orbit.position(tick), epsilon = 1e-5);
            assert_relative_eq!(again.velocity(tick), orbit.velocity(tick), epsilon = 1e-8);
        }
    }
}
