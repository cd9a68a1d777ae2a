//! Contacts: when a station hears the satellite, by the roots of the same function as start windows.

use nalgebra::Vector3;

use crate::config::SimConfig;
use crate::config::station::Station;
use crate::time::{Tick, TickPeriod};
use crate::world::frames::{earth_to_inertial, sin_elevation};
use crate::world::orbit::Orbit;
use crate::world::turn::{Turn, earth_turn};
use crate::world::windows::WindowFinder;

/// A pass of the satellite over a station.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Index of the station.
    pub station: usize,
    /// First tick at which the satellite is heard.
    pub rise: Tick,
    /// First tick at which it is heard no more.
    pub set: Tick,
    /// Greatest elevation [rad], reached between the two or, with a limit of range, at the nearest point.
    pub elevation_max: f64,
}

impl Contact {
    /// Whether the satellite is heard at a tick.
    #[must_use]
    pub fn contains(&self, tick: Tick) -> bool {
        self.rise <= tick && tick < self.set
    }

    /// Length [ticks].
    #[must_use]
    pub fn ticks(&self) -> u64 {
        self.set.0 - self.rise.0
    }
}

/// Contacts of one station that end after `from` and begin before `to`, in order.
#[must_use]
pub fn contacts_of(
    station: &Station,
    index: usize,
    config: &SimConfig,
    orbit: &Orbit,
    period: TickPeriod,
    (from, to): (Tick, Tick),
) -> Vec<Contact> {
    let cos_limit = station.cos_limit(config.earth.radius_m, orbit.radius);
    let mut contacts = Vec::new();
    if cos_limit >= 1.0 {
        return contacts;
    }
    let finder = WindowFinder::with_limit(config, orbit, period, cos_limit);
    let ratio = (config.earth.radius_m + station.altitude_m) / orbit.radius;
    // The limit itself is still out of contact: the first tick after a root.
    let tick_after = |time_s: f64| Tick((time_s / period.seconds()).ceil().max(0.0) as u64);
    finder.passes(&station.direction_E(), period.time_s(from), period.time_s(to), |pass| {
        let (rise, set) = (tick_after(pass.rise_s), tick_after(pass.set_s));
        let cos = pass.cos_greatest.clamp(-1.0, 1.0);
        let elevation_max = libm::atan2(cos - ratio, (1.0 - cos * cos).sqrt());
        if rise < set && set > from && rise < to {
            contacts.push(Contact { station: index, rise, set, elevation_max });
        }
    });
    contacts
}

/// Contacts of several stations over a mission.
#[derive(Clone, Debug, Default)]
pub struct Contacts {
    /// All contacts by their rise.
    all: Vec<Contact>,
    /// Length of the longest [ticks].
    longest: u64,
    /// Times at which any station hears the satellite, disjoint and in order: rise and set.
    any: Vec<(Tick, Tick)>,
}

impl Contacts {
    /// Contacts of stations up to a tick.
    #[must_use]
    pub fn new(stations: &[Station], config: &SimConfig, orbit: &Orbit, period: TickPeriod, until: Tick) -> Self {
        let of = |(index, station)| contacts_of(station, index, config, orbit, period, (Tick(0), until));
        let mut all: Vec<Contact> = stations.iter().enumerate().flat_map(of).collect();
        all.sort_by_key(|contact| (contact.rise, contact.station));
        let mut any: Vec<(Tick, Tick)> = Vec::new();
        for contact in &all {
            match any.last_mut() {
                Some((_, set)) if contact.rise <= *set => *set = contact.set.max(*set),
                _ => any.push((contact.rise, contact.set)),
            }
        }
        let longest = all.iter().map(Contact::ticks).max().unwrap_or(0);
        Self { all, longest, any }
    }

    /// All contacts, by their rise.
    #[must_use]
    pub fn all(&self) -> &[Contact] {
        &self.all
    }

    /// Contacts under way at a tick.
    pub fn at(&self, tick: Tick) -> impl Iterator<Item = &Contact> {
        let over = self.all.partition_point(|contact| contact.rise.0.saturating_add(self.longest) <= tick.0);
        let risen = self.all.partition_point(|contact| contact.rise <= tick);
        let recent = self.all.get(over..risen).unwrap_or_default();
        recent.iter().filter(move |contact| contact.contains(tick))
    }

    /// The time in contact with any station that is under way at a tick or comes next: its rise and set.
    #[must_use]
    pub fn next(&self, tick: Tick) -> Option<(Tick, Tick)> {
        self.any.get(self.any.partition_point(|(_, set)| *set <= tick)).copied()
    }

    /// The times in contact with any station that end after a tick, in order.
    #[must_use]
    pub fn from(&self, tick: Tick) -> &[(Tick, Tick)] {
        self.any.get(self.any.partition_point(|(_, set)| *set <= tick)..).unwrap_or_default()
    }

    /// Whether any station hears the satellite at a tick.
    #[must_use]
    pub fn any(&self, tick: Tick) -> bool {
        self.next(tick).is_some_and(|(rise, _)| rise <= tick)
    }

    /// Ticks in contact with any station in [`from`, `to`).
    #[must_use]
    pub fn ticks_between(&self, from: Tick, to: Tick) -> u64 {
        let within = self.from(from).iter().take_while(|(rise, _)| *rise < to);
        within.map(|(rise, set)| set.0.min(to.0) - rise.0.max(from.0)).sum()
    }
}

/// Contacts of an orbit with stations, found as far as they are asked for.
#[derive(Clone, Debug)]
pub struct ContactPlan {
    stations: Vec<Station>,
    config: SimConfig,
    orbit: Orbit,
    period: TickPeriod,
    contacts: Contacts,
    until: Tick,
}

/// Contacts are found at least this far ahead [s].
const PLAN_S: f64 = 86_400.0;

impl ContactPlan {
    /// The plan of an orbit.
    #[must_use]
    pub fn new(stations: Vec<Station>, config: &SimConfig, orbit: &Orbit, period: TickPeriod) -> Self {
        let (config, orbit) = (SimConfig { resources: None, ..config.clone() }, orbit.clone());
        Self { stations, config, orbit, period, contacts: Contacts::default(), until: Tick(0) }
    }

    /// Contacts, complete at least up to a day after a tick.
    pub fn around(&mut self, tick: Tick) -> &Contacts {
        let ahead = self.period.ticks_ceil(PLAN_S);
        if tick.after(ahead) > self.until {
            self.until = Tick(tick.0.saturating_mul(2)).after(ahead).after(ahead);
            self.contacts = Contacts::new(&self.stations, &self.config, &self.orbit, self.period, self.until);
        }
        &self.contacts
    }

    /// The stations.
    #[must_use]
    pub fn stations(&self) -> &[Station] {
        &self.stations
    }
}

/// Where a station sees the satellite.
#[derive(Clone, Debug)]
pub struct View {
    r_LP_E: Vector3<f64>,
    earth: Turn,
}

impl View {
    /// The view of a station.
    #[must_use]
    pub fn new(station: &Station, config: &SimConfig, period: TickPeriod) -> Self {
        let radius = config.earth.radius_m + station.altitude_m;
        Self { r_LP_E: station.direction_E() * radius, earth: earth_turn(config, period) }
    }

    /// Position of the station in N [m].
    #[must_use]
    pub fn position_N(&mut self, tick: Tick) -> Vector3<f64> {
        earth_to_inertial(self.earth.cos_sin(tick), &self.r_LP_E)
    }

    /// Elevation [rad] and range [m] of a satellite.
    #[must_use]
    pub fn elevation_and_range(&mut self, tick: Tick, r_BN_N: &Vector3<f64>) -> (f64, f64) {
        let r_LP_N = self.position_N(tick);
        (libm::asin(sin_elevation(r_BN_N, &r_LP_N)), (r_BN_N - r_LP_N).norm())
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;
    use crate::config::station::names;
    use crate::vehicle::model::Model;
    use crate::world::orbit::OrbitPhase;

    /// Contacts by looking at every tick: slow, and independent of the roots.
    fn by_every_tick(view: &mut View, station: &Station, orbit: &mut Orbit, until: u64) -> Vec<(u64, u64, f64)> {
        let mut found: Vec<(u64, u64, f64)> = Vec::new();
        let mask = station.mask_deg.to_radians();
        for tick in 0..until {
            let (elevation, range) = view.elevation_and_range(Tick(tick), &orbit.position(Tick(tick)));
            if elevation > mask && station.range_max_m.is_none_or(|max| range <= max) {
                match found.last_mut() {
                    Some((_, set, highest)) if *set == tick => (*set, *highest) = (tick + 1, elevation.max(*highest)),
                    _ => found.push((tick, tick + 1, elevation)),
                }
            }
        }
        found
    }

    #[test]
    fn contacts_are_those_found_by_looking_at_every_tick() {
        let model = Model::new(SimConfig::default()).unwrap();
        let until = 172_800;
        let mut count = 0;
        for (i, name) in names().enumerate() {
            let mut station = Station::named(name).unwrap();
            station.mask_deg = [5.0, 10.0, 15.0, 0.0][i % 4];
            station.range_max_m = [None, None, Some(1200e3)][i % 3];
            let phase = OrbitPhase { raan_deg: 37.0 * i as f64, argument_of_latitude_deg: 91.0 * i as f64 };
            let mut orbit = Orbit::new(&model.config, phase, model.period);
            let mut view = View::new(&station, &model.config, model.period);
            let wanted = by_every_tick(&mut view, &station, &mut orbit, until);
            let found = contacts_of(&station, i, &model.config, &orbit, model.period, (Tick(0), Tick(until)));
            let edges: Vec<_> = found.iter().map(|it| (it.rise.0, it.set.0.min(until))).collect();
            assert_eq!(edges, wanted.iter().map(|it| (it.0, it.1)).collect::<Vec<_>>(), "{name}");
            for (contact, (_, set, highest)) in found.iter().zip(&wanted) {
                if *set < until && contact.rise > Tick(0) {
                    assert_relative_eq!(contact.elevation_max, *highest, epsilon = 2e-3);
                }
            }
            count += found.len();
        }
        assert!(count > 60, "only {count} contacts");
    }

    #[test]
    fn times_in_contact_with_any_station_are_merged_and_counted() {
        let model = Model::new(SimConfig::default()).unwrap();
        let phase = OrbitPhase { raan_deg: 10.0, argument_of_latitude_deg: 20.0 };
        let orbit = Orbit::new(&model.config, phase, model.period);
        let stations: Vec<Station> = names().map(|name| Station::named(name).unwrap()).collect();
        let until = Tick(40_000);
        let contacts = Contacts::new(&stations, &model.config, &orbit, model.period, until);
        let by_tick = |from: u64, to: u64| {
            (from..to).filter(|tick| contacts.all().iter().any(|it| it.contains(Tick(*tick)))).count() as u64
        };
        for (from, to) in [(0, 40_000), (1234, 20_000), (30_000, 30_001)] {
            assert_eq!(contacts.ticks_between(Tick(from), Tick(to)), by_tick(from, to));
        }
        for tick in (0..40_000).step_by(97) {
            assert_eq!(contacts.any(Tick(tick)), contacts.at(Tick(tick)).next().is_some(), "tick {tick}");
        }
        assert_eq!(Contacts::default().next(Tick(0)), None);
        let mut plan = ContactPlan::new(stations, &model.config, &orbit, model.period);
        assert_eq!(plan.around(Tick(0)).next(Tick(0)), contacts.next(Tick(0)));
        let later = Tick(30_000_000);
        assert!(plan.around(later).next(later).unwrap().0.since(later) < 172_800);
    }
}
