//! The console of a flying mission: an operator's day in a browser, orders of programs through STAPI, and the replay.

use std::collections::BTreeMap;
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde_json::{Value, json};
use swath_mission::time_text;

use crate::common;

fn pictures() -> PathBuf {
    std::env::var_os("SWATH_PICTURES").map_or_else(|| Path::new(env!("CARGO_TARGET_TMPDIR")).to_owned(), PathBuf::from)
}

fn saw(command: &mut Command) -> Value {
    serde_json::from_str(common::succeed(command).trim()).unwrap()
}

/// How many requests are in each state at a time, by the audit trail.
fn states_at(trail: &[Value], time_ms: f64) -> BTreeMap<String, u64> {
    let time = |line: &Value| time_text::parse(line["time"].as_str().unwrap()).unwrap() as f64 / 1e6;
    let told = trail.iter().filter(|line| line["strip"] != 0 && time(line) <= time_ms);
    let last: BTreeMap<u64, &str> =
        told.map(|line| (line["strip"].as_u64().unwrap(), line["state"].as_str().unwrap())).collect();
    let mut counts = BTreeMap::new();
    for state in last.into_values() {
        *counts.entry(state.to_owned()).or_insert(0) += 1;
    }
    counts
}

/// A recorded mission's console, ended with the test.
struct Replay {
    url: String,
    _process: common::Running,
}

impl Replay {
    fn of(bag: &Path, domain: &str) -> Self {
        let mut command = common::swath(domain, &["console", "--listen", &common::address(), "--bag"]);
        let mut process = common::Running::start(command.arg(bag).stdout(Stdio::piped()));
        let mut url = String::new();
        BufReader::new(process.stdout()).read_line(&mut url).unwrap();
        Self { url: url.trim().to_owned(), _process: process }
    }
}

#[test]
fn an_operators_day_in_the_console_alone() {
    let (folder, domain, address) = (tempfile::tempdir().unwrap(), common::domain(), common::address());
    let mission = common::write_mission(folder.path(), common::QUIET);
    let out = folder.path().join("out");
    let mut launch = common::swath(&domain, &["launch", "--console", &address, "--out"]);
    let mut flight = common::Running::start(launch.arg(&out).arg(&mission));
    common::until("the console", || std::net::TcpStream::connect(&address).ok());
    let base = format!("http://{address}");

    // A program orders a strip, and hears of it until it is imaged.
    let ordered = saw(common::python("stapi.py", &base).arg("90"));
    let codes: Vec<_> = ordered["codes"].as_array().unwrap().iter().map(|it| it.as_str().unwrap()).collect();
    assert_eq!((codes[0], codes[codes.len() - 1]), ("accepted", "completed"), "{ordered}");
    assert!(codes.contains(&"tasked"), "{ordered}");
    assert!(ordered["opportunities"].as_u64().unwrap() > 2, "{ordered}");
    assert_eq!(ordered["status"], "completed");
    assert_eq!((&ordered["held"], &ordered["cancelled"]), (&json!("held"), &json!("user_cancelled")));
    assert_eq!(ordered["listed"], true);

    let day = saw(common::python("console_day.py", &base).arg(pictures()).arg(&domain));
    assert_eq!(day["elsewhere"], json!([]), "the page asks nobody else");
    assert_eq!(day["errors"], json!([]));
    eprintln!("seconds until another tab shows it: {}", day["seconds"]);
    flight.stop();

    // What each door did is in the trail under its name.
    let store = out.join("requests.sqlite");
    let trail = common::succeed(common::swath(&domain, &["strips", "export", "--trail", "--store"]).arg(&store));
    let trail = common::json_lines(&trail);
    for (name, actor) in [("by STAPI", "stapi"), ("drawn by hand", "console"), ("typed", "console")] {
        assert!(trail.iter().any(|line| line["name"] == name && line["actor"] == actor), "{name} by {actor}");
    }

    // The replay shows at each time what the trail says of it.
    let replay = Replay::of(&out.join("bag"), &domain);
    let begin = time_text::parse("2026-01-01T00:00:00Z").unwrap() as f64 / 1e6;
    let last = trail.iter().filter_map(|line| line["tick"].as_f64()).fold(0.0, f64::max) * 500.0;
    let times: Vec<_> = [0.2, 0.4, 0.6, 0.8, 0.95].map(|share| (begin + share * last).to_string()).into();
    let replayed = saw(common::python("replayed.py", replay.url.trim_end_matches('/')).args(times));
    assert_eq!(replayed["buttons"], 0, "nothing is changed in a recording");
    for pair in replayed["states"].as_array().unwrap() {
        let shown: BTreeMap<String, u64> = serde_json::from_value(pair[1].clone()).unwrap();
        assert_eq!(shown, states_at(&trail, pair[0].as_f64().unwrap()), "at {}", pair[0]);
    }
}

#[test]
fn ten_tabs_miss_a_node_that_is_away_until_it_is_back() {
    let (folder, domain, address) = (tempfile::tempdir().unwrap(), common::domain(), common::address());
    let away = "\n[supervision]\nbackoff_s = 20.0\nbackoff_max_s = 20.0\n";
    let mission = common::write_mission(folder.path(), &format!("{}{away}", common::QUIET));
    let mut launch = common::swath(&domain, &["launch", "--console", &address, "--no-bag", "--out"]);
    let _flight = common::Running::start(launch.arg(folder.path().join("out")).arg(&mission));
    common::until("the console", || std::net::TcpStream::connect(&address).ok());
    let mut look = common::python("console_missing.py", &format!("http://{address}"));
    let saw = saw(look.arg(pictures()).args([&domain, "guidance", "swath-guidance"]));
    eprintln!("a node that is away: {saw}");
    // HTTP/1.1 allows a browser six connections: all tabs share one stream.
    assert_eq!(saw["tabs"], 10);
    assert!((1..=6).contains(&saw["connections"].as_u64().unwrap()), "{saw}");
    // The launcher tells it: DDS knows of a process that is gone only after it is back.
    assert!(saw["back"].as_f64().unwrap() > saw["missing"].as_f64().unwrap(), "{saw}");
}
