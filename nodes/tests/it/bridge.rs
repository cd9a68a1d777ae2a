//! The bridge to Foxglove, by a client of its protocol: a flying mission, commands, a bag.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};

use serde_json::{Value, json};
use swath_ros::graph;

use crate::common;

/// A bridge at work, ended with the test, and where it is.
struct Bridge {
    url: String,
    _process: common::Running,
}

impl Bridge {
    fn start(domain: &str, words: &[&str]) -> Self {
        let mut command = common::swath(domain, &["bridge", "--listen", "127.0.0.1:0"]);
        let mut process = common::Running::start(command.args(words).stdout(Stdio::piped()));
        let mut url = String::new();
        BufReader::new(process.stdout()).read_line(&mut url).unwrap();
        Self { url: url.trim().to_owned(), _process: process }
    }

    fn saw(&self, way: &str) -> Value {
        let mut client: Command = common::python("foxglove.py", &self.url);
        serde_json::from_str(common::succeed(client.arg(way)).trim()).unwrap()
    }
}

fn strings(value: &Value) -> Vec<&str> {
    value.as_array().unwrap().iter().map(|it| it.as_str().unwrap()).collect()
}

#[test]
fn foxglove_sees_a_flying_mission_and_commands_it_where_it_may() {
    let (folder, domain) = (tempfile::tempdir().unwrap(), common::domain());
    let mission = common::write_mission(folder.path(), common::QUIET);
    let mut launch = common::swath(&domain, &["launch", "--no-bag", "--out"]);
    let _flight = common::Running::start(launch.arg(folder.path().join("out")).arg(&mission));

    let looks = Bridge::start(&domain, &[]);
    let commands = Bridge::start(&domain, &["--services", "--publish", "--ros-args", "-r", "__node:=commands"]);
    let saw = looks.saw("live");
    assert_eq!((&saw["capabilities"], &saw["services"]), (&json!(["time"]), &json!(0)), "{saw}");
    let topics: BTreeSet<_> = strings(&saw["topics"]).into_iter().collect();
    for entry in graph::TOPICS {
        let name = if entry.name.starts_with('/') { entry.name.to_owned() } else { format!("/swath/{}", entry.name) };
        assert!(topics.contains(name.as_str()), "{name}: {topics:?}");
    }
    assert_eq!((&saw["schemas"], &saw["late"], &saw["clock"]), (&json!(true), &json!(true), &json!(true)), "{saw}");
    let ticks: Vec<u64> = serde_json::from_value(saw["ticks"].clone()).unwrap();
    assert!(ticks.len() > 1 && ticks.windows(2).all(|pair| pair[1] == pair[0] + 1), "{ticks:?}");
    assert_eq!(saw["frames"], json!(["body", "ecef", "orbit"]));
    assert!(saw["latitude"].as_f64().unwrap().abs() <= 45.1, "{saw}");
    assert!(saw["strips"]["accepted"].as_u64().unwrap() > 50, "{saw}");
    let scene = &saw["scene"];
    assert_eq!((&scene["frames"], &scene["spheres"]), (&json!(["ecef"]), &json!(["earth"])), "{saw}");
    assert!(scene["lines"]["accepted"].as_u64().unwrap() > 50, "{saw}");
    assert!(saw["refused"][0].as_str().unwrap().contains("clientPublish"), "{saw}");

    let saw = commands.saw("commands");
    let offered: BTreeSet<_> = strings(&saw["services"]).into_iter().map(str::to_owned).collect();
    let table: BTreeSet<_> = graph::SERVICES.iter().map(|entry| format!("/swath/{}", entry.name)).collect();
    assert_eq!(offered, table);
    assert_eq!((&saw["listed"], &saw["published"]), (&json!(5), &json!(true)), "{saw}");
    let refused = strings(&saw["statuses"]);
    for (text, what) in refused.iter().zip(["its type is swath_msgs/msg/StripRequest", "\"json\"", "is not known here"])
    {
        assert!(text.contains(what), "{text}");
    }
    assert!(strings(&saw["garbled"])[0].contains("was not published"), "{saw}");
}

#[test]
fn foxglove_plays_a_bag() {
    let bag = Path::new(env!("CARGO_MANIFEST_DIR")).join("../bags/samples/mission");
    let bridge = Bridge::start(&common::domain(), &["--bag", bag.to_str().unwrap()]);
    let saw = bridge.saw("bag");
    assert_eq!(saw["capabilities"], json!(["time", "playbackControl"]));
    assert_eq!(saw["before"], 0, "paused at first");
    for fact in ["ordered", "sought", "from the middle", "ended"] {
        assert_eq!(saw[fact], true, "{fact}: {saw}");
    }
    let strips: BTreeMap<String, u64> = serde_json::from_value(saw["strips"].clone()).unwrap();
    assert_eq!(strips["completed"], 6, "in the middle: {saw}");
    // As the bag's last summary of requests counts them.
    let expected = json!({ "accepted": 186, "scheduled": 0, "executing": 0, "completed": 16, "expired": 11 });
    assert_eq!(saw["at the end"], expected, "{saw}");
}

#[test]
fn the_bridge_listens_in_its_namespace_however_that_is_said() {
    for words in [&["--namespace", "/sat2"][..], &["--ros-args", "-r", "__ns:=/sat2"]] {
        let bridge = Bridge::start(&common::domain(), words);
        assert!(bridge.url.starts_with("ws://127.0.0.1:"), "{}", bridge.url);
        let topics = bridge.saw("topics");
        let topics = strings(&topics);
        assert!(topics.contains(&"/sat2/spacecraft/state") && topics.contains(&"/sat2/clock"), "{topics:?}");
        assert!(!topics.iter().any(|it| it.starts_with("/swath/")), "{topics:?}");
    }
}

#[test]
fn what_others_could_reach_commands_nothing() {
    let words = ["bridge", "--listen", "0.0.0.0:0", "--services"];
    let error = common::fail(&mut common::swath(&common::domain(), &words));
    assert!(error.contains("--services and --publish need an address of this machine"), "{error}");
}

/// Every topic that the layout of `examples/foxglove` shows is one that the bridge has.
#[test]
fn the_layout_shows_topics_that_there_are() {
    let text = include_str!("../../../examples/foxglove/swath.json");
    let layout: Value = serde_json::from_str(text).unwrap();
    let mut shown = BTreeSet::new();
    topics_in(&layout, &mut shown);
    assert!(shown.len() > 6, "{shown:?}");
    let known = |topic: &str| {
        topic.starts_with("/swath/strips/")
            || graph::TOPICS.iter().any(|entry| topic.strip_prefix("/swath/").unwrap_or(topic) == entry.name)
    };
    let unknown: Vec<_> = shown.iter().filter(|topic| !known(topic)).collect();
    assert!(unknown.is_empty(), "{unknown:?}");
}

/// Texts that begin with a topic: `/swath/spacecraft/wheels.velocity[0]`.
fn topics_in(value: &Value, found: &mut BTreeSet<String>) {
    match value {
        Value::String(text) if text.starts_with('/') => {
            found.insert(text.split(['.', '{']).next().unwrap().to_owned());
        }
        Value::Array(items) => items.iter().for_each(|item| topics_in(item, found)),
        Value::Object(entries) => {
            entries.iter().for_each(|(key, item)| {
                topics_in(&Value::String(key.clone()), found);
                topics_in(item, found);
            });
        }
        _ => {}
    }
}
