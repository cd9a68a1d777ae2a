//! Keeps the crates' dependencies pointing one way, as ARCHITECTURE.md draws them.

#![expect(clippy::unwrap_used, reason = "a test may panic")]

use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;

use serde_json::Value;

/// Each crate, and the crates of ours that it may depend on.
const ALLOWED: &[(&str, &[&str])] = &[
    ("swath-sim", &[]),
    ("swath-msgs", &[]),
    ("swath-ros", &["swath-msgs"]),
    ("swath-bags", &["swath-msgs", "swath-ros"]),
    ("swath-training", &["swath-sim"]),
    ("swath-mission", &["swath-sim", "swath-msgs"]),
    ("swath-node", &["swath-sim", "swath-msgs", "swath-ros", "swath-mission"]),
    ("swath-space", &["swath-sim", "swath-msgs", "swath-ros", "swath-mission", "swath-node"]),
    ("swath-ground", &["swath-sim", "swath-msgs", "swath-ros", "swath-bags", "swath-mission", "swath-node"]),
    (
        "swath-nodes",
        &[
            "swath-sim",
            "swath-msgs",
            "swath-ros",
            "swath-bags",
            "swath-mission",
            "swath-node",
            "swath-space",
            "swath-ground",
            "swath-training",
        ],
    ),
    ("xtask", &[]),
];

/// Dependencies that would break what a crate promises not to know.
const FORBIDDEN: &[(&str, &[&str])] = &[
    ("swath-sim", &["tch", "torch-sys", "ros2-client", "rustdds", "tracing", "tokio", "mcap"]),
    ("swath-msgs", &["ros2-client", "rustdds"]),
    ("swath-ros", &["tch", "torch-sys", "mcap"]),
    ("swath-bags", &["tch", "torch-sys"]),
    ("swath-training", &["ros2-client", "rustdds", "mcap"]),
    ("swath-mission", &["ros2-client", "rustdds", "mcap", "rusqlite", "tch", "torch-sys"]),
    ("swath-node", &["tch", "torch-sys", "mcap", "rusqlite"]),
    ("swath-space", &["tch", "torch-sys", "mcap", "rusqlite"]),
    ("swath-ground", &["tch", "torch-sys"]),
    ("xtask", &["tch", "torch-sys", "ros2-client", "rustdds"]),
];

fn dependencies() -> BTreeMap<String, BTreeSet<String>> {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--no-deps", "--format-version", "1"])
        .args(["--manifest-path", concat!(env!("CARGO_MANIFEST_DIR"), "/../Cargo.toml")])
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    let metadata: Value = serde_json::from_slice(&output.stdout).unwrap();
    let text = |value: &Value| value.as_str().unwrap().to_owned();
    metadata["packages"]
        .as_array()
        .unwrap()
        .iter()
        .map(|package| {
            let dependencies = package["dependencies"].as_array().unwrap();
            let names = dependencies.iter().map(|it| text(&it["name"])).collect();
            (text(&package["name"]), names)
        })
        .collect()
}

#[test]
fn crates_know_only_what_the_architecture_allows() {
    let found = dependencies();
    let ours: BTreeSet<&str> = found.keys().map(String::as_str).collect();
    let listed: BTreeSet<&str> = ALLOWED.iter().map(|(name, _)| *name).collect();
    assert_eq!(ours, listed, "a crate is missing here or in the workspace");
    for (name, allowed) in ALLOWED {
        let known = found[*name].iter().map(String::as_str);
        let known: BTreeSet<&str> = known.filter(|it| ours.contains(it) && it != name).collect();
        let allowed = allowed.iter().copied().collect();
        let extra: Vec<_> = known.difference(&allowed).collect();
        assert!(extra.is_empty(), "{name} must not know {extra:?}");
    }
}

#[test]
fn crates_do_not_depend_on_what_they_must_not_know() {
    let found = dependencies();
    for (name, forbidden) in FORBIDDEN {
        let extra: Vec<_> = forbidden.iter().filter(|it| found[*name].contains(**it)).collect();
        assert!(extra.is_empty(), "{name} must not know {extra:?}");
    }
}
