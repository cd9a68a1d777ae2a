//! Everything that reads a bag, on any bytes: `cargo +nightly fuzz run read_bag -- -max_total_time=600`
#![no_main]

use std::fs;
use std::path::PathBuf;
use std::sync::OnceLock;

use libfuzzer_sys::fuzz_target;
use swath_bags::{Bag, BagOptions, Filter, ReadOptions};
use swath_bags::ops::cat::cat;
use swath_bags::ops::info::info;
use swath_bags::ops::recover::recover;
use swath_bags::ops::validate::validate;

/// A folder in memory: the reader takes files.
fn folder() -> &'static PathBuf {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let folder = PathBuf::from(format!("/dev/shm/swath-fuzz-{}", std::process::id()));
        fs::create_dir_all(&folder).expect("no folder in memory");
        folder
    })
}

fuzz_target!(|data: &[u8]| {
    let path = folder().join("bag.mcap");
    fs::write(&path, data).expect("no room in memory");
    let _ = validate(&path, None, ReadOptions::default());
    if let Ok(bag) = Bag::open(&path) {
        let _ = info(&bag).to_string();
        let _ = cat(&bag, &Filter::default(), Some(1000), &mut std::io::sink(), &mut Vec::new());
    }
    let saved = folder().join("saved");
    let _ = recover(&path, &saved, BagOptions::default(), ReadOptions::default());
    let _ = fs::remove_dir_all(&saved);
});
