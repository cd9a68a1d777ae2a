//! Ground access: windows to the tick, elevation and range.

use std::collections::BTreeMap;

use anyhow::Result;
use serde::Deserialize;
use swath_sim::config::station::Station;
use swath_sim::time::Tick;
use swath_sim::world::contacts::{View, contacts_of};

use super::read::Input;
use super::{Check, Comparison};

/// A station of a history.
#[derive(Clone, Deserialize)]
pub struct Site {
    name: String,
    lat: f64,
    lon: f64,
    alt_m: f64,
}

impl Site {
    pub fn station(&self, mask_deg: f64, range_max_m: f64) -> Station {
        Station {
            name: self.name.clone(),
            latitude_deg: self.lat,
            longitude_deg: self.lon,
            altitude_m: self.alt_m,
            mask_deg,
            range_max_m: (range_max_m >= 0.0).then_some(range_max_m),
        }
    }
}

#[derive(Deserialize)]
struct Recorded {
    #[serde(flatten)]
    site: Site,
    windows: BTreeMap<String, Vec<Recording>>,
    data: Samples,
}

#[derive(Deserialize)]
struct Recording {
    rise: f64,
    set: Option<f64>,
    max_elevation: f64,
    max_elevation_tick: f64,
}

#[derive(Deserialize)]
struct Samples {
    t: Vec<f64>,
    elevation: Vec<f64>,
    range: Vec<f64>,
}

pub fn access(meta: &Input<'_>, data: &Input<'_>) -> Result<Comparison> {
    let (config, mut orbit, period) = (meta.config()?, meta.orbit()?, meta.period()?);
    let range_max: f64 = meta.number("maximum_range_m")?;
    let last = Tick((meta.number("duration_s")? / period.seconds()).round() as u64);
    let tick = |time_s: f64| Tick((time_s / period.seconds()).round() as u64);
    let mut checks = [Check::new("windows", 0.0), Check::new("elevation rad", 1e-9), Check::new("range m", 1e-3)];
    let mut rows = 0;
    for recorded in data.get::<Vec<Recorded>>("stations")? {
        let mut view = View::new(&recorded.site.station(0.0, range_max), &config, period);
        let samples = &recorded.data;
        for ((t, elevation), range) in samples.t.iter().zip(&samples.elevation).zip(&samples.range) {
            let ours = view.elevation_and_range(tick(*t), &orbit.position(tick(*t)));
            checks[1].add(ours.0, *elevation);
            checks[2].add(ours.1, *range);
            rows += 1;
        }
        for (mask, windows) in &recorded.windows {
            let station = recorded.site.station(mask.parse()?, range_max);
            let until = last.after(1);
            let ours = contacts_of(&station, 0, &config, &orbit, period, (Tick(0), until));
            let ours: Vec<_> = ours.iter().map(|it| (it.rise, (it.set < until).then_some(it.set))).collect();
            let wanted: Vec<_> = windows.iter().map(|it| (tick(it.rise), it.set.map(tick))).collect();
            checks[0].add(f64::from(u8::from(ours != wanted)), 0.0);
            for window in windows {
                let highest = tick(window.max_elevation_tick);
                let ours = view.elevation_and_range(highest, &orbit.position(highest)).0;
                checks[1].add(ours, window.max_elevation);
            }
        }
    }
    Ok(Comparison { rows, checks: checks.into() })
}
