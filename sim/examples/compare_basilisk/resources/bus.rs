//! Wheel power and battery.

use anyhow::Result;
use serde::Deserialize;
use swath_sim::vehicle::resources::battery::{Battery, WheelPower};

use super::loops::ClosedLoop;
use super::read::{Input, Rows};
use super::sunlight::{Panel, power_w, same_set, sun};
use super::{Check, Comparison};

/// Wheels without and with recovery.
fn both_wheels(meta: &Input<'_>) -> Result<[WheelPower; 2]> {
    let (base_w, motor_efficiency) = (meta.number("base_power_W")?, meta.number("elec_to_mech_efficiency")?);
    let with = |recovery| WheelPower { base_w, motor_efficiency, recovery };
    Ok([with(meta.number("mech_to_elec_efficiency_no_regen")?), with(meta.number("mech_to_elec_efficiency_regen")?)])
}

/// Power that three wheels draw, as Basilisk signs it [W].
fn drawn(wheels: &WheelPower, speed: &[f64], torque: &[f64]) -> Vec<f64> {
    speed.iter().zip(torque).map(|(speed, torque)| -wheels.power_w(*speed, *torque)).collect()
}

/// Wheels along recorded speeds and torques.
pub fn wheel_replay(meta: &Input<'_>, data: &Input<'_>) -> Result<Comparison> {
    let [without, with] = both_wheels(meta)?;
    let (speeds, torques): (Rows, Rows) = (data.get("rw_speed")?, data.get("rw_u_current")?);
    let theirs: [Rows; 2] = [data.get("wheel_power_no_regen")?, data.get("wheel_power_regen")?];
    let mut check = Check::new("wheel power W", 1e-9);
    for (row, (speed, torque)) in speeds.iter().zip(&torques).enumerate() {
        check.add_all(&drawn(&without, speed, torque), &theirs[0][row]);
        check.add_all(&drawn(&with, speed, torque), &theirs[1][row]);
    }
    Ok(Comparison { rows: speeds.len(), checks: vec![check] })
}

/// Wheels in a slew.
pub fn wheel_power(meta: &Input<'_>, data: &Input<'_>) -> Result<Comparison> {
    let [without, with] = both_wheels(meta)?;
    let mut flown = ClosedLoop::new(meta)?;
    let ticks = data.ticks(flown.model.period)?;
    let (speeds, sigmas): (Rows, Rows) = (data.get("rw_speed")?, data.get("sigma_BN")?);
    let theirs: [Rows; 2] = [data.get("wheel_power_no_regen")?, data.get("wheel_power_regen")?];
    let mut checks = [
        Check::new("sigma", 1e-8),
        Check::new("wheel rad/s", 1e-8),
        Check::new("wheel power W", 1e-6),
        Check::new("energy J", 1e-4),
    ];
    let count: u64 = meta.get("ticks")?;
    let dt = flown.model.period.seconds();
    let mut energies = [[0.0; 3]; 2];
    let mut row = 0;
    for tick in 0..count {
        if tick > 0 {
            flown.advance();
        }
        let (speed, torque) = (flown.body.wheel_speed, flown.torque);
        let powers = [&without, &with].map(|it| drawn(it, speed.as_slice(), torque.as_slice()));
        if tick > 0 {
            for (energy, power) in energies.iter_mut().flatten().zip(powers.iter().flatten()) {
                *energy -= power * dt;
            }
        }
        if ticks.get(row).is_some_and(|it| it.0 == tick) {
            let sigma = &flown.body.sigma_BN;
            checks[0].add_all(sigma.as_slice(), same_set(sigma, sigmas[row]).as_slice());
            checks[1].add_all(speed.as_slice(), &speeds[row]);
            checks[2].add_all(&powers[0], &theirs[0][row]);
            checks[2].add_all(&powers[1], &theirs[1][row]);
            row += 1;
        }
    }
    checks[3].add_all(&energies[0], &meta.get::<[f64; 3]>("energy_no_regen_J")?);
    checks[3].add_all(&energies[1], &meta.get::<[f64; 3]>("energy_regen_J")?);
    Ok(Comparison { rows: row, checks: checks.into() })
}

#[derive(Deserialize)]
struct Sink {
    watts: f64,
    on: Option<Vec<[f64; 2]>>,
}

#[derive(Deserialize)]
struct WheelMeta {
    base: f64,
    e2m: f64,
    m2e: f64,
}

#[derive(Deserialize)]
struct BatteryMeta {
    capacity_J: f64,
    initial_J: f64,
}

/// Whether a switch with these times, all of them without any, is on.
pub fn is_on(on: &Option<Vec<[f64; 2]>>, time_s: f64) -> bool {
    on.as_ref().is_none_or(|on| on.iter().any(|[from, to]| *from <= time_s && time_s < *to))
}

/// What the loads that are switched on take [W].
fn loads_w(sinks: &[Sink], time_s: f64) -> f64 {
    sinks.iter().filter(|sink| is_on(&sink.on, time_s)).map(|sink| sink.watts).sum()
}

/// Panel, wheels and switched loads on a battery.
pub fn battery(meta: &Input<'_>, data: &Input<'_>) -> Result<Comparison> {
    let mut flown = ClosedLoop::new(meta)?;
    let (sun, array) = (sun(meta)?, meta.get::<Panel>("panel")?.array());
    let wheels: WheelMeta = meta.get("wheels")?;
    let wheels = WheelPower { base_w: wheels.base, motor_efficiency: wheels.e2m, recovery: wheels.m2e };
    let sinks: Vec<Sink> = meta.get("sinks")?;
    let BatteryMeta { capacity_J, initial_J } = meta.get("battery")?;
    let mut battery = Battery::new(capacity_J, initial_J);
    let ticks = data.ticks(flown.model.period)?;
    let (factors, powers, nets, charges): (Vec<f64>, Vec<f64>, Vec<f64>, Vec<f64>) =
        (data.get("illumination")?, data.get("panel_power")?, data.get("net_power")?, data.get("charge")?);
    let speeds: Rows = data.get("rw_speed")?;
    let mut checks = [
        Check::new("wheel rad/s", 1e-8),
        Check::new("factor", 1e-8),
        Check::new("panel W", 1e-6),
        Check::new("net W", 1e-6),
        Check::new("charge J", 1e-5),
        Check::new("ticks full", 0.0),
        Check::new("ticks empty", 0.0),
    ];
    let dt = flown.model.period.seconds();
    let (mut full, mut empty, mut row) = (0.0, 0.0, 0);
    for tick in 0..meta.get::<u64>("ticks")? {
        if tick > 0 {
            flown.advance();
        }
        let r_BN_N = flown.orbit.position(flown.now);
        let factor = sun.illumination(&r_BN_N);
        let panel_w = power_w(&array, &sun, &r_BN_N, &flown.body.sigma_BN, factor);
        let mut flows = (panel_w, 0.0);
        for power in drawn(&wheels, flown.body.wheel_speed.as_slice(), flown.torque.as_slice()) {
            if power > 0.0 { flows.0 += power } else { flows.1 -= power }
        }
        flows.1 += loads_w(&sinks, tick as f64 * dt);
        if tick > 0 {
            battery.flow(flows.0 * dt, flows.1 * dt);
        }
        full += f64::from(u8::from(battery.charge_j() >= battery.capacity_j()));
        empty += f64::from(u8::from(battery.charge_j() <= 0.0));
        if ticks.get(row).is_some_and(|it| it.0 == tick) {
            checks[0].add_all(flown.body.wheel_speed.as_slice(), &speeds[row]);
            checks[1].add(factor, factors[row]);
            checks[2].add(panel_w, powers[row]);
            checks[3].add(flows.0 - flows.1, nets[row]);
            checks[4].add(battery.charge_j(), charges[row]);
            row += 1;
        }
    }
    checks[4].add(battery.charge_j(), meta.number("charge_end_J")?);
    checks[5].add(full, meta.number("ticks_full")?);
    checks[6].add(empty, meta.number("ticks_empty")?);
    Ok(Comparison { rows: row, checks: checks.into() })
}
