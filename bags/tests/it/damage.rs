//! Truncated, bit-flipped and foreign files: errors that name offset and reason, never a panic.

use std::fs;
use std::path::Path;

use swath_bags::ops::recover::recover;
use swath_bags::ops::validate::validate;
use swath_bags::{Bag, BagError, BagOptions, Compression, Filter, ReadOptions};

use crate::common::write_sample;

/// A small bag's only file.
fn sample(dir: &Path, compression: Compression) -> Vec<u8> {
    write_sample(dir, 60, BagOptions { compression, chunk_bytes: 3000, ..BagOptions::default() });
    fs::read(dir.join("sample_0.mcap")).unwrap()
}

/// Opens and reads all; how many messages came before the first error.
fn read(path: &Path) -> (u64, Option<BagError>) {
    let bag = match Bag::open(path) {
        Ok(bag) => bag,
        Err(error) => return (0, Some(error)),
    };
    let mut messages = bag.messages(&Filter::default()).unwrap();
    let mut n = 0;
    loop {
        match messages.next() {
            Ok(Some(_)) => n += 1,
            Ok(None) => return (n, None),
            Err(error) => return (n, Some(error)),
        }
    }
}

#[test]
fn a_file_cut_off_anywhere_is_an_error_and_recovers_what_was_whole() {
    let temp = tempfile::tempdir().unwrap();
    let bytes = sample(&temp.path().join("sample"), Compression::Zstd);
    let cut = temp.path().join("cut.mcap");
    let mut saved_before = 0;
    for len in (0..bytes.len()).step_by(211).chain(bytes.len() - 40..bytes.len()) {
        fs::write(&cut, &bytes[..len]).unwrap();
        let (n, error) = read(&cut);
        assert_eq!(n, 0);
        let Some(BagError::Corrupt { offset, reason, .. }) = error else { panic!("cut at {len}: {error:?}") };
        assert!(offset <= len as u64 && !reason.is_empty());
        let to = temp.path().join(format!("saved {len}"));
        let saved = recover(&cut, &to, BagOptions::default(), ReadOptions::default()).unwrap();
        assert!(saved.summary.messages >= saved_before, "cut at {len}");
        saved_before = saved.summary.messages;
        assert_eq!(validate(&to, None, ReadOptions::default()).unwrap().faults, [""; 0], "cut at {len}");
    }
    assert_eq!(saved_before, 121, "only the index was cut off");
}

#[test]
fn a_flipped_bit_never_panics_and_never_passes_for_a_message() {
    let temp = tempfile::tempdir().unwrap();
    let flipped = temp.path().join("flipped.mcap");
    for compression in [Compression::None, Compression::Lz4, Compression::Zstd] {
        let dir = temp.path().join(format!("{compression:?}")).join("sample");
        let mut bytes = sample(&dir, compression);
        for at in (0..bytes.len()).step_by(31) {
            let bit = 1 << (at % 8);
            bytes[at] ^= bit;
            fs::write(&flipped, &bytes).unwrap();
            let (n, error) = read(&flipped);
            assert!(n <= 121);
            if let Some(error) = error {
                assert!(matches!(error, BagError::Corrupt { .. }), "byte {at}: {error:?}");
            }
            let faults = validate(&flipped, None, ReadOptions::default()).unwrap().faults;
            assert!(!faults.is_empty(), "{compression:?}: bit flip in byte {at} goes unnoticed");
            bytes[at] ^= bit;
        }
    }
}

#[test]
fn recovery_leaves_out_a_damaged_chunk_only() {
    let temp = tempfile::tempdir().unwrap();
    let mut bytes = sample(&temp.path().join("sample"), Compression::None);
    let needle = 6.9e6f64.to_le_bytes();
    let at = bytes.windows(8).position(|w| w == needle).unwrap();
    bytes[at] ^= 1;
    let damaged = temp.path().join("damaged.mcap");
    fs::write(&damaged, &bytes).unwrap();
    let to = temp.path().join("saved");
    let recovery = recover(&damaged, &to, BagOptions::default(), ReadOptions::default()).unwrap();
    assert_eq!(recovery.faults.len(), 1);
    assert!(recovery.faults[0].contains("chunk checksum"), "{}", recovery.faults[0]);
    assert!((80..121).contains(&recovery.summary.messages), "{}", recovery.summary.messages);
}

#[test]
fn foreign_files_are_refused() {
    let temp = tempfile::tempdir().unwrap();
    let dir = temp.path().join("dir");
    fs::create_dir(&dir).unwrap();
    assert!(matches!(Bag::open(&dir), Err(BagError::NotABag { .. })));
    assert!(matches!(Bag::open(&dir.join("missing")), Err(BagError::Io { .. })));
    for (name, content) in [("empty.mcap", &b""[..]), ("sqlite.db3", b"SQLite format 3\0"), ("text", b"hello")] {
        let file = temp.path().join(name);
        fs::write(&file, content).unwrap();
        let error = Bag::open(&file).unwrap_err().to_string();
        assert!(error.ends_with("offset 0: no MCAP file: it does not start with MCAP's magic"), "{error}");
    }
}
