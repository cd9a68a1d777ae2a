//! The Features collection as GIS programs open it: with GDAL.

use std::path::Path;
use std::process::Command;

use serde_json::{Value, json};

use super::server::{ask, replay};

/// Of a point, or of several, however deep.
fn longitudes(coordinates: &Value) -> Vec<f64> {
    let items = coordinates.as_array().unwrap();
    items[0].as_f64().map_or_else(|| items.iter().flat_map(longitudes).collect(), |longitude| vec![longitude])
}

#[test]
fn gdal_opens_the_strips() {
    let python = std::env::var("SWATH_PYTHON").expect("SWATH_PYTHON names the tests' Python; cargo xtask test sets it");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/it/gdal.py");
    let output = Command::new(python).arg(script).arg(format!("http://{}/", replay())).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let saw: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&saw["driver"], &saw["crs"]), (&json!("OAPIF"), &json!("EPSG:4326")));
    assert_eq!((&saw["layers"], &saw["paged"]), (&json!([["strips", "LineString"]]), &json!(true)));

    let (status, _, body) = ask("GET", "/features/collections/strips/items?limit=10000", "", "");
    assert_eq!(status, 200);
    let told: Value = serde_json::from_str(&body).unwrap();
    let told = told["features"].as_array().unwrap();
    let seen = saw["all"].as_array().unwrap();
    assert_eq!((seen.len(), seen.len() > 200), (told.len(), true));
    for (seen, told) in seen.iter().zip(told) {
        let (properties, line) = (&told["properties"], &told["geometry"]["coordinates"]);
        assert_eq!((&seen[0], &seen[1], &seen[3]), (&properties["name"], &properties["state"], line));
        let changed = properties["changed"].as_str().unwrap().trim_end_matches('Z');
        assert!(seen[2].as_str().unwrap().starts_with(changed), "{seen} is not {properties}");
    }
    let those = |choose: &dyn Fn(&Value) -> bool| -> Value {
        told.iter().filter(|it| choose(it)).map(|it| it["properties"]["name"].clone()).collect()
    };
    assert_eq!(saw["completed"], those(&|it| it["properties"]["state"] == "completed"));
    let west = those(&|it| longitudes(&it["geometry"]["coordinates"]).iter().any(|longitude| *longitude <= -30.0));
    assert_eq!(saw["west"], west);
    assert!(!west.as_array().unwrap().is_empty() && west.as_array().unwrap().len() < told.len(), "{west}");
}
