//! Basilisk's closed-loop histories, flown again by this crate.
#![expect(non_snake_case, reason = "frame letters")]

#[expect(dead_code, reason = "the command-line tool prints more")]
#[path = "../../examples/compare_basilisk/history.rs"]
mod history;

/// Largest difference in σ and ω [rad/s].
const TOLERANCE: f64 = 1e-8;

#[test]
fn closed_loop_histories_are_reproduced() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/basilisk");
    let mut compared = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|extension| extension != "json") {
            continue;
        }
        let history = history::read(&path).unwrap();
        let found = history::compare(&history, None).unwrap();
        assert!(found.sigma <= TOLERANCE && found.omega <= TOLERANCE, "{}: {found:?}", path.display());
        compared += found.rows;
    }
    assert!(compared > 300, "only {compared} rows were compared");
}
