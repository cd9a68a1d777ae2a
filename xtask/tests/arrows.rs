//! Keeps arrows pointing one way, as ARCHITECTURE.md draws them: between crates, between the folders of `sim`, and
//! between files, which never import each other in a circle.

#![expect(clippy::unwrap_used, reason = "a test may panic")]

mod imports;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

/// Each crate, and the crates of ours that it may depend on.
const ALLOWED: &[(&str, &[&str])] = &[
    ("swath-sim", &[]),
    ("swath-msgs", &[]),
    ("swath-ros", &["swath-msgs"]),
    ("swath-bags", &["swath-msgs", "swath-ros"]),
    ("swath-training", &["swath-sim"]),
    ("swath-python", &["swath-sim", "swath-mission"]),
    ("swath-gpkg", &[]),
    ("swath-mission", &["swath-sim", "swath-msgs", "swath-gpkg"]),
    ("swath-node", &["swath-sim", "swath-msgs", "swath-ros", "swath-mission"]),
    ("swath-space", &["swath-sim", "swath-msgs", "swath-ros", "swath-mission", "swath-node"]),
    ("swath-ground", &["swath-sim", "swath-msgs", "swath-ros", "swath-bags", "swath-mission", "swath-node"]),
    ("swath-bridge", &["swath-msgs", "swath-ros", "swath-bags", "swath-mission", "swath-node"]),
    ("swath-console", &["swath-sim", "swath-msgs", "swath-ros", "swath-bags", "swath-mission", "swath-node"]),
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
            "swath-console",
            "swath-bridge",
            "swath-training",
        ],
    ),
    ("swath-fuzz", &["swath-sim", "swath-msgs", "swath-ros", "swath-mission", "swath-ground"]),
    ("xtask", &[]),
];

/// Dependencies that would break what a crate promises not to know.
const FORBIDDEN: &[(&str, &[&str])] = &[
    ("swath-sim", &["tch", "torch-sys", "ros2-client", "rustdds", "tracing", "tokio", "mcap"]),
    ("swath-msgs", &["ros2-client", "rustdds"]),
    ("swath-ros", &["tch", "torch-sys", "mcap"]),
    ("swath-bags", &["tch", "torch-sys"]),
    ("swath-training", &["ros2-client", "rustdds", "mcap"]),
    ("swath-python", &["ros2-client", "rustdds", "mcap", "rusqlite", "tch", "torch-sys"]),
    ("swath-mission", &["ros2-client", "rustdds", "mcap", "rusqlite", "tch", "torch-sys"]),
    ("swath-node", &["tch", "torch-sys", "mcap", "rusqlite"]),
    ("swath-space", &["tch", "torch-sys", "mcap", "rusqlite"]),
    ("swath-ground", &["tch", "torch-sys"]),
    ("swath-console", &["tch", "torch-sys", "parquet", "plotters"]),
    ("swath-bridge", &["tch", "torch-sys", "rusqlite"]),
    ("xtask", &["tch", "torch-sys", "ros2-client", "rustdds"]),
];

/// Each room of `sim`, and the rooms that it may know.
const ROOMS: &[(&str, &[&str])] = &[
    ("error", &[]),
    ("rng", &[]),
    ("time", &["error"]),
    ("config", &["error", "time"]),
    ("world", &["config", "error", "time"]),
    ("task", &["time", "world"]),
    ("vehicle", &["config", "error", "rng", "task", "time", "world"]),
    ("requests", &["config", "error", "rng", "time", "vehicle", "world"]),
    ("planner", &["requests", "rng", "task", "time", "vehicle", "world"]),
    ("mission", &["planner", "requests", "task", "time", "vehicle"]),
    ("learn", &["config", "error", "mission", "planner", "requests", "rng", "task", "time", "vehicle", "world"]),
    ("foresight", &["learn", "planner", "requests", "time", "vehicle", "world"]),
];

/// The source folders of all crates.
fn sources() -> Vec<PathBuf> {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    metadata()["packages"]
        .as_array()
        .unwrap()
        .iter()
        .map(|package| Path::new(package["manifest_path"].as_str().unwrap()).with_file_name("src"))
        .inspect(|source| assert!(source.starts_with(root.canonicalize().unwrap()), "{source:?}"))
        .collect()
}

#[test]
fn no_files_import_each_other_in_a_circle() {
    let sources = sources();
    assert!(sources.len() > 8, "{sources:?}");
    let mut circles = Vec::new();
    for source in &sources {
        let arrows = imports::arrows(source);
        for circle in imports::circles(&arrows) {
            let inside = |file: &String| circle.contains(file);
            for from in &circle {
                for (to, names) in arrows[from].iter().filter(|(to, _)| inside(to)) {
                    circles.push(format!("{}: {from} -> {to}: {names:?}", source.display()));
                }
            }
            circles.push(String::new());
        }
    }
    assert!(circles.is_empty(), "files import each other in circles:\n{}", circles.join("\n"));
}

#[test]
fn every_import_names_one_module() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let members = sources().into_iter().filter_map(|source| source.parent().map(Path::to_owned));
    let folders = members.flat_map(|it| ["src", "tests", "examples", "benches", "build"].map(|name| it.join(name)));
    let nested: Vec<_> = folders.chain([root.join("examples")]).flat_map(|it| imports::nested(&it)).collect();
    assert!(nested.is_empty(), "write one `use` a module:\n{}", nested.join("\n"));
}

#[test]
fn rooms_of_sim_know_only_what_the_architecture_allows() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sim/src");
    let room = |file: &str| file.split_once('/').map_or(file.trim_end_matches(".rs"), |(room, _)| room).to_owned();
    let mut found: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for (from, to) in imports::arrows(&source) {
        let known = found.entry(room(&from)).or_default();
        known.extend(to.keys().map(|file| room(file)).filter(|it| *it != room(&from)));
    }
    let allowed: BTreeMap<String, BTreeSet<String>> = ROOMS
        .iter()
        .map(|(name, known)| ((*name).to_owned(), known.iter().map(|it| (*it).to_owned()).collect()))
        .collect();
    for (name, known) in &found {
        let extra: Vec<_> = known.difference(allowed.get(name).unwrap_or(&BTreeSet::new())).cloned().collect();
        assert!(extra.is_empty(), "{name} must not know {extra:?}\n{found:#?}");
    }
}

#[test]
fn the_architecture_reads_in_ten_minutes() {
    let text = include_str!("../../ARCHITECTURE.md");
    // At 270 words a minute.
    let words = text.split_whitespace().count();
    assert!(words <= 2700, "{words} words: what concerns one part stands in that part's README.md");
    let pages: Vec<_> = text.split("](").skip(1).filter_map(|rest| rest.split([')', '#']).next()).collect();
    assert!(pages.len() > 5, "{pages:?}");
    for page in pages.iter().filter(|page| !page.is_empty() && !page.starts_with("http")) {
        assert!(Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(page).is_file(), "{page}");
    }
}

fn metadata() -> Value {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--no-deps", "--format-version", "1"])
        .args(["--manifest-path", concat!(env!("CARGO_MANIFEST_DIR"), "/../Cargo.toml")])
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    serde_json::from_slice(&output.stdout).unwrap()
}

fn dependencies() -> BTreeMap<String, BTreeSet<String>> {
    let metadata = metadata();
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
