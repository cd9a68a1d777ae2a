//! Shadow factor and power of the solar array.

use anyhow::Result;
use nalgebra::Vector3;
use serde::Deserialize;
use swath_sim::config::SpacecraftConfig;
use swath_sim::time::Tick;
use swath_sim::vehicle::dynamics::Plant;
use swath_sim::vehicle::mrp::Rotation;
use swath_sim::vehicle::resources::battery::SolarArray;
use swath_sim::world::sun::Sun;

use super::read::{Input, Rows};
use super::{Check, Comparison};

/// A panel of a history.
#[derive(Deserialize)]
pub struct Panel {
    area: f64,
    efficiency: f64,
    nHat_B: [f64; 3],
}

impl Panel {
    pub fn array(&self) -> SolarArray {
        SolarArray::new(self.area, self.efficiency, self.nHat_B.into())
    }
}

/// Power of an array in an attitude [W].
pub fn power_w(array: &SolarArray, sun: &Sun, r_BN_N: &Vector3<f64>, sigma_BN: &Vector3<f64>, factor: f64) -> f64 {
    let normal_N = Rotation::new(sigma_BN).back().apply(&array.normal_B);
    array.power_w(&normal_N, &(sun.r_SE_N - r_BN_N), factor)
}

pub fn sun(meta: &Input<'_>) -> Result<Sun> {
    let radius = meta.maybe("planet_radius")?.map_or_else(|| meta.number("R_E"), Ok)?;
    Ok(Sun::new(meta.vector("r_sun_N")?, radius))
}

#[derive(Deserialize)]
struct Event {
    kind: String,
    first_tick: f64,
}

/// Illumination over an orbit, and the ticks at which penumbra and umbra begin and end.
pub fn eclipse(meta: &Input<'_>, data: &Input<'_>) -> Result<Comparison> {
    let (sun, mut orbit, period) = (sun(meta)?, meta.orbit()?, meta.period()?);
    let count: u64 = meta.get("ticks")?;
    let factors: Vec<f64> = (0..count).map(|tick| sun.illumination(&orbit.position(Tick(tick)))).collect();
    let mut factor = Check::new("factor", 1e-8);
    let ticks = data.ticks(period)?;
    for (tick, theirs) in ticks.iter().zip(data.get::<Vec<f64>>("illumination")?) {
        factor.add(factors.get(tick.0 as usize).copied().unwrap_or(f64::NAN), theirs);
    }
    let zone = |factor: f64| if factor >= 1.0 { 0 } else { 1 + i32::from(factor <= 0.0) };
    let mut events = Vec::new();
    for (tick, pair) in factors.windows(2).enumerate() {
        let kind = match (zone(pair[0]), zone(pair[1])) {
            (0, 1) => "penumbra_begin",
            (1, 2) => "umbra_begin",
            (2, 1) => "umbra_end",
            (1, 0) => "penumbra_end",
            _ => continue,
        };
        events.push((kind.to_owned(), (tick + 1) as f64 * period.seconds()));
    }
    let wanted: Vec<Event> = meta.get("events")?;
    let wanted: Vec<_> = wanted.into_iter().map(|event| (event.kind, event.first_tick)).collect();
    let mut differing = Check::new("events", 0.0);
    differing.add(f64::from(u8::from(events != wanted)), 0.0);
    let mut sum = Check::new("sum of factors", 1e-5);
    sum.add(factors.iter().sum(), meta.number("sum_factor")?);
    Ok(Comparison { rows: ticks.len(), checks: vec![factor, differing, sum] })
}

/// A rigid body without wheels, turning freely in the Sun.
pub fn panel_tumble(meta: &Input<'_>, data: &Input<'_>) -> Result<Comparison> {
    let (sun, mut orbit, period) = (sun(meta)?, meta.orbit()?, meta.period()?);
    let (plant, mut body) = (rigid(meta.get("I_diag")?, period.seconds()), meta.body()?);
    let array = meta.get::<Panel>("panel")?.array();
    let ticks = data.ticks(period)?;
    let (factors, powers): (Vec<f64>, Vec<f64>) = (data.get("illumination")?, data.get("panel_power")?);
    let sigmas: Rows = data.get("sigma_BN")?;
    let mut checks = [Check::new("factor", 1e-8), Check::new("power W", 1e-6), Check::new("sigma", 1e-8)];
    let mut now = Tick(0);
    for (row, &tick) in ticks.iter().enumerate() {
        while now < tick {
            plant.step(&mut body, &Vector3::zeros());
            now = now.after(1);
        }
        let r_BN_N = orbit.position(now);
        let factor = sun.illumination(&r_BN_N);
        checks[0].add(factor, factors[row]);
        checks[1].add(power_w(&array, &sun, &r_BN_N, &body.sigma_BN, factor), powers[row]);
        checks[2].add_all(same_set(&body.sigma_BN, sigmas[row]).as_slice(), body.sigma_BN.as_slice());
    }
    Ok(Comparison { rows: ticks.len(), checks: checks.into() })
}

/// Panels along a recorded attitude.
pub fn panel_replay(meta: &Input<'_>, data: &Input<'_>) -> Result<Comparison> {
    let sun = sun(meta)?;
    let panels: Vec<Panel> = meta.get("panels")?;
    let arrays: Vec<SolarArray> = panels.iter().map(Panel::array).collect();
    let (positions, sigmas): (Rows, Rows) = (data.get("r_BN_N")?, data.get("sigma_BN")?);
    let (factors, powers): (Vec<f64>, Vec<Vec<f64>>) = (data.get("illumination")?, data.get("panel_power")?);
    let mut checks = [Check::new("factor", 1e-8), Check::new("power W", 1e-6)];
    for (row, position) in positions.iter().enumerate() {
        let r_BN_N = Vector3::from(*position);
        let factor = sun.illumination(&r_BN_N);
        checks[0].add(factor, factors[row]);
        let sigma_BN = Vector3::from(sigmas[row]);
        let ours: Vec<f64> = arrays.iter().map(|it| power_w(it, &sun, &r_BN_N, &sigma_BN, factor)).collect();
        checks[1].add_all(&ours, &powers[row]);
    }
    Ok(Comparison { rows: positions.len(), checks: checks.into() })
}

/// A body whose wheels are too light to matter.
pub fn rigid(inertia_kg_m2: [f64; 3], dt: f64) -> Plant {
    let config = SpacecraftConfig { inertia_kg_m2, wheel_inertia_kg_m2: 1e-12, ..SpacecraftConfig::default() };
    Plant::new(&config, dt)
}

/// Their attitude in the set of ours: both sets of an attitude are the same attitude.
pub fn same_set(ours: &Vector3<f64>, theirs: [f64; 3]) -> Vector3<f64> {
    let theirs = Vector3::from(theirs);
    if (ours - theirs).norm() > 1.0 { swath_sim::vehicle::mrp::shadow(&theirs) } else { theirs }
}
