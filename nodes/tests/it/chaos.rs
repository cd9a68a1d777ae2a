//! Missions whose faults are drawn from seeds: what must hold whatever fails, in one process and over DDS.

use std::path::Path;
use std::process::Command;

use crate::common;

fn figures(example: &str, words: [&str; 2]) -> serde_json::Value {
    let path = Path::new(env!("CARGO_BIN_EXE_swath")).with_file_name("examples").join(example);
    assert!(path.is_file(), "{} is missing: run `cargo build --release --workspace --examples`", path.display());
    let said = common::succeed(Command::new(path).args(words).env("ROS_DOMAIN_ID", common::domain()));
    serde_json::from_str(&said).unwrap()
}

#[test]
fn twenty_missions_in_one_process_hold_whatever_fails() {
    let figures = figures("chaos", ["0", "20"]);
    assert_eq!((&figures["missions"], figures["failed"].as_array().unwrap().len()), (&20.into(), 0));
    assert!(figures["faults"].as_u64() > Some(40) && figures["alarm_lines"].as_u64() > Some(80), "{figures}");
}

#[test]
fn missions_over_dds_hold_whatever_fails() {
    let figures = figures("chaos_over_dds", ["0", "2"]);
    assert_eq!((&figures["missions"], figures["failed"].as_array().unwrap().len()), (&2.into(), 0));
    assert!(figures["acknowledged"].as_u64() > Some(0), "{figures}");
}
