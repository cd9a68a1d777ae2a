//! Writes a bag of a given size, to try what a big one costs: `big_bag DIRECTORY GIGABYTES [zstd|lz4|none]`.
#![allow(clippy::unwrap_used, reason = "an example that cannot go on should panic")]

use std::env;
use std::path::Path;
use std::time::Instant;

use swath_bags::qos::QosProfile;
use swath_bags::{BagOptions, BagWriter, Compression, Topic};
use swath_msgs::Interface;
use swath_msgs::swath_msgs::SpacecraftState;

fn main() {
    let args: Vec<String> = env::args().skip(1).collect();
    let [dir, gigabytes, rest @ ..] = &args[..] else {
        eprintln!("usage: big_bag DIRECTORY GIGABYTES [zstd|lz4|none]");
        std::process::exit(2);
    };
    let bytes = (gigabytes.parse::<f64>().unwrap() * 1e9) as u64;
    let compression = rest.first().map_or(Ok(Compression::None), |c| c.parse()).unwrap();
    let options = BagOptions { compression, ..BagOptions::default() };
    let bag = BagWriter::create(Path::new(dir), options).unwrap();
    let known = Interface::of::<SpacecraftState>();
    let qos = vec![QosProfile::reliable(10)];
    let topic = Topic::new("/swath/state", known.type_name, known.schema, known.type_hash, qos);
    let topic = bag.add_topic(&topic.unwrap()).unwrap();
    let start = Instant::now();
    // Header with an empty frame (its length is 1), tick, and 18 numbers.
    let mut message = vec![0, 1, 0, 0];
    message.resize(4 + 16 + 8 + 18 * 8, 0);
    message[12] = 1;
    let (mut written, mut tick) = (0, 0u64);
    while written < bytes {
        let time = tick * 500_000;
        message[4..8].copy_from_slice(&((time / 1_000_000_000) as u32).to_le_bytes());
        message[8..12].copy_from_slice(&((time % 1_000_000_000) as u32).to_le_bytes());
        for (n, number) in message[28..].chunks_exact_mut(8).enumerate() {
            let value = (tick as f64 * 1e-3 + n as f64).sin();
            number.copy_from_slice(&value.to_le_bytes());
        }
        bag.write(topic, time, time, &message).unwrap();
        written += message.len() as u64;
        tick += 1;
    }
    let summary = bag.close().unwrap();
    eprintln!("{} messages, {:.1} s", summary.messages, start.elapsed().as_secs_f64());
}
