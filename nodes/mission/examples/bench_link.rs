//! Times the radio: ten thousand orders that wait and the pass that carries them, the passes of a station through a day,
//! and the share of a pass that carries orders. Prints one JSON object.
//!
//! ```sh
//! cargo run --release -p swath-mission --example bench_link
//! ```
#![allow(clippy::print_stdout, reason = "a measuring tool")]

use std::time::Instant;

use anyhow::{Result, ensure};
use serde_json::json;
use swath_mission::link::end::{End, Rates};
use swath_mission::link::frame::Item;
use swath_sim::config::SimConfig;
use swath_sim::config::station::Station;
use swath_sim::time::Tick;
use swath_sim::vehicle::model::Model;
use swath_sim::world::contacts::contacts_of;
use swath_sim::world::orbit::{Orbit, OrbitPhase};

/// Orders that wait.
const ORDERS: usize = 10_000;
/// Size of an order [bytes].
const ORDER_BYTES: usize = 110;
/// Length of a pass [ticks].
const PASS: u64 = 800;
/// Bits that go up in a tick: 64 kbit/s at 2 Hz.
const UP: u64 = 32_000;
/// Bits that come down in a tick: 50 Mbit/s.
const DOWN: u64 = 25_000_000;

/// A day [ticks].
const DAY: u64 = 172_800;

fn main() -> Result<()> {
    let pass = median((0..21).map(|_| Ok(carry(ORDERS)?.1)).collect::<Result<Vec<f64>>>()?);
    let model = Model::new(SimConfig::default())?;
    let contacts = median((0..201_u32).map(|run| day_ms(&model, f64::from(run))).collect::<Result<Vec<f64>>>()?);
    println!(
        "{}",
        json!({
            "link_pass_10000_orders_ms": pass,
            "link_contacts_24h_ms": contacts,
            "link_pass_share_used": share_used()?,
        })
    );
    Ok(())
}

fn median(mut runs: Vec<f64>) -> f64 {
    runs.sort_by(f64::total_cmp);
    runs[runs.len() / 2]
}

/// One station's passes of a day, on an orbit of its own [ms].
fn day_ms(model: &Model, argument_of_latitude_deg: f64) -> Result<f64> {
    let station = Station::named("puertollano")?;
    let orbit = Orbit::new(&model.config, OrbitPhase { raan_deg: 10.0, argument_of_latitude_deg }, model.period);
    let started = Instant::now();
    let contacts = contacts_of(&station, 0, &model.config, &orbit, model.period, (Tick(0), Tick(DAY)));
    let passed = started.elapsed().as_secs_f64() * 1e3;
    ensure!(contacts.len() >= 4, "a day has some passes");
    Ok(passed)
}

/// Share of what a pass could carry up that is orders, where more wait than fit: 1 for nothing but their bytes.
fn share_used() -> Result<f64> {
    let room = (PASS * UP) as f64;
    let waiting = (room / (ORDER_BYTES * 8) as f64) as usize + 1000;
    let carried = carry(waiting)?.0;
    ensure!((carried as usize) < waiting, "the pass carries all");
    Ok((carried as usize * ORDER_BYTES * 8) as f64 / room)
}

/// Both ends through a pass, with orders queued before it: how many the ground knows to have arrived, and the time that it
/// takes here [ms].
fn carry(orders: usize) -> Result<(u64, f64)> {
    let mut ground = End::new(Rates::new(UP, DOWN, 1, 120));
    let mut space = End::new(Rates::new(DOWN, UP, 1, 120));
    for order in 0..orders {
        ground.push(1, Item { bytes: vec![order as u8; ORDER_BYTES], data_bits: 0 });
    }
    let started = Instant::now();
    let (mut up, mut down): (Vec<Vec<u8>>, Vec<Vec<u8>>) = (Vec::new(), Vec::new());
    for tick in (0..PASS).map(Tick) {
        for bytes in std::mem::take(&mut up) {
            space.hear(tick, &bytes)?;
        }
        for bytes in std::mem::take(&mut down) {
            ground.hear(tick, &bytes)?;
        }
        up.extend(ground.transmit(tick).into_iter().map(|sent| sent.bytes));
        down.extend(space.transmit(tick).into_iter().map(|sent| sent.bytes));
    }
    let passed = started.elapsed().as_secs_f64() * 1e3;
    let arrived = ground.arrived(1);
    ensure!(arrived >= (orders as u64).min(ORDERS as u64), "the pass carries only {arrived}");
    Ok((arrived, passed))
}
