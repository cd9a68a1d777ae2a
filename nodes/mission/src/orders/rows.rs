//! In which direction the strips of an area lie.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use swath_sim::config::SimConfig;

/// How the direction of an area's strips is chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Rows {
    /// That with the fewest strips.
    #[default]
    Fewest,
    /// That of the satellite's passes over the area's middle: northward or southward, whichever needs fewer strips.
    Passes,
    /// A heading at the area's middle, clockwise from north [deg].
    Heading(f64),
}

/// Greatest heading, either way [deg].
const HEADING_MAX_DEG: f64 = 360.0;

impl FromStr for Rows {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let heading = || text.parse().ok().filter(|it: &f64| it.abs() <= HEADING_MAX_DEG).map(Self::Heading);
        match text {
            "fewest" => Ok(Self::Fewest),
            "passes" => Ok(Self::Passes),
            _ => heading()
                .ok_or_else(|| format!("`{text}` is neither `fewest`, `passes` nor a heading of -360 to 360 degrees")),
        }
    }
}

impl fmt::Display for Rows {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Fewest => f.write_str("fewest"),
            Self::Passes => f.write_str("passes"),
            Self::Heading(deg) => write!(f, "{deg}"),
        }
    }
}

impl TryFrom<String> for Rows {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl From<Rows> for String {
    fn from(rows: Rows) -> Self {
        rows.to_string()
    }
}

/// What a satellite's way over the ground hangs on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passes {
    /// Inclination of its orbit [rad].
    pub inclination: f64,
    /// Its mean motion [rad/s].
    pub mean_motion: f64,
    /// Rotation of the Earth [rad/s].
    pub earth_rotation: f64,
}

impl Passes {
    /// Those of a configuration.
    #[must_use]
    pub fn of(config: &SimConfig) -> Self {
        let radius = config.earth.radius_m + config.orbit.altitude_km * 1e3;
        Self {
            inclination: config.orbit.inclination_deg.to_radians(),
            mean_motion: (config.earth.mu_m3_s2 / radius.powi(3)).sqrt(),
            earth_rotation: config.earth.rotation_rad_s,
        }
    }

    /// Headings of the ground track at a latitude [rad], clockwise from north: of the northward and of the southward
    /// pass. Beyond the latitudes that the track reaches they are those of its turning point.
    ///
    /// From spherical trigonometry, sin β = cos i / cos φ is the eastward part of the inertial way; the ground turns
    /// away under it with ω cos φ (Vallado, *Fundamentals of Astrodynamics and Applications*, section 11.4.2).
    #[must_use]
    pub fn headings(&self, latitude: f64) -> [f64; 2] {
        let cos_latitude = libm::cos(latitude).max(1e-9);
        let east = (libm::cos(self.inclination) / cos_latitude).clamp(-1.0, 1.0);
        let north = (1.0 - east * east).sqrt();
        let eastward = self.mean_motion * east - self.earth_rotation * cos_latitude;
        [north, -north].map(|north| libm::atan2(eastward, self.mean_motion * north))
    }
}

#[cfg(test)]
mod tests {
    use swath_sim::time::Tick;
    use swath_sim::vehicle::model::Model;
    use swath_sim::world::frames::latitude_longitude_deg;
    use swath_sim::world::orbit::{Orbit, OrbitPhase};

    use super::*;

    #[test]
    fn rows_survive_their_own_text_and_others_are_told() {
        for rows in [Rows::Fewest, Rows::Passes, Rows::Heading(-12.5)] {
            assert_eq!(rows.to_string().parse(), Ok(rows));
        }
        for text in ["", "most", "nan", "361", "Passes"] {
            let error = text.parse::<Rows>().unwrap_err();
            assert!(error.starts_with(&format!("`{text}` is neither")), "{error}");
        }
    }

    #[test]
    fn headings_of_passes_are_those_of_the_orbit_that_is_flown() {
        for inclination_deg in [45.0, 97.5, 5.0] {
            let mut config = SimConfig::default();
            config.orbit.inclination_deg = inclination_deg;
            let model = Model::new(config.clone()).unwrap();
            let phase = OrbitPhase { raan_deg: 77.0, argument_of_latitude_deg: 0.0 };
            let mut orbit = Orbit::new(&config, phase, model.period);
            let mut seen = 0;
            for tick in (0..12_000).step_by(37) {
                let ground = |orbit: &mut Orbit, tick: u64| {
                    let angle = config.earth.rotation_rad_s * model.period.time_s(Tick(tick));
                    let r = orbit.position(Tick(tick));
                    let (sin, cos) = angle.sin_cos();
                    let r_E = nalgebra::Vector3::new(r.x * cos + r.y * sin, r.y * cos - r.x * sin, r.z);
                    let (latitude, longitude) = latitude_longitude_deg(&r_E.normalize());
                    [latitude.to_radians(), longitude.to_radians()]
                };
                let ([before, here, after], seconds) = ([0, 1, 2].map(|k| ground(&mut orbit, tick + k)), 1.0);
                let north = (after[0] - before[0]) / seconds;
                let turned = (after[1] - before[1] + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU);
                let east = (turned - std::f64::consts::PI) * here[0].cos();
                // Near its turning point, a track has no steady heading.
                if north.abs() < 1e-5 {
                    continue;
                }
                let expected = Passes::of(&config).headings(here[0])[usize::from(north < 0.0)];
                let off = (expected - east.atan2(north)).sin().abs();
                assert!(off < 2e-3, "{inclination_deg} {here:?} {expected} {off}");
                seen += 1;
            }
            assert!(seen > 200, "{seen}");
        }
        let beyond = Passes::of(&SimConfig::default()).headings(60_f64.to_radians());
        assert!(beyond.iter().all(|heading| (heading - std::f64::consts::FRAC_PI_2).abs() < 1e-6), "{beyond:?}");
    }
}
