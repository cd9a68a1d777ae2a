//! Times the radio's protocol: ten thousand orders that wait, and the passes that carry them. Prints one JSON object.
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
use swath_sim::time::Tick;

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

fn main() -> Result<()> {
    let mut runs = (0..21).map(|_| pass_ms()).collect::<Result<Vec<f64>>>()?;
    runs.sort_by(f64::total_cmp);
    println!("{}", json!({ "link_pass_10000_orders_ms": runs[runs.len() / 2] }));
    Ok(())
}

/// Both ends through a pass, with all orders queued before it [ms].
fn pass_ms() -> Result<f64> {
    let mut ground = End::new(Rates::new(UP, DOWN, 1, 120));
    let mut space = End::new(Rates::new(DOWN, UP, 1, 120));
    for order in 0..ORDERS {
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
    ensure!(ground.arrived(1) == ORDERS as u64, "the pass does not carry them all");
    Ok(passed)
}
