//! The page in a browser, on the sample mission: at every time it shows what the facts say, and it asks nobody else.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;
use swath_mission::requests::lifecycle::State;

use super::server::{log, replay};

/// How many strips the facts say are in each state at a time.
fn states_at(facts: &[Value], time_ms: f64) -> BTreeMap<String, u64> {
    let mut states = BTreeMap::new();
    for fact in facts.iter().filter(|fact| fact["kind"] == "change" && fact["t"].as_f64().unwrap() <= time_ms) {
        states.insert(fact["strip"].as_u64().unwrap(), fact["state"].as_u64().unwrap());
    }
    let mut counts = BTreeMap::new();
    for state in states.into_values() {
        let name = State::from_number(u8::try_from(state).unwrap()).unwrap().name();
        *counts.entry(name.to_owned()).or_insert(0) += 1;
    }
    counts
}

#[test]
fn the_page_shows_what_the_facts_say() {
    let python = std::env::var("SWATH_PYTHON").expect("SWATH_PYTHON names the tests' Python; cargo xtask test sets it");
    let folder = match std::env::var_os("SWATH_PICTURES") {
        Some(folder) => PathBuf::from(folder),
        None => Path::new(env!("CARGO_TARGET_TMPDIR")).to_owned(),
    };
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/it/page.py");
    let url = format!("http://{}/", replay());
    let output = Command::new(python).arg(script).arg(url).arg(&folder).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let saw: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&saw["elsewhere"], &saw["errors"]), (&serde_json::json!([]), &serde_json::json!([])));
    assert_eq!(saw["title"], "Swath one orbit");
    assert!(saw["gzipped"].as_u64().unwrap() < 200_000, "{}", saw["gzipped"]);
    // No way to submit in a recording.
    assert_eq!(saw["tabs"], serde_json::json!(["requests", "planner", "alarms"]));
    let facts = log();
    let shown = saw["states"].as_array().unwrap();
    assert_eq!(shown.len(), 4);
    for pair in shown {
        let counts: BTreeMap<String, u64> = serde_json::from_value(pair[1].clone()).unwrap();
        assert_eq!(counts, states_at(&facts, pair[0].as_f64().unwrap()), "at {}", pair[0]);
    }
    assert_eq!(saw["completed"], shown[0][1]["completed"]);
    // By keyboard: one strip is selected, and its history is told.
    assert_eq!((&saw["selected"], &saw["followed"]), (&serde_json::json!(1), &serde_json::json!(true)));
    assert!(saw["drawer"].as_u64().unwrap() >= 4, "{saw}");
    assert!(saw["candidates"].as_u64().unwrap() > 0, "{saw}");
}
