//! All test bags of rosbag2, from a clone of its repository.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

use serde_json::Value;
use swath_bags::ops::copy::filter;
use swath_bags::ops::validate::validate;
use swath_bags::{Bag, BagOptions, Filter, ReadOptions};

use crate::common::python;

/// Files of a kind below a folder.
fn files(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path, extension));
        } else if path.extension().is_some_and(|e| e == extension) {
            found.push(path);
        }
    }
    found.sort();
    found
}

fn compare(original: &Path, made: &Path) -> Value {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python/compare_bags.py");
    let output = Command::new(python()).arg(script).args([original, made]).output().unwrap();
    assert!(output.status.success(), "{}: {}", original.display(), String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
#[ignore = "needs a clone of ros2/rosbag2: SWATH_ROSBAG2=DIR cargo test --release -p swath-bags --test it rosbag2 -- --ignored --nocapture"]
fn every_test_bag_of_rosbag2_is_read_filtered_and_read_again_by_others() {
    let clone = PathBuf::from(env::var_os("SWATH_ROSBAG2").expect("SWATH_ROSBAG2 names the clone"));
    let temp = tempfile::tempdir().unwrap();
    let bags = files(&clone, "mcap");
    assert_eq!(bags.len(), 20);
    for (n, path) in bags.iter().enumerate() {
        let bag = Bag::open(path).unwrap();
        let report = validate(path, None, ReadOptions::default()).unwrap();
        let made = temp.path().join(format!("bag{n}"));
        let copied = filter(&bag, &Filter::default(), &made, BagOptions::default()).unwrap();
        assert_eq!((copied.summary.messages, copied.faults), (bag.message_count(), vec![]), "{}", path.display());
        let facts = compare(path, &made);
        println!("{} messages, {} faults: {}", facts["messages"], report.faults.len(), path.display());
        assert_eq!(facts["messages"], bag.message_count(), "{}", path.display());
        assert_eq!(facts["mcap"], true, "{}", path.display());
        // One bag is there to be refused.
        let expected = match path.ends_with("wrong_rmw_test_0.mcap") {
            true => "Serialization format {'wrong_format'} is not supported.".into(),
            false => Value::from(true),
        };
        assert_eq!(facts["rosbags"], expected, "{}", path.display());
        // What is no ROS 2 as we know it is named; nothing is damaged.
        let named =
            |fault: &String| fault.contains("message encoding") || fault.contains("is not of the form pkg/msg/Type");
        assert!(report.faults.iter().all(named), "{}: {:?}", path.display(), report.faults);
    }
    for (n, path) in files(&clone, "db3").into_iter().enumerate() {
        let bag = Bag::open(&path).unwrap();
        let made = temp.path().join(format!("db3_{n}"));
        let copied = filter(&bag, &Filter::default(), &made, BagOptions::default()).unwrap();
        assert_eq!((copied.summary.messages, copied.faults), (bag.message_count(), vec![]), "{}", path.display());
        println!("{} messages: {}", bag.message_count(), path.display());
    }
}
