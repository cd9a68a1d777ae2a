//! Readers that others wrote accept our bags: PyPI `rosbags`, `mcap` and `mcap-ros2-support`.

use serde_json::Value;
use swath_bags::{BagOptions, Compression};

use crate::common::{TICK, run_python, write_sample};

const TICKS: u64 = 300;

/// Both scripts' facts against what was written.
fn check(facts: &Value) {
    let topics = &facts["topics"];
    assert_eq!(topics["/clock"]["type"], "rosgraph_msgs/msg/Clock");
    assert_eq!(topics["/clock"]["count"], TICKS);
    assert_eq!(topics["/swath/state"]["type"], "swath_msgs/msg/SpacecraftState");
    assert_eq!(topics["/swath/state"]["count"], TICKS);
    assert_eq!(topics["/swath/strips/upcoming"]["count"], 1);
    assert_eq!(topics["/diagnostics"]["count"], 0);
    let times: Vec<u64> = serde_json::from_value(facts["times"].clone()).unwrap();
    assert_eq!(times.len() as u64, 2 * TICKS + 1);
    assert!(times.is_sorted());
    let states: Vec<(u64, f64, f64)> = serde_json::from_value(facts["states"].clone()).unwrap();
    for (tick, (found, sigma_3, x)) in (0..TICKS).zip(states) {
        assert_eq!((found, sigma_3, x), (tick, tick as f64 / 1024.0, 6.9e6 + tick as f64));
    }
}

fn check_both(options: BagOptions) {
    let temp = tempfile::tempdir().unwrap();
    let dir = temp.path().join("sample");
    write_sample(&dir, TICKS, options);

    let rosbags: Value = serde_json::from_str(&run_python("read_rosbags.py", &dir)).unwrap();
    check(&rosbags);
    assert_eq!(rosbags["topics"]["/swath/strips/upcoming"]["durability"], "TRANSIENT_LOCAL");
    assert_eq!(rosbags["topics"]["/swath/state"]["depth"], 10);
    assert_eq!(rosbags["message_count"], 2 * TICKS + 1);
    assert_eq!(rosbags["start"], 0);
    assert_eq!(rosbags["duration"], (TICKS - 1) * TICK + 1, "rosbags counts one past the end");

    let mcap: Value = serde_json::from_str(&run_python("read_mcap.py", &dir)).unwrap();
    check(&mcap);
    assert_eq!(mcap["metadata"]["swath_manifest"]["planner"], "fixed");
    assert_eq!(mcap["metadata"]["swath_recording"]["lost_messages"], "0");
    assert!(mcap["topics"]["/clock"]["hash"].as_str().unwrap().starts_with("RIHS01_"));
}

#[test]
fn zstd() {
    check_both(BagOptions { chunk_bytes: 8 << 10, ..BagOptions::default() });
}

#[test]
fn lz4() {
    let compression = Compression::Lz4;
    check_both(BagOptions { compression, chunk_bytes: 8 << 10, ..BagOptions::default() });
}

#[test]
fn uncompressed_and_split() {
    let compression = Compression::None;
    let max_file_bytes = Some(30 << 10);
    check_both(BagOptions { compression, max_file_bytes, chunk_bytes: 8 << 10, ..BagOptions::default() });
}
