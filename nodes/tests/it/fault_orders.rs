//! Faults that are ordered while a mission flies: taken or refused in words, told of, and the same when it is flown again.

use std::path::Path;

use serde_json::Value;

use crate::common;

fn events(out: &Path, name: &str) -> Vec<(String, u64)> {
    let lines = common::json_lines(&std::fs::read_to_string(out.join("alarms.jsonl")).unwrap_or_default());
    let event = |it: &Value| (it["event"].as_str().unwrap().to_owned(), it["tick"].as_u64().unwrap());
    lines.iter().filter(|it| it["name"] == name).map(event).collect()
}

/// Orders a fault, which must be taken; the tick from which on it acts.
fn order(domain: &str, fault: &str) -> u64 {
    let said = common::succeed(&mut common::swath(domain, &["fault", fault, "--actor", "ana", "--json"]));
    let answer: Value = serde_json::from_str(&said).unwrap();
    assert_eq!(answer["accepted"], true, "{answer}");
    answer["tick"].as_u64().unwrap()
}

#[test]
fn what_is_ordered_on_the_way_befalls_the_mission_and_the_same_mission_flown_again() {
    let folder = tempfile::tempdir().unwrap();
    let text = "orbits = 60.0\nseed = 5\nplanner = \"lookahead\"\n[requests.random]\ncount = [9000, 9000]\n";
    let mission = common::write_mission(folder.path(), text);
    let (out, domain) = (folder.path().join("out"), common::domain());
    let mut launch = common::swath(&domain, &["launch"]);
    let mut flight = common::Running::start(launch.arg(&mission).arg("--out").arg(&out));
    common::until("the first task", || out.join("tasks.jsonl").metadata().is_ok_and(|it| it.len() > 0).then_some(()));
    let orders = [
        ("wheel2:weak 60%+300s", "wheel y", 600),
        ("startracker:out+60s", "star tracker out", 4),
        ("gyro:bias 0.02deg/s+120s", "gyro biased", 10),
        ("planner:hang+200s", "planner lost", 0),
        ("guidance:kill+20s", "guidance lost", 0),
        ("request_manager:kill", "request_manager lost", 0),
        ("spacecraft:kill", "spacecraft lost", 0),
        ("recorder:kill", "recorder lost", 0),
    ];
    let mut begun = Vec::new();
    for (fault, alarm, _) in orders {
        begun.push(order(&domain, fault));
        common::until(alarm, || {
            let events = events(&out, alarm);
            (events.len() >= 2 && events.last()?.0 == "returned").then_some(())
        });
    }
    // The orders that were kept count for nodes that were started again since. That a wheel is weak shows when it is asked
    // for more than it gives.
    let late = order(&domain, "wheel3:weak 60%+300s");
    common::until("the last wheel", || (events(&out, "wheel z").len() == 2).then_some(()));
    flight.stop();
    for ((fault, alarm, delay), begins) in orders.into_iter().zip(begun).chain([(("wheel3", "wheel z", 600), late)]) {
        let events = events(&out, alarm);
        let [(raised, at), (returned, _)] = &events[..] else { panic!("{alarm}: {events:?}") };
        assert_eq!((raised.as_str(), returned.as_str()), ("raised", "returned"), "{alarm}");
        assert!((begins..=begins + delay).contains(at), "{fault} from tick {begins} on was told at {at}");
    }
    let mut refly = common::command("swath", "0");
    let again = common::succeed(refly.arg("refly").arg(out.join("bag")));
    assert!(again.contains("tasks are the same, byte by byte"), "{again}");
    assert!(again.contains("tasks were flown while nothing was recorded"), "{again}");
}

#[test]
fn what_cannot_be_ordered_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let mission = common::write_mission(folder.path(), common::QUIET);
    let (out, domain) = (folder.path().join("out"), common::domain());
    let mut launch = common::swath(&domain, &["launch", "--no-bag"]);
    let _flight = common::Running::start(launch.arg(&mission).arg("--out").arg(&out));
    order(&domain, "wheel1:dead@50000s");
    let refused = |words: &[&str]| {
        let output = common::run(&mut common::swath(&domain, words));
        assert_eq!(output.status.code(), Some(1), "{words:?}");
        String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
    };
    for (fault, words) in [
        ("wheel9:dead", "there is no part `wheel9`; there are spacecraft, guidance"),
        ("guidance:explode", "guidance cannot `explode`; it can kill or hang"),
        ("wheel2:weak 120%", "the share lost is `120%`, not a share above 0% and up to 100%"),
        ("guidance:kill@0.5s", "guidance:kill@0.5s is past: it is "),
        ("guidance:kill@9000h", "mission ends at"),
        ("wheel1:weak 5%@60000s", "wheel1:dead@50000s and wheel1:weak 5%@60000s contradict each other"),
        ("spacecraft:hang+5s", "the spacecraft owns the clock"),
    ] {
        let told = refused(&["fault", fault]);
        assert!(told.contains(words) && told.contains("1 of 1 were refused"), "{told}");
    }
    let both = refused(&["fault", "thruster:dead", "startracker:out+5s"]);
    assert!(both.contains("startracker:out@") && both.contains("1 of 2 were refused"), "{both}");
    let nobody = common::fail(&mut common::swath(&common::domain(), &["fault", "wheel1:dead"]));
    assert!(nobody.contains("no spacecraft is flying in this domain"), "{nobody}");
}
