//! MCAP's public conformance suite: 416 files, each told, printed, filtered and recovered as it is, and read alike by
//! the reader of the `mcap` crate.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;
use sha2::{Digest, Sha256};
use swath_bags::ops::cat::cat;
use swath_bags::ops::copy::filter;
use swath_bags::ops::info::info;
use swath_bags::ops::recover::recover;
use swath_bags::{Bag, BagOptions, Compression, Filter, ReadOptions};

use crate::common::conformance::{File, files};
use crate::common::contents::{defined, found};

/// Chunks that the `mcap` crate reads without its features.
fn plain() -> BagOptions {
    BagOptions { compression: Compression::None, ..BagOptions::default() }
}

#[test]
fn the_files_are_those_of_the_suite() {
    let digests = include_str!("../data/conformance.sha256").lines();
    let digests: BTreeMap<&str, &str> =
        digests.map(|l| l.split_once("  ").map(|(hash, name)| (name, hash)).unwrap()).collect();
    let files = files();
    assert_eq!((files.len(), digests.len()), (416, 416));
    for File { name, bytes, .. } in files {
        let digest: String = Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect();
        assert_eq!(digests[name.as_str()], digest, "{name}");
    }
}

#[test]
fn the_reader_of_the_mcap_crate_agrees() {
    for File { name, content, bytes } in files() {
        assert_eq!(found(&bytes), defined(&content), "{name}");
    }
}

#[test]
fn info_and_cat_tell_what_each_file_holds() {
    for File { name, content, bytes } in files() {
        let bag = Bag::from_bytes(bytes, ReadOptions::default()).unwrap();
        let defined = defined(&content);
        let times: Vec<u64> = defined.messages.iter().map(|message| message.1).collect();
        let told = info(&bag);
        let topics: Vec<_> = told.topics.iter().map(|topic| (topic.name.as_str(), topic.messages)).collect();
        let expected: Vec<_> =
            defined.channels.iter().map(|channel| (channel.0.as_str(), times.len() as u64)).collect();
        assert_eq!(topics, expected, "{name}");
        assert_eq!((told.start_ns, told.end_ns), (times.first().copied(), times.last().copied()), "{name}");
        assert_eq!((told.messages, told.lost), (times.len() as u64, 0), "{name}");
        assert_eq!(told.attachments.len(), defined.attachments.len(), "{name}");
        assert_eq!(told.metadata, defined.metadata.iter().cloned().collect(), "{name}");

        let (mut out, mut faults) = (Vec::new(), Vec::new());
        cat(&bag, &Filter::default(), None, &mut out, &mut faults).unwrap();
        let lines = out.split(|byte| *byte == b'\n').filter(|line| !line.is_empty());
        let lines: Vec<Value> = lines.map(|line| serde_json::from_slice(line).unwrap()).collect();
        let printed: Vec<_> = lines
            .iter()
            .map(|line| (line["log_time_ns"].as_u64().unwrap(), line["sequence"].as_u64().unwrap()))
            .collect();
        let expected: Vec<_> = defined.messages.iter().map(|message| (message.1, u64::from(message.3))).collect();
        assert_eq!((printed, faults), (expected, vec![]), "{name}");
    }
}

/// The only file of a new bag.
fn only_file(dir: &Path) -> PathBuf {
    dir.join(format!("{}_0.mcap", dir.file_name().unwrap().to_str().unwrap()))
}

#[test]
fn filter_and_recover_keep_everything_byte_for_byte() {
    let temp = tempfile::tempdir().unwrap();
    for File { name, content, bytes } in files() {
        let path = temp.path().join(&name);
        let (filtered, recovered) = (path.with_extension("filtered"), path.with_extension("recovered"));
        fs::write(&path, &bytes).unwrap();
        let copied = filter(&Bag::open(&path).unwrap(), &Filter::default(), &filtered, plain()).unwrap();
        assert_eq!(copied.faults, [""; 0], "{name}");
        let recovery = recover(&path, &recovered, plain(), ReadOptions::default()).unwrap();
        assert_eq!(recovery.faults, [""; 0], "{name}");
        for new in [filtered, recovered] {
            assert_eq!(found(&fs::read(only_file(&new)).unwrap()), defined(&content), "{name}, {}", new.display());
        }
    }
}
