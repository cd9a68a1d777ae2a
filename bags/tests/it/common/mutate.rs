//! Damaged bags: each a sample with a few changes that follow from a seed.
#![allow(dead_code, reason = "each user uses some of these")]
#![allow(clippy::unwrap_used, reason = "a test that cannot go on should panic")]

use std::fs;
use std::io::sink;
use std::path::Path;

use mcap::records::op;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use swath_bags::ops::cat::cat;
use swath_bags::ops::copy::filter;
use swath_bags::ops::info::info;
use swath_bags::ops::recover::recover;
use swath_bags::ops::validate::validate_open;
use swath_bags::{Bag, BagOptions, Filter, ReadOptions};

/// Values that lengths, counts and times go wrong at.
const EDGES: [u64; 14] = [
    0,
    1,
    7,
    8,
    9,
    0x7f,
    0xff,
    0xffff,
    0x7fff_ffff,
    0xffff_ffff,
    0x1_0000_0000,
    0x7fff_ffff_ffff_ffff,
    0xffff_ffff_ffff_fff0,
    u64::MAX,
];

/// Sets the checksums of chunks, data section and summary to zero, which means unchecked, so that changed bytes reach
/// the parsers.
pub fn clear_checksums(bytes: &mut [u8]) {
    let mut at = 8;
    while at + 9 <= bytes.len().saturating_sub(8) {
        let len = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()) as usize;
        let checksum = match bytes[at] {
            op::CHUNK => Some(at + 9 + 24),
            op::DATA_END => Some(at + 9),
            op::FOOTER => Some(at + 9 + 16),
            _ => None,
        };
        if let Some(checksum) = checksum {
            bytes[checksum..checksum + 4].fill(0);
        }
        at += 9 + len;
    }
}

/// The samples: files of the conformance suite, bags of others, and each with its checksums cleared.
pub fn samples(data: &Path) -> Vec<Vec<u8>> {
    let suite = super::conformance::files().into_iter().step_by(13).map(|file| file.bytes);
    let mut paths: Vec<_> = fs::read_dir(data).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "mcap"));
    paths.retain(|path| fs::metadata(path).unwrap().len() < 6000);
    paths.extend(
        ["fuzz/seeds/read_bag/zstd.mcap", "fuzz/seeds/read_bag/lz4.mcap"].map(|path| data.join("../..").join(path)),
    );
    paths.sort();
    let whole: Vec<Vec<u8>> = suite.chain(paths.iter().map(|path| fs::read(path).unwrap())).collect();
    let cleared = whole.clone().into_iter().map(|mut bytes| {
        clear_checksums(&mut bytes);
        bytes
    });
    cleared.chain(whole.iter().step_by(9).cloned()).collect()
}

/// The damaged bag of a seed.
pub fn mutated(samples: &[Vec<u8>], seed: u64) -> Vec<u8> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut bytes = samples[random.random_range(0..samples.len())].clone();
    for _ in 0..random.random_range(1..=4) {
        if bytes.is_empty() {
            break;
        }
        change(&mut bytes, samples, &mut random);
    }
    bytes
}

fn change(bytes: &mut Vec<u8>, samples: &[Vec<u8>], random: &mut impl Rng) {
    let at = random.random_range(0..bytes.len());
    let span = at..(at + random.random_range(1..=40)).min(bytes.len());
    match random.random_range(0..32) {
        0..8 => bytes[at] ^= 1 << random.random_range(0..8),
        8..16 => bytes[at] = random.random(),
        16 => bytes.truncate(at),
        17 => {
            bytes.drain(span);
        }
        18 => {
            let again = bytes[span].to_vec();
            bytes.splice(at..at, again);
        }
        19 => {
            let other = &samples[random.random_range(0..samples.len())];
            let from = random.random_range(0..other.len());
            let piece = other[from..(from + random.random_range(1..=200)).min(other.len())].to_vec();
            bytes.splice(span, piece);
        }
        // Numbers of every size.
        _ => {
            let value =
                EDGES[random.random_range(0..EDGES.len())].wrapping_add(random.random_range(0..3)).to_le_bytes();
            let size = [1, 2, 4, 8][random.random_range(0..4)].min(bytes.len() - at);
            bytes[at..at + size].copy_from_slice(&value[..size]);
        }
    }
}

/// Reads all of a bag in every way; says whether it could be opened.
pub fn read(bytes: Vec<u8>) -> bool {
    let Ok(bag) = Bag::from_bytes(bytes, ReadOptions::default()) else { return false };
    let _ = info(&bag).to_string();
    let _ = cat(&bag, &Filter::default(), Some(10_000), &mut sink(), &mut Vec::new());
    let _ = validate_open(&bag, Some(1));
    true
}

/// Recovers and filters a bag, which takes files, in a folder of its own.
pub fn save(bytes: &[u8], folder: &Path) {
    let path = folder.join("bag.mcap");
    fs::write(&path, bytes).unwrap();
    let (saved, filtered) = (folder.join("saved"), folder.join("filtered"));
    if recover(&path, &saved, BagOptions::default(), ReadOptions::default()).is_ok() {
        // Whatever was saved is whole.
        let report = swath_bags::ops::validate::validate(&saved, None, ReadOptions::default()).unwrap();
        let damage = |fault: &&String| fault.contains("offset");
        assert_eq!(report.faults.iter().find(damage), None);
    }
    if let Ok(bag) = Bag::open(&path) {
        let _ = filter(&bag, &Filter::default(), &filtered, BagOptions::default());
    }
    for made in [saved, filtered] {
        if made.exists() {
            fs::remove_dir_all(made).unwrap();
        }
    }
}
