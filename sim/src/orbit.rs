//! Circular orbit and rotating Earth.

use nalgebra::{Matrix3, Vector2, Vector3};
use serde::{Deserialize, Serialize};

use crate::config::SimConfig;
use crate::time::{Tick, TickPeriod};

/// A uniformly turning angle: cosine and sine at any tick.
///
/// The angle of a tick is that of its block of [`Turn::BLOCK`] ticks plus the rest, whose cosine and sine stand in a
/// table: four products a tick instead of a sine and a cosine. The result is a pure function of the tick; what is
/// cached is only the last block's.
#[derive(Clone, Debug)]
pub struct Turn {
    phase: f64,
    rate_per_tick: f64,
    rest: Vec<(f64, f64)>,
    block: u64,
    block_cos_sin: (f64, f64),
}

impl Turn {
    const BLOCK: u64 = 256;

    /// An angle that is `phase` [rad] at tick 0 and grows by `rate` [rad/s].
    #[must_use]
    pub fn new(phase: f64, rate: f64, period: TickPeriod) -> Self {
        let rate_per_tick = rate * period.seconds();
        let cos_sin = |angle: f64| (libm::cos(angle), libm::sin(angle));
        Self {
            phase,
            rate_per_tick,
            rest: (0..Self::BLOCK).map(|i| cos_sin(rate_per_tick * i as f64)).collect(),
            block: 0,
            block_cos_sin: cos_sin(phase),
        }
    }

    /// Cosine and sine of the angle at a tick.
    #[inline]
    pub fn cos_sin(&mut self, tick: Tick) -> (f64, f64) {
        let block = tick.0 / Self::BLOCK;
        if block != self.block {
            let angle = self.phase + self.rate_per_tick * (block * Self::BLOCK) as f64;
            self.block = block;
            self.block_cos_sin = (libm::cos(angle), libm::sin(angle));
        }
        let (c1, s1) = self.block_cos_sin;
        let (c2, s2) = self.rest[(tick.0 % Self::BLOCK) as usize];
        (c1 * c2 - s1 * s2, s1 * c2 + c1 * s2)
    }

    /// Angle at a time since the epoch [rad], unwrapped.
    #[must_use]
    pub fn angle_at(&self, time_s: f64, period: TickPeriod) -> f64 {
        self.phase + self.rate_per_tick * (time_s / period.seconds())
    }
}

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

/// Rotates planet-fixed components (E) to inertial components (N) about the common z axis.
#[inline]
#[must_use]
pub fn earth_to_inertial(cos_sin: (f64, f64), v_E: &Vector3<f64>) -> Vector3<f64> {
    let (c, s) = cos_sin;
    Vector3::new(c * v_E.x - s * v_E.y, s * v_E.x + c * v_E.y, v_E.z)
}

/// The Earth's rotation angle.
#[must_use]
pub fn earth_turn(config: &SimConfig, period: TickPeriod) -> Turn {
    Turn::new(config.earth.angle_at_epoch_deg.to_radians(), config.earth.rotation_rad_s, period)
}

/// `dcm_HN`: rows are the Hill frame's radial, along-track and orbit-normal unit vectors in N.
#[must_use]
pub fn hill_dcm(r_BN_N: &Vector3<f64>, v_BN_N: &Vector3<f64>) -> Matrix3<f64> {
    let radial = r_BN_N.normalize();
    let normal = r_BN_N.cross(v_BN_N).normalize();
    let along = normal.cross(&radial);
    Matrix3::from_rows(&[radial.transpose(), along.transpose(), normal.transpose()])
}

/// Geocentric latitude and longitude of a planet-fixed direction [deg].
#[must_use]
pub fn latitude_longitude_deg(r_E: &Vector3<f64>) -> (f64, f64) {
    let horizontal = Vector2::new(r_E.x, r_E.y).norm();
    (libm::atan2(r_E.z, horizontal).to_degrees(), libm::atan2(r_E.y, r_E.x).to_degrees())
}

/// Planet-fixed unit vector of a geocentric latitude and longitude [deg].
#[must_use]
pub fn direction_E(latitude_deg: f64, longitude_deg: f64) -> Vector3<f64> {
    let (lat, lon) = (latitude_deg.to_radians(), longitude_deg.to_radians());
    let cos_lat = libm::cos(lat);
    Vector3::new(cos_lat * libm::cos(lon), cos_lat * libm::sin(lon), libm::sin(lat))
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    #[test]
    fn a_turn_is_the_sine_and_cosine_of_its_angle() {
        let period = TickPeriod::from_frequency(2.0).unwrap();
        let mut turn = Turn::new(0.3, 1.1e-3, period);
        for tick in [0, 1, 255, 256, 172_800, 511] {
            let angle: f64 = 0.3 + 1.1e-3 * 0.5 * tick as f64;
            let (c, s) = turn.cos_sin(Tick(tick));
            assert_relative_eq!(c, libm::cos(angle), epsilon = 1e-13);
            assert_relative_eq!(s, libm::sin(angle), epsilon = 1e-13);
        }
    }

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

    #[test]
    fn the_hill_frame_has_the_satellite_on_its_first_axis() {
        let r = Vector3::new(7e6, 1e5, -3e5);
        let v = Vector3::new(10.0, 5e3, 5e3);
        let dcm_HN = hill_dcm(&r, &v);
        assert_relative_eq!(dcm_HN * r, Vector3::new(r.norm(), 0.0, 0.0), epsilon = 1e-6);
        assert!((dcm_HN * v).y > 0.0);
        assert_relative_eq!(dcm_HN * dcm_HN.transpose(), Matrix3::identity(), epsilon = 1e-14);
    }

    #[test]
    fn latitude_and_longitude_round_trip() {
        let (lat, lon) = latitude_longitude_deg(&direction_E(-33.5, 151.25));
        assert_relative_eq!(lat, -33.5, epsilon = 1e-12);
        assert_relative_eq!(lon, 151.25, epsilon = 1e-12);
    }
}
