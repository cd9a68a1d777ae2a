//! Ground stations: a catalogue of real ones.

use serde::{Deserialize, Serialize};

use crate::config::range::in_range;
use crate::error::SimError;

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
