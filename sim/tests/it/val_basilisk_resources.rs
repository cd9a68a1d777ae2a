//! Basilisk's histories of Sun, battery, data, access and momentum, computed again by this crate.
#![expect(non_snake_case, reason = "frame letters")]

#[path = "../../examples/compare_basilisk/resources/mod.rs"]
mod resources;

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde_json::Value;

fn histories() -> Vec<(PathBuf, Value)> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/basilisk_resources");
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let histories = files.filter(|path| path.extension().is_some_and(|extension| extension == "json"));
    histories
        .map(|path| (path.clone(), serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()))
        .collect()
}

#[test]
fn histories_of_every_kind_are_reproduced() {
    let mut kinds = BTreeMap::new();
    for (path, history) in histories() {
        let found = resources::compare(&path, &history).unwrap();
        for check in &found.checks {
            assert!(check.holds(), "{}: {} {check:?}", path.display(), check.what);
        }
        *kinds.entry(resources::case(&history).unwrap().to_owned()).or_insert(0) += found.rows;
    }
    let names: Vec<&str> = kinds.keys().map(String::as_str).collect();
    let wanted = [
        "access",
        "battery",
        "data",
        "eclipse",
        "gg_tumble",
        "momentum",
        "panel_replay",
        "panel_tumble",
        "wheel_power",
        "wheel_replay",
    ];
    assert_eq!(names, wanted);
    assert!(kinds.values().all(|rows| *rows >= 15), "{kinds:?}");
}

/// Changes one number of the history of a file.
fn changed(file: &str, change: impl Fn(&mut Value)) -> bool {
    let (path, mut history) = histories().into_iter().find(|(path, _)| path.ends_with(file)).unwrap();
    change(&mut history);
    resources::compare(&path, &history).unwrap().checks.iter().all(resources::Check::holds)
}

#[test]
fn a_history_that_differs_a_little_is_told() {
    let add = |history: &mut Value, pointer: &str, much: f64| {
        let value = history.pointer_mut(pointer).unwrap();
        *value = (value.as_f64().unwrap() + much).into();
    };
    assert!(changed("eclipse_beta-35.json", |_| {}));
    assert!(!changed("eclipse_beta-35.json", |it| add(it, "/meta/events/0/first_tick", 1.0)));
    assert!(!changed("battery_minisat_nominal.json", |it| add(it, "/data/charge/3", 1e-4)));
    assert!(!changed("access_ksat_mixed.json", |it| add(it, "/data/stations/0/windows/10/0/set", 1.0)));
    assert!(!changed("mtb_cross_gg_offset_nadir.json", |it| add(it, "/data/rw_speed/5/1", 1e-7)));
    assert!(!changed("panel_tumble_0.json", |it| add(it, "/data/panel_power/2", 1e-5)));
}

#[test]
fn what_is_missing_is_named() {
    let (path, mut history) = histories().into_iter().find(|(path, _)| path.ends_with("gg_inertial.json")).unwrap();
    history["meta"].as_object_mut().unwrap().remove("Js");
    let error = format!("{:#}", resources::compare(&path, &history).unwrap_err());
    assert!(error.contains("gg_inertial.json") && error.contains("no `meta.Js`"), "{error}");
    history["meta"]["case"] = "weather".into();
    let error = format!("{:#}", resources::compare(&path, &history).unwrap_err());
    assert!(error.contains("unknown case `weather`"), "{error}");
}
