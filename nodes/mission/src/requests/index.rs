//! Where and when strips can be imaged, so that neither question looks at all of them.

use std::collections::BTreeMap;

use swath_sim::time::Tick;
use swath_sim::world::strip::{Strip, StripId};
use swath_sim::world::windows::Window;

/// Strips by the cells of the Earth that they touch and by the time of their windows. They are only ever added: what
/// has become of a strip is the asker's business.
#[derive(Clone, Debug, Default)]
pub struct Index {
    cells: BTreeMap<u16, Vec<u32>>,
    slots: Vec<Vec<u32>>,
}

/// A part of the Earth between two parallels and two meridians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Area {
    /// Southern edge [deg].
    pub south_deg: f64,
    /// Northern edge [deg].
    pub north_deg: f64,
    /// Western edge [deg]; greater than the eastern one across the date line.
    pub west_deg: f64,
    /// Eastern edge [deg].
    pub east_deg: f64,
}

/// Edge of a cell [deg].
const CELL_DEG: f64 = 3.0;
const COLUMNS: u16 = 120;
const ROWS: u16 = 60;
/// Spacing of the points of a strip that are looked at, as a central angle [rad]: about 10 km.
const SPACING: f64 = 0.0016;
/// Ticks in a slot of the index in time.
const SLOT_TICKS: u64 = 512;

impl Area {
    /// Whether a point lies in the area.
    #[must_use]
    pub fn contains(&self, latitude_deg: f64, longitude_deg: f64) -> bool {
        let between = |longitude: f64| {
            if self.west_deg <= self.east_deg {
                (self.west_deg..=self.east_deg).contains(&longitude)
            } else {
                longitude >= self.west_deg || longitude <= self.east_deg
            }
        };
        (self.south_deg..=self.north_deg).contains(&latitude_deg) && between(longitude_deg)
    }

    /// Whether a point of the strip, looked at every 10 km, lies in the area.
    #[must_use]
    pub fn touches(&self, strip: &Strip) -> bool {
        points(strip).any(|(latitude_deg, longitude_deg)| self.contains(latitude_deg, longitude_deg))
    }

    fn cells(&self) -> impl Iterator<Item = u16> {
        let (south, north) = (row(self.south_deg), row(self.north_deg));
        let (west, east) = (column(self.west_deg), column(self.east_deg));
        let across = self.west_deg > self.east_deg;
        let columns = (0..COLUMNS).filter(move |column| {
            if across { *column >= west || *column <= east } else { (west..=east).contains(column) }
        });
        columns.flat_map(move |column| (south..=north).map(move |row| row * COLUMNS + column))
    }
}

fn row(latitude_deg: f64) -> u16 {
    (((latitude_deg + 90.0) / CELL_DEG) as u16).min(ROWS - 1)
}

fn column(longitude_deg: f64) -> u16 {
    (((longitude_deg + 180.0) / CELL_DEG) as u16).min(COLUMNS - 1)
}

/// Latitude and longitude of the points of a strip [deg].
fn points(strip: &Strip) -> impl Iterator<Item = (f64, f64)> {
    let steps = (strip.arc / SPACING).ceil().max(1.0) as u32;
    let duration = strip.acquisition_time_s();
    (0..=steps).map(move |step| {
        let (at_E, _) = strip.target_E(duration * f64::from(step) / f64::from(steps));
        (at_E.z.clamp(-1.0, 1.0).asin().to_degrees(), at_E.y.atan2(at_E.x).to_degrees())
    })
}

impl Index {
    /// Adds a strip with its windows. Identities come in ascending order.
    pub fn add(&mut self, id: StripId, strip: &Strip, windows: &[Window]) {
        let Ok(number) = u32::try_from(id.0) else { return };
        for (latitude_deg, longitude_deg) in points(strip) {
            let cell = row(latitude_deg) * COLUMNS + column(longitude_deg);
            let strips = self.cells.entry(cell).or_default();
            if strips.last() != Some(&number) {
                strips.push(number);
            }
        }
        for window in windows {
            let (first, last) = (window.open.0 / SLOT_TICKS, window.close.0 / SLOT_TICKS);
            let needed = last as usize + 1;
            if self.slots.len() < needed {
                self.slots.resize(needed, Vec::new());
            }
            for slot in first..=last {
                let strips = &mut self.slots[slot as usize];
                if strips.last() != Some(&number) {
                    strips.push(number);
                }
            }
        }
    }

    /// Strips that may touch an area, in ascending order.
    #[must_use]
    pub fn near(&self, area: &Area) -> Vec<StripId> {
        sorted(area.cells().filter_map(|cell| self.cells.get(&cell)))
    }

    /// Strips that may have a window between two ticks, in ascending order.
    #[must_use]
    pub fn between(&self, from: Tick, until: Tick) -> Vec<StripId> {
        let last = (until.0 / SLOT_TICKS).min((self.slots.len() as u64).saturating_sub(1));
        let between = (from.0 / SLOT_TICKS)..=last;
        sorted(between.filter_map(|slot| self.slots.get(slot as usize)))
    }
}

fn sorted<'a>(lists: impl Iterator<Item = &'a Vec<u32>>) -> Vec<StripId> {
    let mut numbers: Vec<u32> = lists.flatten().copied().collect();
    numbers.sort_unstable();
    numbers.dedup();
    numbers.into_iter().map(|number| StripId(u64::from(number))).collect()
}

#[cfg(test)]
mod tests {
    use swath_sim::config::SimConfig;
    use swath_sim::requests::scenario::ScenarioConfig;
    use swath_sim::rng;

    use super::*;

    fn strips() -> Vec<Strip> {
        let config = SimConfig::default();
        let radius = config.earth.radius_m;
        let requests = ScenarioConfig::default().generate(&mut rng::stream(8, rng::CATALOGUE), 3000, radius);
        requests.iter().map(|request| request.to_strip(&config.requests, radius).unwrap()).collect()
    }

    #[test]
    fn areas_find_what_looking_at_every_strip_finds() {
        let strips = strips();
        let mut index = Index::default();
        for (i, strip) in strips.iter().enumerate() {
            index.add(StripId(i as u64 + 1), strip, &[]);
        }
        let mut found = 0;
        for (south_deg, north_deg, west_deg, east_deg) in [
            (30.0, 50.0, -10.0, 20.0),
            (-5.0, 5.0, 170.0, -170.0),
            (88.0, 90.0, -180.0, 180.0),
            (-90.0, 90.0, -180.0, 180.0),
            (10.1, 10.2, 20.1, 20.2),
        ] {
            let area = Area { south_deg, north_deg, west_deg, east_deg };
            let by_looking: Vec<_> =
                (1..).zip(&strips).filter(|(_, strip)| area.touches(strip)).map(|(id, _)| StripId(id)).collect();
            let by_index: Vec<_> =
                index.near(&area).into_iter().filter(|id| area.touches(&strips[id.0 as usize - 1])).collect();
            assert_eq!(by_index, by_looking);
            found += by_looking.len();
        }
        assert!(found > 3000, "only {found} strips");
    }

    #[test]
    fn times_find_every_window_that_overlaps() {
        let strip = strips()[0];
        let mut index = Index::default();
        let windows = |id: u64| [Window { open: Tick(id * 700), close: Tick(id * 700 + 600) }];
        for id in 1..=200 {
            index.add(StripId(id), &strip, &windows(id));
        }
        for (from, until) in [(0, 100), (5000, 5001), (100_000, 200_000), (300_000, 400_000)] {
            let overlaps = |id: u64| windows(id)[0].open.0 <= until && windows(id)[0].close.0 >= from;
            let expected: Vec<_> = (1..=200).filter(|&id| overlaps(id)).map(StripId).collect();
            let mut found = index.between(Tick(from), Tick(until));
            found.retain(|id| overlaps(id.0));
            assert_eq!(found, expected);
        }
        assert!(index.between(Tick(300_000), Tick(400_000)).is_empty());
    }
}
