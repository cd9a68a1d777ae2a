//! Ground stations: a catalogue of real ones, and which of them an orbit never sees.

use std::fmt;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::config::{SimConfig, in_range};
use crate::error::SimError;
use crate::world::frames::direction_E;

/// A ground station.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Station {
    /// Name.
    pub name: String,
    /// Geocentric latitude [deg].
    pub latitude_deg: f64,
    /// Longitude, east positive [deg].
    pub longitude_deg: f64,
    /// Height over the sphere [m].
    #[serde(default)]
    pub altitude_m: f64,
    /// Elevation above which the satellite can be heard [deg].
    #[serde(default = "mask_deg")]
    pub mask_deg: f64,
    /// Farthest satellite that can be heard [m]; none for no limit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range_max_m: Option<f64>,
}

/// Elevation mask of stations that say nothing else [deg].
const MASK_DEG: f64 = 10.0;

fn mask_deg() -> f64 {
    MASK_DEG
}

/// Real stations: name, latitude [deg], longitude [deg], height [m].
///
/// The first seven are BSK-RL's (`GroundStationWorldModel`), with their heights. The others are of the station lists of
/// brahe (`data/groundstations`, after the operators KSAT, SSC, AWS and Atlas), which give no heights; where operators
/// share a site it stands here once. Coordinates are facts, rounded as the sources have them.
const CATALOGUE: [(&str, f64, f64, f64); 32] = [
    ("boulder", 40.009_971, -105.243_895, 1624.0),
    ("merritt", 28.3181, -80.666, 0.9144),
    ("singapore", 1.3521, 103.8198, 15.0),
    ("weilheim", 47.8407, 11.1421, 563.0),
    ("santiago", -33.4489, -70.6693, 570.0),
    ("dongara", -29.2452, 114.9326, 34.0),
    ("hawaii", 19.8968, -155.5828, 9.0),
    ("athens", 37.85, 22.62, 0.0),
    ("awarua", -46.53, 168.38, 0.0),
    ("azores", 36.99, -25.13, 0.0),
    ("bahrain", 26.03, 50.3, 0.0),
    ("bangalore", 12.9, 77.37, 0.0),
    ("cape-town", -34.01, 18.43, 0.0),
    ("dubai", 25.23, 55.47, 0.0),
    ("esrange", 67.8833, 21.0667, 0.0),
    ("fairbanks", 64.82, -147.72, 0.0),
    ("hartebeesthoek", -25.89, 27.71, 0.0),
    ("inuvik", 68.33, -133.61, 0.0),
    ("jeju", 33.39, 126.32, 0.0),
    ("kourou", 5.25, -52.8, 0.0),
    ("maspalomas", 27.77, -15.64, 0.0),
    ("mauritius", -20.5, 57.45, 0.0),
    ("mingenew", -29.01, 115.34, 0.0),
    ("nuuk", 64.19, -51.7, 0.0),
    ("puertollano", 38.67, -4.16, 0.0),
    ("punta-arenas", -52.94, -70.87, 0.0),
    ("stockholm", 59.2, 18.0833, 0.0),
    ("svalbard", 78.23, 15.41, 0.0),
    ("tokyo", 36.0, 139.35, 0.0),
    ("tolhuin", -54.51, -67.12, 0.0),
    ("tromso", 69.66, 18.95, 0.0),
    ("troll", -72.0, 2.53, 0.0),
];

/// Names of the catalogue's stations.
pub fn names() -> impl Iterator<Item = &'static str> {
    CATALOGUE.iter().map(|station| station.0)
}

impl Station {
    /// The catalogue's station of a name, with the usual mask of 10°.
    ///
    /// # Errors
    /// When the catalogue has no such station.
    pub fn named(name: &str) -> Result<Self, SimError> {
        let found = CATALOGUE.iter().find(|station| station.0 == name);
        let &(_, latitude_deg, longitude_deg, altitude_m) = found.ok_or_else(|| SimError::UnknownStation {
            name: name.to_owned(),
            known: names().collect::<Vec<_>>().join(", "),
        })?;
        let name = name.to_owned();
        Ok(Self { name, latitude_deg, longitude_deg, altitude_m, mask_deg: MASK_DEG, range_max_m: None })
    }

    /// Checks every value's range; NaN fails each of them.
    ///
    /// # Errors
    /// The first value that is out of range, with its limits.
    pub fn validate(&self) -> Result<(), SimError> {
        for (name, value, min, max) in [
            ("station.latitude_deg", self.latitude_deg, -90.0, 90.0),
            ("station.longitude_deg", self.longitude_deg, -180.0, 360.0),
            ("station.altitude_m", self.altitude_m, -500.0, 9000.0),
            ("station.mask_deg", self.mask_deg, 0.0, 89.0),
            ("station.range_max_m", self.range_max_m.unwrap_or(f64::MAX), 1e3, f64::MAX),
        ] {
            in_range(name, value, min, max)?;
        }
        Ok(())
    }

    /// Unit vector from the Earth's centre, planet-fixed.
    #[must_use]
    pub fn direction_E(&self) -> Vector3<f64> {
        direction_E(self.latitude_deg, self.longitude_deg)
    }

    /// Greatest central angle between station and satellite at which it can be heard, as its cosine: that of the mask,
    /// sin(90° - ε - λ)/ρ = sin(90° + ε)/r, and that of the range by the law of cosines.
    #[must_use]
    pub fn cos_limit(&self, earth_radius: f64, orbit_radius: f64) -> f64 {
        let site = earth_radius + self.altitude_m;
        let mask = self.mask_deg.to_radians();
        let by_mask = libm::cos(libm::acos(site / orbit_radius * libm::cos(mask)) - mask);
        let by_range = self.range_max_m.map_or(-1.0, |range| {
            (orbit_radius * orbit_radius + site * site - range * range) / (2.0 * orbit_radius * site)
        });
        by_mask.max(by_range)
    }

    /// Why a satellite of this configuration is never over the station's mask; `None` where it sometimes is.
    #[must_use]
    pub fn never_seen(&self, config: &SimConfig) -> Option<NeverSeen> {
        let radius = config.earth.radius_m;
        let cos_limit = self.cos_limit(radius, radius + config.orbit.altitude_km * 1e3);
        let inclination = config.orbit.inclination_deg;
        let reach_deg = if cos_limit >= 1.0 { 0.0 } else { libm::acos(cos_limit).to_degrees() };
        let limit_deg = inclination.min(180.0 - inclination) + reach_deg;
        let hopeless = self.latitude_deg.abs() >= limit_deg || cos_limit >= 1.0;
        hopeless.then(|| NeverSeen {
            name: self.name.clone(),
            latitude_deg: self.latitude_deg,
            mask_deg: self.mask_deg,
            limit_deg,
        })
    }
}

/// A station that an orbit never sees.
#[derive(Clone, Debug, PartialEq)]
pub struct NeverSeen {
    /// Name of the station.
    pub name: String,
    /// Its latitude [deg].
    pub latitude_deg: f64,
    /// Its mask [deg].
    pub mask_deg: f64,
    /// Latitude up to which stations with this mask, range and height see the satellite [deg].
    pub limit_deg: f64,
}

impl fmt::Display for NeverSeen {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, latitude_deg, mask_deg, limit_deg } = self;
        write!(
            f,
            "station {name} at latitude {latitude_deg:.1}° never sees the satellite above {mask_deg}°: this orbit is seen \
             up to {limit_deg:.1}°"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_catalogue_is_valid_and_names_are_unique() {
        let mut seen = std::collections::BTreeSet::new();
        for name in names() {
            Station::named(name).unwrap().validate().unwrap();
            assert!(seen.insert(name), "{name} twice");
        }
        let error = Station::named("Boulder ").unwrap_err().to_string();
        assert!(error.starts_with("no station `Boulder `") && error.contains("boulder, merritt"), "{error}");
    }

    #[test]
    fn stations_beyond_59_degrees_never_see_the_usual_orbit() {
        let config = SimConfig::default();
        let unseen: Vec<&str> =
            names().filter(|name| Station::named(name).unwrap().never_seen(&config).is_some()).collect();
        assert_eq!(unseen, ["esrange", "fairbanks", "inuvik", "nuuk", "svalbard", "tromso", "troll"]);
        let text = Station::named("svalbard").unwrap().never_seen(&config).unwrap().to_string();
        let wanted = "station svalbard at latitude 78.2° never sees the satellite above 10°: this orbit is seen up to \
                      59.4°";
        assert_eq!(text, wanted);
        let near = Station { range_max_m: Some(500e3), ..Station::named("boulder").unwrap() };
        assert!(near.never_seen(&config).is_some(), "an orbit 520 km up is never within 500 km");
    }

    #[test]
    fn bad_values_are_refused() {
        let with = |change: fn(&mut Station)| {
            let mut station = Station::named("boulder").unwrap();
            change(&mut station);
            station.validate().map_err(|error| error.to_string())
        };
        assert_eq!(with(|it| it.mask_deg = 91.0), Err("station.mask_deg is 91, outside 0 to 89".to_owned()));
        assert!(with(|it| it.latitude_deg = f64::NAN).is_err());
        assert!(with(|it| it.range_max_m = Some(-1.0)).is_err());
    }
}
