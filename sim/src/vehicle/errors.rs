//! How the satellite that is flown differs from the model that its guidance and its planner have of it.

use std::f64::consts::TAU;
use std::str::FromStr;

use nalgebra::Vector3;
use rand::RngExt;
use serde::{Deserialize, Serialize};

use crate::config::{SimConfig, in_range};
use crate::error::SimError;
use crate::rng::Rng;
use crate::vehicle::dynamics::{BodyState, Plant};
use crate::vehicle::model::Model;
use crate::vehicle::mrp;

/// Errors of the flown plant; without any by default.
///
/// Guidance commands and planners predict with the mission's configuration, while the body and the wheels have the
/// scaled values. Guidance and planners see attitude and rate with white noise, drawn once a tick; wheel speeds are
/// counted and exact. Eqs 12 and 13 are judged on the true attitude. A decision takes effect the planning delay after
/// its situation, and guidance holds the attitude meanwhile.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PlantErrors {
    /// True torque limit of the wheels over the configured one.
    pub torque_limit_scale: f64,
    /// True inertia of the body over the configured one, on every axis.
    pub inertia_scale: f64,
    /// 1-sigma noise of the attitude seen, a small rotation about each body axis [rad].
    pub attitude_noise_rad: f64,
    /// 1-sigma noise of the rate seen, per body axis [rad/s].
    pub rate_noise_rad_s: f64,
    /// Time from a situation to the start of the task decided on it [s].
    pub planning_delay_s: f64,
}

impl Default for PlantErrors {
    fn default() -> Self {
        Self {
            torque_limit_scale: 1.0,
            inertia_scale: 1.0,
            attitude_noise_rad: 0.0,
            rate_noise_rad_s: 0.0,
            planning_delay_s: 0.0,
        }
    }
}

/// Attitude noise by name: 40 arcseconds, a small star tracker's 1 sigma about its boresight, its worst axis [rad].
const STAR_TRACKER_NOISE_RAD: f64 = 40.0 / 3600.0 * TAU / 360.0;
/// Rate noise by name: an angular random walk of 0.15 deg/√h, a MEMS gyro's, over a tick of 0.5 s [rad/s].
///
/// Both are of the classes that NASA's "State-of-the-Art Small Spacecraft Technology", chapter 5, tabulates.
const GYRO_NOISE_RAD_S: f64 = 0.15 / 60.0 * TAU / 360.0 * std::f64::consts::SQRT_2;
/// Planning delay by name [s].
const DELAY_S: f64 = 1.0;

impl PlantErrors {
    /// Noise of a star tracker and a gyro of the small-satellite class.
    #[must_use]
    pub fn noise() -> Self {
        Self { attitude_noise_rad: STAR_TRACKER_NOISE_RAD, rate_noise_rad_s: GYRO_NOISE_RAD_S, ..Self::default() }
    }

    /// Checks every value's range; NaN fails each of them.
    ///
    /// # Errors
    /// The first value that is out of range, with its limits.
    pub fn validate(&self) -> Result<(), SimError> {
        for (name, value, min, max) in [
            ("plant.torque_limit_scale", self.torque_limit_scale, 0.1, 10.0),
            ("plant.inertia_scale", self.inertia_scale, 0.1, 10.0),
            ("plant.attitude_noise_rad", self.attitude_noise_rad, 0.0, 0.1),
            ("plant.rate_noise_rad_s", self.rate_noise_rad_s, 0.0, 0.1),
            ("plant.planning_delay_s", self.planning_delay_s, 0.0, 60.0),
        ] {
            in_range(name, value, min, max)?;
        }
        Ok(())
    }

    /// The true body and wheels of a mission.
    ///
    /// # Errors
    /// When an error, or what it makes of the configuration, is out of range.
    pub fn plant(&self, model: &Model) -> Result<Plant, SimError> {
        self.validate()?;
        let mut config = SimConfig::clone(&model.config);
        config.spacecraft.wheel_torque_max_nm *= self.torque_limit_scale;
        config.spacecraft.inertia_kg_m2 = config.spacecraft.inertia_kg_m2.map(|inertia| inertia * self.inertia_scale);
        config.validate()?;
        Ok(Plant::new(&config.spacecraft, model.period.seconds()))
    }

    /// Whether what the sensors measure differs from what is.
    #[must_use]
    pub fn noisy(&self) -> bool {
        self.attitude_noise_rad > 0.0 || self.rate_noise_rad_s > 0.0
    }

    /// What attitude and rate are seen through, if not exactly.
    #[must_use]
    pub fn sensor(&self, rng: Rng) -> Option<Sensor> {
        let (attitude, rate) = (self.attitude_noise_rad, self.rate_noise_rad_s);
        self.noisy().then_some(Sensor { rng, attitude, rate })
    }
}

/// Errors by name: `none`, or terms joined by commas: `torque-10%`, `inertia+5%` and the like, `noise`, `delay` (1 s).
impl FromStr for PlantErrors {
    type Err = SimError;

    fn from_str(name: &str) -> Result<Self, SimError> {
        let mut errors = Self::default();
        if name == "none" {
            return Ok(errors);
        }
        let unknown = || SimError::UnknownPlantError { name: name.to_owned() };
        for term in name.split(',') {
            let scale = |word: &str| {
                let percent = term.strip_prefix(word)?.strip_suffix('%')?;
                percent.starts_with(['+', '-']).then(|| percent.parse::<f64>().ok())?.map(|it| 1.0 + it / 100.0)
            };
            if let Some(scale) = scale("torque") {
                errors.torque_limit_scale = scale;
            } else if let Some(scale) = scale("inertia") {
                errors.inertia_scale = scale;
            } else if term == "noise" {
                let noise = Self::noise();
                errors.attitude_noise_rad = noise.attitude_noise_rad;
                errors.rate_noise_rad_s = noise.rate_noise_rad_s;
            } else if term == "delay" {
                errors.planning_delay_s = DELAY_S;
            } else {
                return Err(unknown());
            }
        }
        errors.validate()?;
        Ok(errors)
    }
}

/// Star tracker and gyro: attitude and rate with white noise.
#[derive(Clone, Debug)]
pub struct Sensor {
    rng: Rng,
    attitude: f64,
    rate: f64,
}

impl Sensor {
    /// What is seen of a state; each call draws anew.
    pub fn measure(&mut self, body: &BodyState) -> BodyState {
        // A small rotation by θ has the MRP θ/4.
        let turn_B = self.normal() * (self.attitude / 4.0);
        let rate_error = self.normal() * self.rate;
        BodyState {
            sigma_BN: mrp::add(&body.sigma_BN, &turn_B),
            omega_BN_B: body.omega_BN_B + rate_error,
            wheel_speed: body.wheel_speed,
        }
    }

    /// Three standard normal numbers (Box & Muller).
    fn normal(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| {
            let (radius, angle): (f64, f64) = (1.0 - self.rng.random::<f64>(), self.rng.random::<f64>());
            (-2.0 * libm::log(radius)).sqrt() * libm::cos(TAU * angle)
        })
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;
    use crate::rng;

    #[test]
    fn names_and_ranges() {
        let errors: PlantErrors = "torque-10%,inertia+5%,noise,delay".parse().unwrap();
        assert_relative_eq!(errors.torque_limit_scale, 0.9);
        assert_relative_eq!(errors.inertia_scale, 1.05);
        assert_relative_eq!(errors.attitude_noise_rad, 1.94e-4, max_relative = 1e-2);
        assert_relative_eq!(errors.planning_delay_s, 1.0);
        assert_eq!("none".parse(), Ok(PlantErrors::default()));
        for name in ["", "torque", "torque10%", "torque-10", "inertia+x%", "noise,", "torque-nan%", "torque-99%"] {
            assert!(name.parse::<PlantErrors>().is_err(), "{name}");
        }
        let text = PlantErrors { planning_delay_s: f64::NAN, ..PlantErrors::default() }.validate().unwrap_err();
        assert_eq!(text.to_string(), "plant.planning_delay_s is NaN, outside 0 to 60");
        let error = toml::from_str::<PlantErrors>("torque = 0.9").unwrap_err().to_string();
        assert!(error.contains("unknown field `torque`"), "{error}");
    }

    #[test]
    fn noise_has_the_deviation_asked_for_and_its_own_stream() {
        let body = BodyState {
            sigma_BN: Vector3::new(0.3, -0.5, 0.2),
            omega_BN_B: Vector3::new(0.01, 0.02, -0.03),
            wheel_speed: Vector3::new(1.0, 2.0, 3.0),
        };
        let errors = PlantErrors { attitude_noise_rad: 2e-3, rate_noise_rad_s: 1e-3, ..PlantErrors::default() };
        let mut sensor = errors.sensor(rng::stream(1, rng::SENSORS)).unwrap();
        let count = 20_000;
        let (mut turn, mut rate) = (Vector3::zeros(), Vector3::zeros());
        for _ in 0..count {
            let seen = sensor.measure(&body);
            turn += (mrp::subtract(&seen.sigma_BN, &body.sigma_BN) * 4.0).map(|x| x * x);
            rate += (seen.omega_BN_B - body.omega_BN_B).map(|x| x * x);
            assert_eq!(seen.wheel_speed, body.wheel_speed);
        }
        for axis in 0..3 {
            assert_relative_eq!((turn[axis] / f64::from(count)).sqrt(), 2e-3, max_relative = 0.03);
            assert_relative_eq!((rate[axis] / f64::from(count)).sqrt(), 1e-3, max_relative = 0.03);
        }
        assert!(PlantErrors::default().sensor(rng::stream(1, rng::SENSORS)).is_none());
    }
}
