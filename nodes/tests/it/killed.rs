//! The request manager is killed at random moments, while requests are submitted and the satellite flies: what was
//! acknowledged is there, nothing else is, nothing is imaged twice, and the mission goes on.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::time::Duration;

use serde_json::Value;
use swath_msgs::swath_msgs as msg;
use swath_ros::{Environment, Node, RosArgs, graph};

use crate::common;
use crate::request::request;

/// Moments between kills: the same in each run, spread over 0.3 to 3 s.
fn pause(kill: u64) -> Duration {
    let mixed = kill.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 40;
    Duration::from_millis(300 + mixed % 2700)
}

/// The process of the request manager that flies with a store.
fn request_manager(store: &Path) -> Option<rustix::process::Pid> {
    let store = format!("store:={}", store.display());
    let processes = std::fs::read_dir("/proc").unwrap().filter_map(|entry| {
        let pid: i32 = entry.unwrap().file_name().to_str()?.parse().ok()?;
        let words = std::fs::read(format!("/proc/{pid}/cmdline")).ok()?;
        let words: Vec<_> = words.split(|&byte| byte == 0).collect();
        let ours = words.first()?.ends_with(b"swath-requests") && words.contains(&store.as_bytes());
        ours.then_some(pid)
    });
    processes.last().and_then(rustix::process::Pid::from_raw)
}

#[test]
fn nothing_acknowledged_is_lost_when_the_request_manager_is_killed_again_and_again() {
    kill_and_look(6);
}

#[test]
#[ignore = "takes minutes: cargo test --release -p swath-nodes --test it killed -- --ignored --nocapture"]
fn nothing_acknowledged_is_lost_when_the_request_manager_is_killed_a_hundred_times() {
    kill_and_look(100);
}

fn kill_and_look(kills: u64) {
    let folder = tempfile::tempdir().unwrap();
    let text = "orbits = 60.0\npace = 200.0\nseed = 5\nplanner = \"heuristic:90\"\n[supervision]\nstarts = 1000\n";
    let mission = common::write_mission(folder.path(), text);
    let out = folder.path().join("out");
    let store = out.join("requests.sqlite");
    let domain = common::domain();
    let mut launch = common::command("swath", &domain);
    launch.arg("launch").arg(mission).arg("--no-bag").arg("--out").arg(&out);
    let mut launch = common::Running::start(&mut launch);

    let stop = std::sync::atomic::AtomicBool::new(false);
    let (submitted, acknowledged) = std::thread::scope(|scope| {
        let submitter = scope.spawn(|| submit_until(&stop, &domain));
        common::until("the first task", || {
            let tasks = std::fs::read_to_string(out.join("tasks.jsonl")).ok()?;
            tasks.contains('\n').then_some(())
        });
        for kill in 0..kills {
            std::thread::sleep(pause(kill));
            let pid = common::until("the request manager", || request_manager(&store));
            rustix::process::kill_process(pid, rustix::process::Signal::KILL).unwrap();
            common::until("another one", || request_manager(&store).filter(|&other| other != pid));
        }
        // The mission goes on: it images strips after the last restart.
        let flown = std::fs::read_to_string(out.join("tasks.jsonl")).unwrap().lines().count();
        common::until("imaging after the last restart", || {
            let tasks = std::fs::read_to_string(out.join("tasks.jsonl")).unwrap();
            let later = common::json_lines(&tasks[..=tasks.rfind('\n')?]);
            later
                .get(flown + 1..)?
                .iter()
                .any(|task| task["success"] == true && task["strip"] != Value::Null)
                .then_some(())
        });
        stop.store(true, std::sync::atomic::Ordering::Relaxed);
        submitter.join().unwrap()
    });
    assert!(acknowledged.len() > 20, "only {} were acknowledged", acknowledged.len());
    let tasks = std::fs::read_to_string(out.join("tasks.jsonl")).unwrap();
    let trail = common::succeed(&mut common::swath(&domain, &["strips", "export", "--trail"]));
    let geojson = common::succeed(&mut common::swath(&domain, &["strips", "export"]));
    launch.stop();

    let trail = common::json_lines(&trail);
    let geojson: Value = serde_json::from_str(&geojson).unwrap();
    let held: BTreeMap<String, u64> = geojson["features"]
        .as_array()
        .unwrap()
        .iter()
        .map(|it| &it["properties"])
        .map(|it| (it["client_ref"].as_str().unwrap().to_owned(), it["id"].as_u64().unwrap()))
        .collect();
    for (reference, id) in &acknowledged {
        assert_eq!(held.get(reference), Some(id), "{reference} was acknowledged");
    }
    assert_eq!(held.len(), geojson["features"].as_array().unwrap().len(), "a reference is there twice");
    assert!(held.keys().all(|reference| submitted.contains(reference)), "a request was invented");
    let mut completed = BTreeMap::new();
    for line in trail.iter().filter(|line| line["state"] == "completed") {
        *completed.entry(line["strip"].as_u64().unwrap()).or_insert(0) += 1;
    }
    assert!(!completed.is_empty());
    assert!(completed.values().all(|&times| times == 1), "fulfilled twice: {completed:?}");
    // Each strip that guidance had imaged by then is known to be imaged.
    let tasks = common::json_lines(&tasks[..=tasks.rfind('\n').unwrap()]);
    let imaged: Vec<_> =
        tasks.iter().filter(|it| it["success"] == true).filter_map(|it| it["strip"].as_u64()).collect();
    let distinct: BTreeSet<_> = imaged.iter().copied().collect();
    assert_eq!(distinct.len(), imaged.len(), "imaged twice: {imaged:?}");
    let known: BTreeSet<_> = completed.keys().copied().collect();
    assert!(distinct.is_subset(&known), "{distinct:?} {known:?}");
    println!("{kills} kills, {} acknowledged, {} imaged", acknowledged.len(), imaged.len());
}

/// Submits one batch after the other; a batch without an answer is submitted again, as a client would.
fn submit_until(stop: &std::sync::atomic::AtomicBool, domain: &str) -> (BTreeSet<String>, BTreeMap<String, u64>) {
    let environment =
        Environment { domain: domain.parse().unwrap(), localhost_only: true, ..Environment::read().unwrap() };
    let node = Node::start_in(environment, "killer", &RosArgs::default()).unwrap();
    let client = node.client(&graph::SUBMIT_STRIPS).unwrap();
    let (mut submitted, mut acknowledged) = (BTreeSet::new(), BTreeMap::new());
    let mut first = 0;
    while !stop.load(std::sync::atomic::Ordering::Relaxed) {
        let requests: Vec<_> = (first..first + 5).map(|number| request("killer", number)).collect();
        submitted.extend(requests.iter().map(|request| request.client_ref.clone()));
        let call = msg::SubmitStripsRequest { requests: requests.clone() };
        let Ok(answer) = client.call(call, Duration::from_millis(500)) else { continue };
        for (request, result) in requests.iter().zip(&answer.results) {
            if result.accepted {
                let id = *acknowledged.entry(request.client_ref.clone()).or_insert(result.id);
                assert_eq!(id, result.id, "the same request has two numbers");
            }
        }
        first += 5;
        std::thread::sleep(Duration::from_millis(20));
    }
    (submitted, acknowledged)
}
