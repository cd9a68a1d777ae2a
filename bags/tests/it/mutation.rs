//! Damaged bags of every kind: no panic, no message out of thin air, whatever the bytes are.

use std::path::Path;

use crate::common::mutate::{mutated, read, samples, save};

/// Bags that are read, and those of them that are also recovered and filtered.
const READ: u64 = 60_000;
const SAVED: u64 = 1_000;

fn data() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data")
}

#[test]
fn damaged_bags_are_read_or_refused() {
    let samples = samples(&data());
    assert!(samples.iter().all(|sample| read(sample.clone())), "undamaged samples are read");
    let opened = (0..READ).filter(|seed| read(mutated(&samples, *seed))).count();
    // Enough are opened for everything behind the opening to be tried, and enough refused.
    assert!(opened > READ as usize / 10 && opened < READ as usize * 9 / 10, "{opened} opened");
}

#[test]
fn damaged_bags_are_recovered_into_whole_ones() {
    let samples = samples(&data());
    let temp = tempfile::tempdir().unwrap();
    for seed in 0..SAVED {
        save(&mutated(&samples, seed), temp.path());
    }
}
