//! Habits of operators: `head`, Ctrl-C, a second try, files instead of terminals, `--help`.

use std::path::Path;
use std::process::{Command, Stdio};

use serde_json::Value;

use crate::common;

const NODES: [&str; 4] = ["swath-spacecraft", "swath-guidance", "swath-planner", "swath-requests"];

/// Runs a command whose output nobody reads; its exit code, and what it says on stderr where that is read.
fn unread(command: &mut Command, stderr_too: bool) -> (Option<i32>, String) {
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    drop(child.stdout.take());
    if stderr_too {
        drop(child.stderr.take());
    }
    let output = child.wait_with_output().unwrap();
    (output.status.code(), String::from_utf8(output.stderr).unwrap())
}

fn summary(out: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(out.join("summary.json")).unwrap()).unwrap()
}

#[test]
fn that_nobody_reads_on_ends_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let mission = common::write_mission(folder.path(), "orbits = 0.1\nplanner = \"heuristic:90\"\n");
    let sample = Path::new(env!("CARGO_MANIFEST_DIR")).join("../bags/samples/mission");
    let evaluate = ["evaluate", "--planner", "heuristic:90", "--episodes", "2", "--orbits", "0.1"];
    let mut commands = vec![
        common::swath("0", &["graph"]),
        common::swath("0", &["refly", sample.to_str().unwrap()]),
        common::command("swath-train", "0"),
        common::command("swath-bag", "0"),
        common::command("swath-bag", "0"),
    ];
    commands[2].args(evaluate);
    commands[3].arg("cat").arg(&sample);
    commands[4].arg("filter").arg(&sample).arg("-o").arg(folder.path().join("filtered"));
    for command in &mut commands {
        assert_eq!(unread(command, false), (Some(0), String::new()), "{command:?}");
    }
    for (out, words) in [("in_process", &["--in-process"][..]), ("over_dds", &[])] {
        let out = folder.path().join(out);
        let mut launch = common::swath(&common::domain(), &["launch", mission.to_str().unwrap()]);
        let (code, _) = unread(launch.args(words).arg("--out").arg(&out), true);
        assert_eq!(code, Some(0), "{out:?}");
        assert_eq!(summary(&out)["failure"], Value::Null);
    }
}

#[test]
fn a_submission_goes_on_when_its_report_is_not_read() {
    let folder = tempfile::tempdir().unwrap();
    let mission = common::write_mission(folder.path(), "orbits = 2.0\npace = 20.0\nplanner = \"heuristic:90\"\n");
    let strips: Vec<String> = (0..1200)
        .map(|n| {
            let (longitude, latitude) = (f64::from(n % 60) * 5.0 - 150.0, f64::from(n / 60) * 5.0 - 50.0);
            format!(
                r#"{{"type":"Feature","properties":{{"name":"s{n}"}},"geometry":{{"type":"LineString","coordinates":[[{longitude},{latitude}],[{},{}]]}}}}"#,
                longitude + 1.0,
                latitude + 1.0
            )
        })
        .collect();
    let file = folder.path().join("strips.geojson");
    std::fs::write(&file, format!(r#"{{"type":"FeatureCollection","features":[{}]}}"#, strips.join(","))).unwrap();
    let domain = common::domain();
    let mut launch = common::swath(&domain, &["launch", mission.to_str().unwrap(), "--no-bag", "--out"]);
    let mut flight = common::Running::start(launch.arg(folder.path().join("out")));
    common::until("the request manager", || {
        let listed = common::run(&mut common::swath(&domain, &["strips", "list"]));
        listed.status.success().then_some(())
    });
    let (_, stderr) = unread(&mut common::swath(&domain, &["strips", "submit", file.to_str().unwrap()]), false);
    assert!(!stderr.contains("panicked"), "{stderr}");
    let listed = common::succeed(&mut common::swath(&domain, &["strips", "list", "--limit", "0", "--json"]));
    // Some have no window; a call carries 500.
    let of_last_call = |strip: &Value| strip["name"].as_str().unwrap()[1..].parse::<u32>().unwrap() >= 1000;
    let last = common::json_lines(&listed).iter().any(of_last_call);
    assert!(last, "the last strips are missing: {} lines", listed.lines().count());
    let list = &["strips", "list", "--limit", "0"];
    assert_eq!(unread(&mut common::swath(&domain, list), false), (Some(0), String::new()));
    let strips = common::json_lines(&listed);
    let latest = strips.iter().max_by_key(|strip| strip["window_open"].as_str().unwrap_or_default()).unwrap();
    let preview = &["strips", "preview", "--id", &latest["id"].to_string(), "--hours", "0.001"];
    let preview = common::succeed(&mut common::swath(&domain, preview));
    assert!(preview.ends_with(": no chance in the next 0.001 h\n"), "{preview}");
    flight.stop();
}

#[test]
fn an_interrupted_mission_leaves_its_summary_tasks_and_bag() {
    let folder = tempfile::tempdir().unwrap();
    let mission = common::write_mission(
        folder.path(),
        "orbits = 5.0\npace = 200.0\nplanner = \"heuristic:90\"\n[requests.random]\ncount = [1500, 1500]\n",
    );
    let (out, domain) = (folder.path().join("out"), common::domain());
    let mut launch = common::swath(&domain, &["launch", mission.to_str().unwrap(), "--out", out.to_str().unwrap()]);
    let mut flight = common::Running::start(launch.stderr(Stdio::null()).stdout(Stdio::null()));
    let tasks = || std::fs::read_to_string(out.join("tasks.jsonl")).unwrap_or_default().lines().count();
    common::until("the third task", || (tasks() >= 3).then_some(()));
    flight.stop();
    let summary = summary(&out);
    assert_eq!(summary["failure"], "interrupted");
    assert!(
        summary["sim_seconds"].as_f64().unwrap() > 100.0 && summary["attempts"].as_u64().unwrap() >= 1,
        "{summary}"
    );
    assert!(summary["messages_recorded"].as_u64().unwrap() > 0, "{summary}");
    common::succeed(common::command("swath-bag", &domain).arg("validate").arg(out.join("bag")));
}

#[test]
fn what_was_not_flown_leaves_no_folder_in_the_way() {
    let folder = tempfile::tempdir().unwrap();
    let mission = common::write_mission(folder.path(), "orbits = 0.05\nplanner = \"heuristic:90\"\n");
    let out = folder.path().join("out");
    let words = ["launch", mission.to_str().unwrap(), "--out", out.to_str().unwrap()];
    let error = common::fail(&mut common::swath("9999", &words));
    assert!(error.starts_with("error: ") && error.lines().count() == 1, "{error}");
    assert!(!out.exists());
    std::fs::create_dir(&out).unwrap();
    common::fail(&mut common::swath("9999", &words));
    assert_eq!(std::fs::read_dir(&out).unwrap().count(), 0);
    common::succeed(common::swath("0", &words).arg("--in-process"));
}

#[test]
fn a_missing_policy_is_told_by_summary_and_exit_code() {
    let folder = tempfile::tempdir().unwrap();
    let mission = common::write_mission(folder.path(), "orbits = 0.2\nplanner = \"hop-ppo:nowhere.safetensors\"\n");
    for (out, words) in [("in_process", &["--in-process"][..]), ("over_dds", &["--no-bag"])] {
        let out = folder.path().join(out);
        let mut launch = common::swath(&common::domain(), &["launch", mission.to_str().unwrap()]);
        let output = common::run(launch.args(words).arg("--out").arg(&out));
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(3), "{stderr}");
        assert!(stderr.contains("nowhere.safetensors") && stderr.contains("which was asked for"), "{stderr}");
        let summary = summary(&out);
        let deciders = summary["decided_instead"].as_object().unwrap();
        let names: Vec<_> = deciders.keys().collect();
        assert_eq!(names, ["heuristic:90"], "{summary}");
        assert!(deciders["heuristic:90"].as_u64().unwrap() > 0);
    }
}

#[test]
fn a_policy_on_another_satellite_is_told_once() {
    let folder = tempfile::tempdir().unwrap();
    let text = "orbits = 0.1\nplanner = \"hop-ppo\"\n[sim.spacecraft]\nwheel_torque_max_nm = 0.25\n";
    let mission = common::write_mission(folder.path(), text);
    for (out, words) in [("in_process", &["--in-process"][..]), ("over_dds", &["--no-bag"])] {
        let mut launch = common::swath(&common::domain(), &["launch", mission.to_str().unwrap()]);
        let output = common::run(launch.args(words).arg("--out").arg(folder.path().join(out)));
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.success(), "{stderr}");
        let told =
            "hop-ppo was trained on another satellite: spacecraft.wheel_torque_max_nm was 0.3 there and is 0.25 here";
        assert_eq!(stderr.matches(told).count(), 1, "{stderr}");
    }
}

#[test]
fn errors_are_told_once_and_without_colours() {
    for node in NODES {
        let mut command = common::command(node, &common::domain());
        let error = common::fail(command.args(["--ros-args", "-p", "mission:=nowhere.toml"]));
        assert_eq!(error.matches("cannot read mission nowhere.toml").count(), 1, "{error}");
        assert!(!error.contains('\x1b'), "{error:?}");
    }
    for (pace, told) in [("-1", "pace is -1, outside 0 to"), ("nan", "pace is NaN, outside 0 to")] {
        let folder = tempfile::tempdir().unwrap();
        let mission = common::write_mission(folder.path(), "");
        let words = ["launch", mission.to_str().unwrap(), "--in-process", "--pace", pace];
        let error = common::fail(common::swath("0", &words).current_dir(folder.path()));
        assert!(error.contains(told), "{error}");
    }
}

#[test]
fn help_names_every_planner() {
    let help = common::succeed(&mut common::swath("0", &["launch", "--help"]));
    let help = help.split_whitespace().collect::<Vec<_>>().join(" ");
    for name in
        ["random", "heuristic:SECONDS", "lookahead:TICKS", "beam:WIDTHxDEPTH", "repair:TICKS", "aspen", "-squeaky"]
    {
        assert!(help.contains(name), "{name} is not in {help}");
    }
    for name in ["hop-ppo", "hop-ppo-mlp", "h-ppo", "discrete-ppo", "+lookahead", ":FILE"] {
        assert!(help.contains(name), "{name} is not in {help}");
    }
}

/// What a node says of an unknown parameter names all that it has.
#[test]
fn help_names_every_parameter() {
    let folder = tempfile::tempdir().unwrap();
    let mission = common::write_mission(folder.path(), "orbits = 0.1\n");
    for node in NODES {
        let help = common::succeed(common::command(node, "0").arg("--help"));
        let mut wrong = common::command(node, &common::domain());
        wrong.args(["--ros-args", "-p", "nosuch:=1", "-p", &format!("mission:={}", mission.display())]);
        let error = common::fail(&mut wrong);
        let names = error.trim_end().rsplit_once("there are ").unwrap().1;
        let told = |name: &str| help.lines().any(|line| line.split_whitespace().next() == Some(name));
        let missing: Vec<_> = names.split(", ").filter(|name| !told(name)).collect();
        assert!(missing.is_empty(), "{node} --help does not tell of {missing:?}:\n{help}");
        let version = common::succeed(common::command(node, "0").arg("--version"));
        assert_eq!(version, format!("{node} {}\n", env!("CARGO_PKG_VERSION")));
    }
}

#[test]
fn a_store_has_one_request_manager_whatever_the_domain() {
    let folder = tempfile::tempdir().unwrap();
    let mission = common::write_mission(folder.path(), "orbits = 0.1\n");
    let store = folder.path().join("requests.sqlite");
    let manager = || {
        let mut command = common::command("swath-requests", &common::domain());
        let mission = format!("mission:={}", mission.display());
        command.args(["--ros-args", "-p", &mission, "-p", &format!("store:={}", store.display())]);
        command
    };
    let mut first = common::Running::start(&mut manager());
    common::until("the store", || store.exists().then_some(()));
    let error = common::fail(&mut manager());
    assert!(error.contains("requests.sqlite: another request manager writes it"), "{error}");
    first.stop();
}
