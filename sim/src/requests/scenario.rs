//! Random scenarios (paper, section II.A).

use std::f64::consts::TAU;

use nalgebra::Vector3;
use rand::RngExt;
use serde::{Deserialize, Serialize};

use crate::config::{in_range, ordered};
use crate::error::SimError;
use crate::rng::{self, Rng};
use crate::world::frames::{direction_E, latitude_longitude_deg};
use crate::world::strip::StripRequest;

/// Distribution of random requests: uniform over the sphere, in azimuth, and over each range.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ScenarioConfig {
    /// Least and greatest number of strips.
    pub count: [u32; 2],
    /// Shortest and longest strip [km].
    pub length_km: [f64; 2],
    /// Slowest and fastest acquisition [m/s].
    pub speed_m_s: [f64; 2],
    /// Least and greatest priority.
    pub priority: [f64; 2],
}

impl Default for ScenarioConfig {
    fn default() -> Self {
        Self { count: [1000, 5000], length_km: [100.0, 500.0], speed_m_s: [2000.0, 4000.0], priority: [0.0, 1.0] }
    }
}

/// Largest random catalogue.
const COUNT_MAX: u32 = 1_000_000;

impl ScenarioConfig {
    /// Checks the ranges.
    ///
    /// # Errors
    /// The first range that runs backwards or out of bounds.
    pub fn validate(&self) -> Result<(), SimError> {
        ordered("scenario.count", f64::from(self.count[0]), f64::from(self.count[1]))?;
        in_range("scenario.count", f64::from(self.count[1]), 0.0, f64::from(COUNT_MAX))?;
        for (name, [min, max], low, high) in [
            ("scenario.length_km", self.length_km, 1.0, 5000.0),
            ("scenario.speed_m_s", self.speed_m_s, 100.0, 20_000.0),
            ("scenario.priority", self.priority, 0.0, 1.0),
        ] {
            in_range(name, min, low, high)?;
            in_range(name, max, low, high)?;
            ordered(name, min, max)?;
        }
        Ok(())
    }

    /// Number of strips that an episode of this seed asks for, whether they can be reached or not.
    #[must_use]
    pub fn count_of(&self, seed: u64) -> usize {
        self.draw_count(&mut rng::stream(seed, rng::CATALOGUE))
    }

    /// Draws the number of strips of a scenario.
    #[must_use]
    pub fn draw_count(&self, rng: &mut Rng) -> usize {
        rng.random_range(self.count[0]..=self.count[1]) as usize
    }

    /// Draws `count` requests on an Earth of `radius` [m].
    #[must_use]
    pub fn generate(&self, rng: &mut Rng, count: usize, radius: f64) -> Vec<StripRequest> {
        (0..count).map(|_| self.draw(rng, radius)).collect()
    }

    fn draw(&self, rng: &mut Rng, radius: f64) -> StripRequest {
        let z = rng.random_range(-1.0..=1.0f64);
        let start_latitude_deg = libm::asin(z).to_degrees();
        let start_longitude_deg = rng.random_range(-180.0..180.0);
        let azimuth = rng.random_range(0.0..TAU);
        let arc = uniform(rng, self.length_km) * 1e3 / radius;
        let start = direction_E(start_latitude_deg, start_longitude_deg);
        let lon = f64::to_radians(start_longitude_deg);
        let east = Vector3::new(-libm::sin(lon), libm::cos(lon), 0.0);
        let north = start.cross(&east);
        let along = north * libm::cos(azimuth) + east * libm::sin(azimuth);
        let end = start * libm::cos(arc) + along * libm::sin(arc);
        let (end_latitude_deg, end_longitude_deg) = latitude_longitude_deg(&end);
        StripRequest {
            start_latitude_deg,
            start_longitude_deg,
            end_latitude_deg,
            end_longitude_deg,
            acquisition_speed_m_s: uniform(rng, self.speed_m_s),
            priority: uniform(rng, self.priority),
            bidirectional: false,
        }
    }
}

fn uniform(rng: &mut Rng, [min, max]: [f64; 2]) -> f64 {
    rng.random_range(min..=max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::RequestLimits;

    const EARTH_RADIUS_M: f64 = 6_378_136.6;

    #[test]
    fn random_requests_are_valid_and_spread_over_the_sphere() {
        let requests = ScenarioConfig::default().generate(&mut rng::stream(1, rng::CATALOGUE), 4000, EARTH_RADIUS_M);
        let limits = RequestLimits::default();
        let (mut north, mut length) = (0, 0.0);
        for request in &requests {
            let strip = request.to_strip(&limits, EARTH_RADIUS_M).unwrap();
            north += usize::from(request.start_latitude_deg > 30.0);
            length += strip.arc * EARTH_RADIUS_M / 1e3;
        }
        // A quarter of the sphere lies north of 30°; lengths average 300 km.
        assert!((900..1100).contains(&north), "{north}");
        assert!((length / 4000.0 - 300.0).abs() < 6.0, "{}", length / 4000.0);
    }

    #[test]
    fn backward_ranges_are_refused() {
        let config = ScenarioConfig { length_km: [500.0, 100.0], ..ScenarioConfig::default() };
        assert!(matches!(config.validate(), Err(SimError::EmptyRange { .. })));
    }
}
