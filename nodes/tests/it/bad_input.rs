//! Bad input: each a clear error, an exit code, and no mission harmed.

use swath_sim::error::StripError;

use crate::common;

#[test]
fn faulty_missions_are_refused_by_name_and_limit() {
    let folder = tempfile::tempdir().unwrap();
    for (text, expected) in [
        ("orbit = 1.0", "unknown field `orbit`"),
        ("pace = nan", "pace is NaN, outside 0 to 1000000"),
        ("[sim.imaging]\nsigma_max = 7.0", "imaging.sigma_max is 7"),
        ("[requests]\nfiles = [\"missing.geojson\"]", "missing.geojson"),
        ("planner = \"clever\"", "`clever` is no planner"),
    ] {
        let mission = common::write_mission(folder.path(), text);
        let mut launch = common::command("swath", "0");
        launch.arg("launch").arg(mission).arg("--in-process").arg("--out").arg(folder.path().join("out"));
        let error = common::fail(&mut launch);
        assert!(error.contains(expected), "{text}: {error}");
    }
}

#[test]
fn faulty_requests_are_refused_with_their_place() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("strips.geojson");
    for (text, expected) in [
        (r#"{"type":"FeatureCollection","features":[{"type":"Feat"#, "is not GeoJSON"),
        (r#"{"type":"Point","coordinates":[1,2]}"#, "a Point is no strip"),
        (r#"{"type":"LineString","coordinates":[[1,2],[3]]}"#, "feature 1: a line needs two points"),
    ] {
        std::fs::write(&file, text).unwrap();
        let mut submit = common::command("swath", "0");
        submit.args(["strips", "submit"]).arg(&file);
        let error = common::fail(&mut submit);
        assert!(error.contains(expected), "{text}: {error}");
    }
    let large = std::fs::File::create(&file).unwrap();
    large.set_len(200_000_000).unwrap();
    let error = common::fail(common::command("swath", "0").args(["strips", "submit"]).arg(&file));
    assert!(error.contains("has more than the limit of 100 MB"), "{error}");
}

/// A line that is a point has a length by the errors of rounding; nobody needs to read that.
#[test]
fn lengths_are_told_to_the_metre() {
    let error = StripError::Length { length_km: 5.523186016267257e-13, min_km: 20.0, max_km: 500.0 };
    assert_eq!(error.to_string(), "length 0.000 km is outside 20 to 500 km");
}

#[test]
fn a_second_spacecraft_and_a_missing_node_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let mission = common::write_mission(folder.path(), "orbits = 1.0\n");
    let parameter = format!("mission:={}", mission.display());
    let domain = common::domain();
    let spacecraft = |timeout: &str| {
        let mut command = common::command("swath-spacecraft", &domain);
        command.args(["--ros-args", "-p", &parameter, "-p", &format!("peer_timeout_s:={timeout}")]);
        command
    };
    let log = folder.path().join("log");
    let mut first = common::Running::start(spacecraft("8.0").stderr(std::fs::File::create(&log).unwrap()));
    std::thread::sleep(std::time::Duration::from_secs(2));
    let error = common::fail(&mut spacecraft("8.0"));
    assert!(error.contains("/swath/spacecraft is already running"), "{error}");
    assert_eq!(first.wait().code(), Some(1));
    let error = std::fs::read_to_string(&log).unwrap();
    assert!(error.contains("node /swath/guidance is not there"), "{error}");
}
