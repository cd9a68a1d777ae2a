//! A recorded mission: the bag holds every topic, and readers that nobody here wrote read every message.

use serde_json::Value;

use crate::common;

#[test]
fn outside_readers_read_every_message_of_a_recorded_mission() {
    let folder = tempfile::tempdir().unwrap();
    let mission = common::write_mission(folder.path(), "orbits = 0.5\n[requests.random]\ncount = [1500, 1500]\n");
    let out = folder.path().join("out");
    let domain = common::domain();
    let words = ["--planner", "hop-ppo", "--out"];
    common::succeed(common::command("swath", &domain).arg("launch").arg(mission).args(words).arg(&out));
    let summary: Value = serde_json::from_str(&std::fs::read_to_string(out.join("summary.json")).unwrap()).unwrap();
    let recorded = summary["messages_recorded"].as_u64().unwrap();
    let nodes: Vec<_> = summary["nodes"].as_array().unwrap().iter().map(|node| node["name"].clone()).collect();
    assert_eq!(nodes.len(), 5, "{nodes:?}");

    common::succeed(common::command("swath-bag", &domain).arg("validate").arg(out.join("bag")));
    let info = common::succeed(common::command("swath-bag", &domain).arg("info").arg(out.join("bag")));
    for (key, least) in [("revision: ", 7), ("policy_hash: ", 64)] {
        let value = info.lines().find_map(|line| line.trim().strip_prefix(key)).unwrap_or_else(|| panic!("{info}"));
        assert!(value.len() >= least && value.bytes().all(|c| c.is_ascii_alphanumeric()), "{info}");
    }
    let read = common::succeed(&mut common::python("read_bag.py", out.join("bag").to_str().unwrap()));
    let read: Value = serde_json::from_str(&read).unwrap();
    for reader in ["mcap", "rosbags"] {
        let total: u64 = read[reader].as_object().unwrap().values().map(|count| count.as_u64().unwrap()).sum();
        assert_eq!(total, recorded, "{reader}: {read}");
    }
    let count = |topic: &str| read["rosbags"][topic].as_u64().unwrap_or(0);
    // Half an orbit is 2851 s, 5702 ticks; states and commands of every tick are there.
    assert_eq!(count("/clock"), 5703, "{read}");
    assert!((5703..5710).contains(&count("/swath/spacecraft/state")), "{read}");
    assert!((5702..5710).contains(&count("/swath/guidance/wheel_torque")), "{read}");
    let tasks = std::fs::read_to_string(out.join("tasks.jsonl")).unwrap().lines().count() as u64;
    assert!((tasks + 1..tasks + 4).contains(&count("/swath/guidance/decision_point")), "{tasks}: {read}");
    assert!(count("/swath/requests/events") > 500, "{read}");
}
