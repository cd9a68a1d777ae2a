//! Passes of the satellite over stations, as people look at them.

use serde::Serialize;
use swath_sim::config::station::Station;
use swath_sim::time::Tick;
use swath_sim::vehicle::model::Model;
use swath_sim::world::contacts::{Contact, contacts_of};
use swath_sim::world::orbit::Orbit;

/// A pass over a station.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Pass {
    /// Name of the station.
    pub station: String,
    /// First tick at which the satellite is heard.
    pub rise_tick: Tick,
    /// First tick at which it is heard no more.
    pub set_tick: Tick,
    /// Length [s].
    pub duration_s: f64,
    /// Greatest elevation [deg].
    pub elevation_max_deg: f64,
    /// Range at the greatest elevation [km].
    pub range_min_km: f64,
    /// Range at the station's mask [km].
    pub range_mask_km: f64,
}

/// Passes over stations that end after `from` and begin before `to`, by their rise.
#[must_use]
pub fn passes(stations: &[Station], model: &Model, orbit: &Orbit, (from, to): (Tick, Tick)) -> Vec<Pass> {
    let mut all: Vec<Contact> = Vec::new();
    for (index, station) in stations.iter().enumerate() {
        all.extend(contacts_of(station, index, &model.config, orbit, model.period, (from, to)));
    }
    all.sort_by_key(|contact| (contact.rise, contact.station));
    let of = |contact: &Contact| Some(pass(stations.get(contact.station)?, contact, model, orbit));
    all.iter().filter_map(of).collect()
}

fn pass(station: &Station, contact: &Contact, model: &Model, orbit: &Orbit) -> Pass {
    let site = model.config.earth.radius_m + station.altitude_m;
    Pass {
        station: station.name.clone(),
        rise_tick: contact.rise,
        set_tick: contact.set,
        duration_s: contact.ticks() as f64 * model.period.seconds(),
        elevation_max_deg: contact.elevation_max.to_degrees(),
        range_min_km: range_m(site, orbit.radius, contact.elevation_max) / 1e3,
        range_mask_km: range_mask_m(station, model, orbit) / 1e3,
    }
}

/// Distance at which a station hears the satellite at most [m].
#[must_use]
pub fn range_mask_m(station: &Station, model: &Model, orbit: &Orbit) -> f64 {
    let site = model.config.earth.radius_m + station.altitude_m;
    let by_mask = range_m(site, orbit.radius, station.mask_deg.to_radians());
    station.range_max_m.map_or(by_mask, |max| max.min(by_mask))
}

/// Distance [m] to a satellite at a radius [m] that is seen at an elevation [rad] from a site at a radius [m]: the law
/// of cosines in the triangle of the Earth's centre, site and satellite.
fn range_m(site: f64, radius: f64, elevation: f64) -> f64 {
    let (sin, cos) = (libm::sin(elevation), libm::cos(elevation));
    (radius * radius - site * site * cos * cos).sqrt() - site * sin
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use swath_sim::config::SimConfig;
    use swath_sim::world::contacts::View;
    use swath_sim::world::orbit::OrbitPhase;

    use super::*;

    #[test]
    fn elevation_and_range_are_those_seen_from_the_station() {
        let model = Model::new(SimConfig::default()).unwrap();
        let mut orbit =
            Orbit::new(&model.config, OrbitPhase { raan_deg: 10.0, argument_of_latitude_deg: 20.0 }, model.period);
        let stations: Vec<Station> =
            ["weilheim", "santiago", "tokyo"].iter().map(|name| Station::named(name).unwrap()).collect();
        let found = passes(&stations, &model, &orbit, (Tick(0), Tick(172_800)));
        assert!(found.len() > 8, "{}", found.len());
        assert!(found.is_sorted_by_key(|pass| pass.rise_tick));
        for pass in &found {
            let station = stations.iter().find(|station| station.name == pass.station).unwrap();
            let mut view = View::new(station, &model.config, model.period);
            let mut seen = |tick: u64| view.elevation_and_range(Tick(tick), &orbit.position(Tick(tick)));
            let all: Vec<_> = (pass.rise_tick.0..pass.set_tick.0).map(&mut seen).collect();
            let highest = all.iter().map(|it| it.0).fold(0.0, f64::max);
            let nearest = all.iter().map(|it| it.1).fold(f64::MAX, f64::min);
            assert_relative_eq!(pass.elevation_max_deg, highest.to_degrees(), epsilon = 0.2);
            assert_relative_eq!(pass.range_min_km, nearest / 1e3, max_relative = 1e-3);
            if pass.rise_tick > Tick(0) {
                assert_relative_eq!(pass.range_mask_km, all[0].1 / 1e3, max_relative = 5e-3);
            }
            assert_relative_eq!(pass.duration_s, all.len() as f64 * 0.5);
        }
    }
}
