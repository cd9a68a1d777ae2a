//! Alarms of a flying mission as operators meet them: listed, acknowledged, shelved, journalled, and never fed by a
//! replay.

use std::path::Path;

use serde_json::Value;

use crate::common;

/// What `swath alarms` tells of an alarm, while it is not normal.
fn alarm(domain: &str, name: &str) -> Option<Value> {
    let listed = common::json_lines(&common::succeed(&mut common::swath(domain, &["alarms", "--json"])));
    listed.into_iter().find(|it| it["name"] == name)
}

fn until_it_is(domain: &str, name: &str, state: &str) -> Value {
    common::until(state, || alarm(domain, name).filter(|it| it["state"] == state))
}

fn events(out: &Path, name: &str) -> Vec<(String, String)> {
    let lines = common::json_lines(&std::fs::read_to_string(out.join("alarms.jsonl")).unwrap_or_default());
    let text = |value: &Value| value.as_str().unwrap().to_owned();
    lines.iter().filter(|it| it["name"] == name).map(|it| (text(&it["event"]), text(&it["actor"]))).collect()
}

#[test]
fn operators_acknowledge_and_shelve_what_is_wrong() {
    let folder = tempfile::tempdir().unwrap();
    let text = "orbits = 60.0\npace = 200.0\nseed = 5\nplanner = \"heuristic:90\"\n[requests.random]\n\
                count = [3000, 3000]\n[faults]\nplan = [\"wheel2:weak 60%@60s\", \"startracker:out@400s+60s\"]\n";
    let mission = common::write_mission(folder.path(), text);
    let (out, domain) = (folder.path().join("out"), common::domain());
    let mut launch = common::swath(&domain, &["launch"]);
    let mut flight = common::Running::start(launch.arg(&mission).arg("--out").arg(&out));
    let words = |words: &[&str]| common::succeed(&mut common::swath(&domain, words));
    let refused = |words: &[&str]| common::fail(&mut common::swath(&domain, words));
    let wheel = until_it_is(&domain, "wheel y", "unacknowledged");
    assert_eq!(
        (&wheel["node"], &wheel["severity"], &wheel["sequence"]),
        (&"guidance".into(), &"error".into(), &1.into())
    );
    assert!(wheel["text"].as_str().unwrap().starts_with("it gives 40 %"), "{wheel}");
    words(&["alarms", "ack", "guidance", "wheel y", "--actor", "ana", "--comment", "planned around"]);
    until_it_is(&domain, "wheel y", "acknowledged");
    let again = refused(&["alarms", "ack", "guidance", "wheel y"]);
    assert!(again.contains("wheel y of guidance: the alarm is acknowledged already"), "{again}");
    let unknown = refused(&["alarms", "ack", "guidance", "wheel q"]);
    assert!(unknown.contains("there is no alarm `wheel q` of guidance"), "{unknown}");
    let never = refused(&["alarms", "shelve", "guidance", "wheel y", "--minutes", "0"]);
    assert!(never.contains("cannot be shelved for 0 s: 1 to 2592000 s are allowed"), "{never}");
    words(&["alarms", "shelve", "guidance", "wheel y", "--minutes", "10000", "--actor", "ana"]);
    let shelved = until_it_is(&domain, "wheel y", "shelved");
    assert!(shelved["beneath"] == "acknowledged" && shelved["shelved_until"].is_string(), "{shelved}");
    words(&["alarms", "unshelve", "guidance", "wheel y"]);
    until_it_is(&domain, "wheel y", "acknowledged");
    until_it_is(&domain, "star tracker out", "returned unacknowledged");
    words(&["alarms", "ack", "--all", "--actor", "ana"]);
    common::until("normal", || alarm(&domain, "star tracker out").is_none().then_some(()));
    let by = |event: &str, actor: &str| (event.to_owned(), actor.to_owned());
    let expected =
        [by("raised", "guidance"), by("acknowledged", "ana"), by("shelved", "ana"), by("unshelved", "operator")];
    common::until("the journal while it flies", || (events(&out, "wheel y") == expected).then_some(()));
    flight.stop();
    assert_eq!(events(&out, "wheel y"), expected);
    let expected = [by("raised", "guidance"), by("returned", "guidance"), by("acknowledged", "ana")];
    assert_eq!(events(&out, "star tracker out"), expected);
    let mut cat = common::command("swath-bag", "0");
    let recorded = common::succeed(cat.arg("cat").arg(out.join("bag")).args(["--topic", "/swath/alarms/events"]));
    assert!(recorded.contains("planned around"), "{recorded}");
    nothing_comes_from_a_replay(folder.path(), &out.join("bag"), &domain);
}

/// A mission without faults flies where a bag with alarms is played.
fn nothing_comes_from_a_replay(folder: &Path, bag: &Path, domain: &str) {
    let mission = common::write_mission(folder, "orbits = 60.0\npace = 200.0\nplanner = \"heuristic:90\"\n");
    let mut launch = common::swath(domain, &["launch", "--no-bag"]);
    let mut flight = common::Running::start(launch.arg(&mission).arg("--out").arg(folder.join("nominal")));
    let list = || common::succeed(&mut common::swath(domain, &["alarms", "--json"]));
    assert_eq!(list(), "");
    let mut play = common::command("swath-bag", domain);
    common::succeed(play.arg("play").arg(bag).args(["--rate", "1000", "--topics", "/diagnostics"]));
    assert_eq!(list(), "");
    flight.stop();
    assert!(!folder.join("nominal/alarms.jsonl").exists());
}
