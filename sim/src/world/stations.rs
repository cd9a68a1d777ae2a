//! Where stations stand, how far they hear, and which of them an orbit never sees.

use std::fmt;

use nalgebra::Vector3;

use crate::config::SimConfig;
use crate::config::station::Station;
use crate::world::frames::direction_E;

impl Station {
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
    use crate::config::station::names;

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
}
