//! What `swath` makes of recorded missions, on the one of `bags/samples`, and one over DDS.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use serde_json::Value;
use swath_bags::cli::{MANIFEST, MANIFEST_TEXT};
use swath_bags::{Bag, BagOptions, BagWriter, Filter};
use swath_ground::debrief::recorded::Recorded;
use swath_mission::approval::Mode;
use swath_mission::orders::action::Act;
use swath_mission::orders::action::Review;

use crate::common;

fn sample() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../bags/samples/mission")
}

fn swath_bag(words: &[&str]) -> Command {
    let mut command = common::command("swath-bag", "100");
    command.args(words);
    command
}

fn swath(words: &[&str]) -> Command {
    common::swath("100", words)
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn every_command_has_an_example() {
    for name in ["refly", "report", "export"] {
        let help = common::succeed(&mut swath(&[name, "--help"]));
        let example = help.split("Example").nth(1).unwrap();
        assert!(example.contains(&format!("\n  swath {name} ")), "{help}");
    }
}

#[test]
fn the_old_spelling_runs_the_same_command() {
    let folder = tempfile::tempdir().unwrap();
    let said = |command: &mut Command| {
        let output = common::run(command);
        (output.status.code(), String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap())
    };
    let sample = sample();
    let words = ["export", text(&sample), "--format", "czml", "-o", text(folder.path())];
    let (new, old) = (said(&mut swath(&words)), said(&mut swath_bag(&words)));
    assert_eq!((old.0, &old.1), (new.0, &new.1));
    assert_eq!(old.2, format!("swath-bag export runs `swath export`\n{}", new.2));
}

#[test]
fn the_sample_is_small_and_without_fault() {
    let sample = sample();
    let bytes: u64 = fs::read_dir(&sample).unwrap().map(|entry| entry.unwrap().metadata().unwrap().len()).sum();
    assert!(bytes < 2_000_000, "{bytes} bytes");
    let valid = common::succeed(&mut swath_bag(&["validate", text(&sample)]));
    assert!(valid.contains(" 0 faults, 0 warnings"), "{valid}");
    let info = common::succeed(&mut swath_bag(&["info", text(&sample)]));
    assert!(info.contains("swath_manifest") && info.contains("planner: lookahead"), "{info}");
    let words = ["cat", text(&sample), "--topic", "/swath/planner/decision", "-n", "1"];
    let first: Value = serde_json::from_str(&common::succeed(&mut swath_bag(&words))).unwrap();
    assert_eq!(first["message"]["task"], 0);
}

#[test]
fn the_sample_goes_through_filter_merge_and_recover() {
    let folder = tempfile::tempdir().unwrap();
    let sample = sample();
    let out = |name: &str| text(&folder.path().join(name)).to_owned();
    let half = Bag::open(&sample).unwrap().time_range().map(|(start, end)| (end - start) as f64 / 2e9).unwrap();
    let (before, after) = (format!("+{}", half - 1e-9), format!("{half}"));
    common::succeed(&mut swath_bag(&[
        "filter",
        text(&sample),
        "-o",
        &out("a"),
        "--to",
        before.trim_start_matches('+'),
    ]));
    common::succeed(&mut swath_bag(&["filter", text(&sample), "-o", &out("b"), "--from", &after]));
    common::succeed(&mut swath_bag(&["merge", &out("a"), &out("b"), "-o", &out("whole")]));
    fs::remove_file(folder.path().join("whole/metadata.yaml")).unwrap();
    common::succeed(&mut swath_bag(&["recover", &out("whole"), "-o", &out("saved")]));
    let refly = common::succeed(&mut swath(&["refly", &out("saved")]));
    assert!(refly.contains("are the same, byte by byte"), "{refly}");
}

#[test]
fn the_same_planner_flies_the_recorded_mission_again_byte_by_byte() {
    let folder = tempfile::tempdir().unwrap();
    let tasks = folder.path().join("tasks.jsonl");
    let said = common::succeed(&mut swath(&["refly", text(&sample()), "--tasks", text(&tasks)]));
    let recorded = Recorded::open(&sample(), None).unwrap();
    assert!(recorded.complete && recorded.tasks.len() > 10);
    assert!(said.contains(&format!("all {} tasks are the same, byte by byte", recorded.tasks.len())), "{said}");
    let lines: Vec<String> = recorded.tasks.iter().map(|(_, line)| serde_json::to_string(line).unwrap()).collect();
    assert_eq!(fs::read_to_string(tasks).unwrap().lines().collect::<Vec<_>>(), lines);
}

#[test]
fn another_planner_is_compared_decision_by_decision() {
    let words = ["refly", text(&sample()), "--planner", "heuristic:90"].map(str::to_owned);
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let comparison: Value =
        serde_json::from_str(&common::succeed(&mut swath(&[&words[..], &["--json"]].concat()))).unwrap();
    assert_eq!(comparison["identical"], false);
    assert_eq!(comparison["first_difference"], 0);
    let first = &comparison["decisions"][0];
    assert_eq!(first["same_candidates"], true, "both begin with the same strips");
    assert_eq!(first["reflown"]["t_pre_ticks"], 180);
    assert_ne!(comparison["recorded"]["reward"], comparison["reflown"]["reward"]);
    let said = common::succeed(&mut swath(&words));
    assert!(said.contains("first difference: decision 0, among the same strips\n"), "{said}");
}

#[test]
fn bags_without_a_manifest_are_flown_again_and_told_with_the_mission_file() {
    let folder = tempfile::tempdir().unwrap();
    let (foreign, mission) = (folder.path().join("foreign"), folder.path().join("mission.toml"));
    copy_with_manifest(&foreign, |text| {
        fs::write(&mission, text).unwrap();
        None
    });
    let error = common::fail(&mut swath(&["refly", text(&foreign)]));
    assert!(error.contains("--mission says which was flown"), "{error}");
    let of_mission = ["--mission", text(&mission)];
    let said = common::succeed(swath(&["refly", text(&foreign)]).args(of_mission));
    assert!(said.contains("tasks are the same, byte by byte"), "{said}");
    let page = folder.path().join("report.html");
    common::succeed(swath(&["report", text(&foreign), "-o", text(&page)]).args(of_mission));
    assert!(fs::read_to_string(page).unwrap().contains("<svg"));
}

/// A copy of the sample with another manifest, or with none.
fn copy_with_manifest(target: &Path, change: impl Fn(&str) -> Option<String>) {
    let bag = Bag::open(&sample()).unwrap();
    let writer = BagWriter::create(target, BagOptions::default()).unwrap();
    let manifest = bag.metadata_named(MANIFEST).unwrap();
    if let Some(mission) = change(&manifest[MANIFEST_TEXT]) {
        writer.add_metadata(MANIFEST, BTreeMap::from([(MANIFEST_TEXT.to_owned(), mission)]));
    }
    let topics: Vec<_> = bag.topics().iter().map(|topic| writer.add_topic(&topic.topic).unwrap()).collect();
    let mut messages = bag.messages(&Filter::default()).unwrap();
    while let Some(message) = messages.next().unwrap() {
        writer.copy(topics[message.topic], &message).unwrap();
    }
    writer.close().unwrap();
}

#[test]
fn a_flight_that_went_another_way_than_its_manifest_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let changed = folder.path().join("changed");
    copy_with_manifest(&changed, |mission| Some(mission.replacen("k1 = 0.25", "k1 = 0.24", 1)));
    let output: Output = common::run(&mut swath(&["refly", text(&changed)]));
    assert_eq!(output.status.code(), Some(1));
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(said.contains("first difference: decision 0"), "{said}");

    let none = folder.path().join("none");
    copy_with_manifest(&none, |_| None);
    let said = common::fail(&mut swath(&["refly", text(&none)]));
    assert!(said.contains("holds no mission: no metadata record swath_manifest"), "{said}");
    let said = common::fail(&mut swath(&["report", text(&sample()), "--namespace", "/other"]));
    assert!(said.contains("the bag has no topic /other/guidance/decision_point"), "{said}");
}

#[test]
fn what_operators_did_in_flight_is_flown_again() {
    let folder = tempfile::tempdir().unwrap();
    let mission = common::write_mission(folder.path(), "orbits = 8.0\n[requests.random]\ncount = [200, 200]\n");
    let out = folder.path().join("out");
    let domain = common::domain();
    let mut launch = common::command("swath", &domain);
    launch.arg("launch").arg(mission).arg("--out").arg(&out).stdout(Stdio::null());
    let mut launch = common::Running::start(&mut launch);
    let tasks = out.join("tasks.jsonl");
    while !fs::read_to_string(&tasks).is_ok_and(|lines| lines.lines().count() > 3) {
        assert!(launch.runs(), "the mission ended early");
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    let requests = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/requests");
    let operate = |words: &[&str], numbers: std::ops::Range<u32>| {
        // Some come too late for their strip and are refused: the mission flies on.
        let numbers = numbers.map(|number| number.to_string());
        common::run(common::command("swath", &domain).args(words).args(numbers));
    };
    operate(&["strips", "hold"], 100..120);
    operate(&["strips", "release"], 100..110);
    operate(&["strips", "cancel", "--reason", "clouds"], 120..140);
    operate(&["planner", "mode", "approve"], 0..0);
    operate(&["planner", "mode", "autonomous"], 0..0);
    for file in ["coasts.geojson", "rivers.geojson"] {
        operate(&["strips", "submit", text(&requests.join(file))], 0..0);
    }
    operate(&["strips", "replace", "160", text(&requests.join("replacement.geojson"))], 0..0);
    assert!(launch.wait().success());
    let bag = out.join("bag");
    let (actions, operators) = Recorded::open(&bag, None).unwrap().actions().unwrap();
    let late = actions.iter().filter(|action| !action.initial).count();
    assert!(late > 10 && late < actions.len(), "{late} of {}", actions.len());
    for (what, found) in [
        ("cancelled", actions.iter().any(|it| matches!(it.act, Act::Cancel(_)))),
        ("held", actions.iter().any(|it| matches!(it.act, Act::Review(_, Review::Hold)))),
        ("released", actions.iter().any(|it| matches!(it.act, Act::Review(_, Review::Release)))),
        ("set to approve", operators.iter().any(|it| it.act == Act::SetMode(Mode::Approve))),
    ] {
        assert!(found, "nothing was {what}");
    }
    let again = folder.path().join("again.jsonl");
    common::succeed(&mut swath(&["refly", text(&bag), "--tasks", text(&again)]));
    assert_eq!(fs::read_to_string(again).unwrap(), fs::read_to_string(tasks).unwrap());
}

#[test]
fn exports_are_read_by_others() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("export");
    common::succeed(&mut swath(&["export", text(&sample()), "-o", text(&out), "--step", "10"]));
    let read = common::succeed(&mut common::python("read_export.py", text(&out)));
    let read: Value = serde_json::from_str(&read).unwrap();
    let recorded = Recorded::open(&sample(), None).unwrap();
    let imaged = recorded.imaged().len() as u64;
    assert_eq!(read["tasks"].as_u64().unwrap(), recorded.tasks.len() as u64, "{read}");
    assert_eq!(read["imaged"].as_u64().unwrap(), imaged);
    let reward: f64 = recorded.tasks.iter().map(|(task, _)| task.reward).sum();
    assert!((read["reward"].as_f64().unwrap() - reward).abs() < 1e-9);
    // 0.3 orbits are 1710.5 s: 3421 ticks and the state at the epoch; a point every ten seconds and the last.
    assert_eq!(read["states"], 3422);
    assert_eq!(read["decisions"].as_u64().unwrap(), recorded.decisions.len() as u64);
    assert_eq!(read["track_points"], 173);
    assert_eq!(read["strips"].as_u64().unwrap(), recorded.last_events().len() as u64);
    assert_eq!(read["completed"].as_u64().unwrap(), imaged);
    assert!(read["largest_track_difference_deg"].as_f64().unwrap() < 1e-6, "{read}");
    assert!(read["largest_attitude_difference"].as_f64().unwrap() < 1e-9, "{read}");
    let ccsds = |key: &str| read["ccsds"][key].as_f64().unwrap();
    assert!(ccsds("place_m") < 2e-3 && ccsds("speed_km_s") < 1e-4 && ccsds("turn") < 1e-11, "{read}");

    let only = folder.path().join("only");
    common::succeed(&mut swath(&["export", text(&sample()), "-o", text(&only), "--format", "czml"]));
    let files: Vec<_> = fs::read_dir(&only).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(files, ["mission.czml"]);
}

/// Measures the page in the page: what is drawn in each figure, and what is too wide.
const MEASURE: &str = r##"<pre id="found"></pre><script>
const found = {};
for (const figure of document.querySelectorAll('figure')) {
  const shapes = [...figure.querySelectorAll('svg > :not(text)')].filter(s => s.getBBox().width + s.getBBox().height > 0);
  const colours = {};
  for (const shape of shapes) {
    for (const colour of [shape.getAttribute('stroke'), shape.getAttribute('fill')]) {
      colours[colour] = (colours[colour] || 0) + 1;
    }
  }
  const box = figure.querySelector('svg').getBoundingClientRect();
  found[figure.id] = { shapes: shapes.length, colours, width: box.width, height: box.height,
    texts: [...figure.querySelectorAll('text')].map(t => t.textContent.trim()) };
}
found.tasks = document.querySelectorAll('#tasks tr').length - 1;
found.decisions = document.querySelectorAll('#decisions details').length;
found.chosen = document.querySelectorAll('#decisions tr.chosen').length;
found.overflow = document.documentElement.scrollWidth > window.innerWidth;
document.getElementById('found').textContent = JSON.stringify(found);
</script>"##;

/// A page as headless Chromium shows it.
fn dom(page: &Path) -> String {
    let named = std::env::var("SWATH_CHROMIUM").ok();
    let names = ["chromium", "chromium-browser", "google-chrome"].map(str::to_owned);
    let mut names = named.into_iter().chain(names);
    let runs = |name: &String| Command::new(name).arg("--version").output().is_ok_and(|output| output.status.success());
    let Some(chromium) = names.find(runs) else {
        panic!("no Chromium to look at the report with: apt-get install chromium, or set SWATH_CHROMIUM")
    };
    let profile = tempfile::tempdir().unwrap();
    let mut command = Command::new(chromium);
    command.args(["--headless", "--no-sandbox", "--disable-gpu", "--window-size=1200,900", "--dump-dom"]);
    command.arg(format!("--user-data-dir={}", profile.path().display())).arg(format!("file://{}", page.display()));
    common::succeed(command.stderr(Stdio::null()))
}

#[test]
fn the_report_shows_what_was_flown() {
    let folder = tempfile::tempdir().unwrap();
    let report = folder.path().join("report.html");
    common::succeed(&mut swath(&["report", text(&sample()), "-o", text(&report)]));
    let page = fs::read_to_string(&report).unwrap();
    for outside in ["src=", "href=", "url(", "@import", "<script"] {
        assert!(!page.contains(outside), "the page asks for something outside: {outside}");
    }
    let policy =
        "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'\">";
    assert!(page.contains(policy));
    // Our own policy would keep the measuring script from running.
    let measured = folder.path().join("measured.html");
    fs::write(&measured, page.replace(policy, "").replace("</body>", &format!("{MEASURE}</body>"))).unwrap();
    let dom = dom(&measured);
    let found = dom.split("<pre id=\"found\">").nth(1).unwrap().split("</pre>").next().unwrap();
    let found: Value = serde_json::from_str(&found.replace("&gt;", ">").replace("&amp;", "&")).unwrap();

    let recorded = Recorded::open(&sample(), None).unwrap();
    let count = |figure: &str, colour: &str| found[figure]["colours"][colour].as_u64().unwrap_or(0);
    let imaged = recorded.imaged().len() as u64;
    let (green, red, amber, blue) = ("#2CA02C", "#D62728", "#FFBB58", "#1F77B4");
    assert!(count("map", green) >= imaged, "a line for each strip that was imaged: {found}");
    assert!(count("map", "#E8E4DA") > 100, "land");
    assert!((1..=3).contains(&count("map", blue)), "the ground track, cut at the antimeridian");
    assert_eq!(count("timeline", green), imaged, "a bar for each strip that was imaged");
    let transitions = recorded.tasks.iter().filter(|(task, _)| task.record.t_pre > 0).count() as u64;
    assert_eq!(count("timeline", amber), transitions);
    assert_eq!(count("timeline", red), recorded.tasks.len() as u64 - imaged);
    for figure in ["attitude", "wheel-speed", "wheel-torque", "reward", "requests"] {
        assert!(count(figure, blue) > 0, "{figure}: {found}");
        assert!(found[figure]["width"].as_f64().unwrap() > 1000.0 && found[figure]["height"].as_f64().unwrap() > 200.0);
    }
    for (figure, name) in [("wheel-speed", "limit"), ("attitude", "limit while imaging"), ("requests", "completed")] {
        let texts = found[figure]["texts"].as_array().unwrap();
        assert!(texts.iter().any(|text| text == name), "{figure}: {texts:?}");
    }
    assert_eq!(found["tasks"], recorded.tasks.len());
    assert_eq!(found["decisions"], recorded.offers.len());
    assert_eq!(found["chosen"], recorded.tasks.len(), "every task here is a strip");
    assert_eq!(found["overflow"], false);
}
