//! An outside ROS 2 peer (CycloneDDS) receives states and status, submits strips that are then imaged, previews one and
//! cancels one, hears of the health of nodes, and acknowledges an alarm.

use crate::common;

#[test]
fn a_cyclonedds_peer_sees_the_mission_and_has_a_strip_imaged() {
    let folder = tempfile::tempdir().unwrap();
    // Twelve orbits at 200 times real time, if the peer does not end it before.
    let mission = common::write_mission(
        folder.path(),
        "orbits = 12.0\npace = 200.0\nseed = 5\n[faults]\nplan = [\"wheel2:weak 60%@60s\"]\n",
    );
    let domain = common::domain();
    let mut launch = common::command("swath", &domain);
    launch.arg("launch").arg(mission).arg("--no-bag").arg("--out").arg(folder.path().join("out"));
    let mut launch = common::Running::start(&mut launch);
    let peer = common::succeed(&mut common::python("peer.py", &domain));
    let seen: serde_json::Value = serde_json::from_str(&peer).unwrap();
    assert!((seen["radius_m"].as_f64().unwrap() - 6_898_136.6).abs() < 1.0, "{seen}");
    assert!(seen["accepted"].as_u64().unwrap() > 30, "{seen}");
    assert_eq!(seen["refused"], serde_json::json!([100, 101]), "{seen}");
    assert!(seen["opportunities"].as_u64().unwrap() > 0, "{seen}");
    for elevation in seen["elevations"].as_array().unwrap() {
        assert!((10.0_f64.to_radians()..1.6).contains(&elevation.as_f64().unwrap()), "{seen}");
    }
    assert_eq!(seen["no_opportunity"], 110, "{seen}");
    assert_eq!(seen["cancelled"], serde_json::json!([[true, 0], [false, 120]]), "{seen}");
    let well = serde_json::json!({ "guidance": 0, "planner": 0, "request_manager": 0, "spacecraft": 0 });
    assert_eq!((&seen["levels"], &seen["restarts"]), (&well, &serde_json::json!(["0", "0", "0", "0"])), "{seen}");
    assert!(seen["states_hz"].as_f64().unwrap() > 1.0 && seen["states_age_s"].as_f64().unwrap() < 2.0, "{seen}");
    assert_eq!(seen["alarm"], serde_json::json!(["guidance", 2, 1, 1]), "{seen}");
    assert_eq!(seen["unknown_alarm"], serde_json::json!([false, "there is no alarm `wheel q` of guidance"]), "{seen}");
    assert_eq!(seen["acknowledged"], serde_json::json!([true, 2]), "{seen}");
    assert!(seen["imaged"].as_str().unwrap().starts_with("peer-"), "{seen}");
    assert_eq!(seen["imaged_reward"], 0.9, "{seen}");
    launch.stop();
}
