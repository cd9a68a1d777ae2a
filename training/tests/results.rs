//! What results rest on, what is no result, and what is told before the flying.

use std::path::Path;

use serde_json::Value;
use swath_sim::planner::PlannerSpec;
use swath_training::config::RunConfig;
use swath_training::planners;

use crate::case::{Case, STRIPS, TOY, succeeded};

const SHORT: [&str; 4] = ["--episodes", "2", "--orbits", "0.5"];

fn json(case: &Case, args: &[&str]) -> Value {
    let output = case.run(&[args, &SHORT, &["--json", "-"]].concat());
    succeeded(&output);
    serde_json::from_slice(&output.stdout).unwrap()
}

fn shipped(name: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("policies").join(name)
}

/// A satellite with weaker wheels.
const WEAK: &str = "[spacecraft]\nwheel_torque_max_nm = 0.25\n";

#[test]
fn every_json_names_program_configuration_and_policies() {
    let case = Case::new(TOY);
    std::fs::write(case.path("weak.toml"), WEAK).unwrap();
    let planners = ["evaluate", "--planner", "hop-ppo", "--planner", "heuristic:90"];
    let evaluated = json(&case, &planners);
    let on_plants = json(&case, &[&planners[..], &["--plant", "torque-10%"]].concat());
    let swept = json(&case, &["sweep", "--simulation", "weak.toml"]);
    let planned = json(&case, &["ground-plan", "--width", "1", "--branches", "2"]);
    for whole in [&evaluated, &on_plants, &swept, &planned] {
        assert_eq!(whole["program"]["name"], "swath-train");
        assert_eq!(whole["program"]["version"], env!("CARGO_PKG_VERSION"));
        assert!(whole["program"]["revision"].is_string());
        assert_eq!(whole["configuration"]["episode"]["orbits"], 0.5);
        assert_eq!(whole["configuration"]["episode"]["scenario"]["count"], serde_json::json!([2000, 5000]));
        assert_eq!(whole["configuration"]["simulation"]["control"]["k1"], 0.25);
    }
    let torque = |whole: &Value| whole["configuration"]["simulation"]["spacecraft"]["wheel_torque_max_nm"].clone();
    assert_eq!((torque(&evaluated), torque(&swept)), (0.3.into(), 0.25.into()));
    assert_eq!(on_plants["plants"][0]["errors"]["torque_limit_scale"], 0.9);
    let digest = planners::digest(&"hop-ppo".parse().unwrap()).unwrap().unwrap();
    for whole in [&evaluated, &on_plants] {
        let policies = whole["policies"].as_array().unwrap();
        assert_eq!(policies.len(), 1);
        assert_eq!(policies[0]["planner"], "hop-ppo");
        assert_eq!(policies[0]["sha256"], digest.as_str());
        assert_eq!((&policies[0]["run"], &policies[0]["steps"]), (&"compact-hop-ppo-warm".into(), &507_904.into()));
        assert_eq!(policies[0]["other_satellite"], serde_json::json!([]));
    }
    assert_eq!((&swept["policies"], &planned["policies"]), (&serde_json::json!([]), &serde_json::json!([])));
}

#[test]
fn strips_asked_for_and_reachable_are_counted_apart() {
    let case = Case::new(TOY);
    let whole = json(&case, &["evaluate", "--planner", "heuristic:90", "--requests", "1000"]);
    let planner = &whole["planners"][0];
    for mission in planner["missions"].as_array().unwrap() {
        assert_eq!(mission["requests"], 1000);
        let reachable = mission["reachable"].as_u64().unwrap();
        assert!((100..900).contains(&reachable), "{reachable}");
    }
    assert_eq!(planner["requests"]["mean"], 1000.0);
    assert_eq!(planner["by_density"][0]["requests"], serde_json::json!([1000, 1999]));
    let table = case.run(&[&["evaluate", "--planner", "heuristic:90", "--requests", "1000"], &SHORT[..]].concat());
    succeeded(&table);
    let text = String::from_utf8(table.stdout).unwrap();
    let reachable = planner["reachable"]["mean"].as_f64().unwrap();
    assert!(text.ends_with(&format!("strips a mission: 1000.0 asked for, {reachable:.1} reachable\n")), "{text}");
}

#[test]
fn what_is_no_result_is_told_with_exit_code_1() {
    let case = Case::new(TOY);
    let refused = |args: &[&str], text: &str| case.refused(&case.run(&[args, &SHORT].concat()), &[text]);
    let nothing = "there is no result: nothing was attempted in any mission: at most 0 strips were asked for";
    refused(&["evaluate", "--planner", "random", "--requests", "0"], nothing);
    refused(&["sweep", "--requests", "0"], nothing);
    refused(&["ground-plan", "--requests", "0"], nothing);
    let last = u64::MAX.to_string();
    refused(&["evaluate", "--planner", "random", "--seed", &last], "which is not at most 18446744073709551614");
    refused(&["sweep", "--seed", &last], "the seeds of all 2 missions follow each other");
    refused(&["ground-plan", "--seed", &last], "seed of the first mission is 18446744073709551615");
    case.refused(
        &case.train(&["--seed", &last]),
        &["seed is 18446744073709551615, which is not in 0 to 9223372036854775807"],
    );
    let none = Case::new(&STRIPS.replace("[300, 300]", "[0, 0]"));
    none.refused(&none.train(&[]), &["asks for 0 strips, and none can be reached within its 0.5 orbits"]);
}

#[test]
fn what_is_unknown_is_a_dash_and_null_and_never_nan() {
    let case = Case::new(TOY);
    let args = ["evaluate", "--planner", "random", "--requests", "2", "--episodes", "4", "--orbits", "1"];
    let table = case.run(&args);
    succeeded(&table);
    let table = String::from_utf8(table.stdout).unwrap();
    assert!(
        !table.contains("NaN") && table.lines().any(|line| line.starts_with("random") && line.contains(" -")),
        "{table}"
    );
    let output = case.run(&[&args[..], &["--json", "-"]].concat());
    let whole: Value = serde_json::from_slice(&output.stdout).unwrap();
    let missions = whole["planners"][0]["missions"].as_array().unwrap();
    assert!(missions.iter().any(|it| it["attempts_per_orbit"] == 0.0 && it["t_pre_s"].is_null()), "{missions:?}");
    assert!(whole["planners"][0]["t_pre_s"]["mean"].is_number(), "over the missions that have it");
    let one = case.run(&["evaluate", "--planner", "random", "--episodes", "1", "--orbits", "0.5", "--json", "-"]);
    let whole: Value = serde_json::from_slice(&one.stdout).unwrap();
    let reward = &whole["planners"][0]["reward_per_orbit"];
    assert!(reward["mean"].is_number() && reward["deviation"].is_null() && reward["confidence_95"].is_null());
}

#[test]
fn json_that_cannot_be_written_is_told_before_the_flying() {
    let case = Case::new(TOY);
    let long = ["--episodes", "1000000"];
    for command in [&["evaluate", "--planner", "beam"][..], &["sweep"], &["ground-plan"]] {
        case.refused(
            &case.run(&[command, &long, &["--json", "nowhere/x.json"]].concat()),
            &["cannot write nowhere/x.json"],
        );
        case.refused(&case.run(&[command, &long, &["--json", "."]].concat()), &["cannot write ."]);
    }
    let there = case.path("there.json");
    std::fs::write(&there, "before").unwrap();
    let failing = ["evaluate", "--planner", "random", "--requests", "0", "--episodes", "1", "--json"];
    case.refused(&case.run(&[&failing[..], &["there.json"]].concat()), &["there is no result"]);
    case.refused(&case.run(&[&failing[..], &["new.json"]].concat()), &["there is no result"]);
    assert_eq!(std::fs::read_to_string(&there).unwrap(), "before", "what is there stays when there is no result");
    assert!(!case.path("new.json").exists());
    succeeded(&case.run(&[
        "evaluate",
        "--planner",
        "random",
        "--episodes",
        "1",
        "--orbits",
        "0.5",
        "--json",
        "there.json",
    ]));
    serde_json::from_slice::<Value>(&std::fs::read(&there).unwrap()).unwrap();
}

#[test]
fn a_policy_on_another_satellite_is_told() {
    let case = Case::new(TOY);
    std::fs::write(case.path("weak.toml"), WEAK).unwrap();
    let evaluate = |more: &[&str]| case.run(&[&["evaluate", "--planner", "hop-ppo"], more, &SHORT[..]].concat());
    let own = evaluate(&[]);
    succeeded(&own);
    assert_eq!(String::from_utf8_lossy(&own.stderr), "");
    let other = evaluate(&["--simulation", "weak.toml", "--json", "-"]);
    succeeded(&other);
    let text = "warning: hop-ppo was trained on another satellite: spacecraft.wheel_torque_max_nm was 0.3 there and is 0.25 here";
    assert_eq!(String::from_utf8_lossy(&other.stderr).trim_end(), text);
    let whole: Value = serde_json::from_slice(&other.stdout).unwrap();
    let teacher = "[warm_start]\ndecisions = 30\nlearning_rate = 1e-3\nteacher = \"hop-ppo\"\n";
    let weak = WEAK.replace("[spacecraft]", "[environment.simulation.spacecraft]");
    let taught = Case::new(&format!("{STRIPS}{weak}{teacher}"));
    let output = taught.train(&["--stop-after", "0"]);
    succeeded(&output);
    assert!(String::from_utf8_lossy(&output.stderr).contains(text), "the teacher too");
    let missing = Case::new(&format!("{STRIPS}{}", teacher.replace("hop-ppo", "hop-ppo:none")));
    missing.refused(&missing.train(&[]), &["cannot make the teacher: cannot read none"]);
    let wanted = serde_json::json!([{ "setting": "spacecraft.wheel_torque_max_nm", "trained": 0.3, "flown": 0.25 }]);
    assert_eq!(whole["policies"][0]["other_satellite"], wanted);
}

#[test]
fn the_satellite_is_read_from_a_mission_too() {
    let case = Case::new(TOY);
    let mission = format!("name = \"m\"\norbits = 3.0\n{}", WEAK.replace("[spacecraft]", "[sim.spacecraft]"));
    std::fs::write(case.path("mission.toml"), mission).unwrap();
    std::fs::write(case.path("weak.toml"), WEAK).unwrap();
    let flown = |file: &str| json(&case, &["evaluate", "--planner", "heuristic:90", "--simulation", file]);
    assert_eq!(flown("mission.toml"), flown("weak.toml"));
    let refused = |text: &str, wanted: &[&str]| {
        std::fs::write(case.path("bad.toml"), text).unwrap();
        let output = case.run(&["evaluate", "--planner", "random", "--simulation", "bad.toml"]);
        case.refused(&output, wanted);
    };
    refused("orbits = 3.0\n", &["bad.toml is not valid: --simulation takes the tables of a mission's [sim] section"]);
    refused("[sim.spacecraft]\nwheels = 4\n", &["[sim] of mission bad.toml is not valid", "unknown field `wheels`"]);
    refused("[control]\nk1 = 0.0\n", &["bad.toml is not valid: control.k1 is 0, outside"]);
    refused("[control]\nservo_p = 0.0\n", &["bad.toml is not valid: control.servo_p is 0, outside"]);
    refused(
        "[spacecraft]\ninertia_kg_m2 = [10.0, 20.0, 40.0]\n",
        &["bad.toml is not valid: spacecraft.inertia_kg_m2[2] is 40, more than the other two together, 30"],
    );
}

#[test]
fn help_names_every_planner() {
    let case = Case::new(TOY);
    let help = case.run(&["evaluate", "--help"]);
    let help = String::from_utf8(help.stdout).unwrap().split_whitespace().collect::<Vec<_>>().join(" ");
    for name in [
        "random",
        "heuristic:SECONDS",
        "lookahead",
        "lookahead:TICKS",
        "beam",
        "beam:WIDTHxDEPTH",
        "repair",
        "repair:TICKS",
        "aspen",
        "hop-ppo",
        "hop-ppo-mlp",
        "h-ppo",
        "discrete-ppo",
        "+lookahead",
        ":FILE",
    ] {
        assert!(help.contains(name), "{name} is not in {help}");
        let spelt = name.replace("SECONDS", "90").replace("TICKS", "4").replace("WIDTHxDEPTH", "4x2");
        if !name.starts_with(['+', ':']) {
            spelt.parse::<PlannerSpec>().unwrap();
        }
    }
}

/// The command after `swath-train train` on a policy's card.
fn command_on_card(card: &str) -> Vec<Vec<String>> {
    let lines = card.lines().filter_map(|line| line.strip_prefix("swath-train train "));
    lines.map(|line| line.split_whitespace().map(str::to_owned).collect()).collect()
}

#[test]
fn every_shipped_policy_can_be_made_again_by_the_command_on_its_card() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    for name in ["hop_ppo", "hop_ppo_scratch", "hop_ppo_mlp", "h_ppo", "discrete_ppo"] {
        let card = std::fs::read_to_string(shipped(&format!("{name}.md"))).unwrap();
        let commands = command_on_card(&card);
        // The last command is what the policy was trained as in the end.
        let last = commands.last().unwrap();
        let option = |key: &str| last.iter().position(|word| word == key).map(|at| last[at + 1].as_str());
        let mut run = RunConfig::load(&root.join(option("--config").unwrap())).unwrap();
        run.steps = option("--steps").map_or(run.steps, |steps| steps.parse().unwrap());
        run.seed = option("--seed").map_or(run.seed, |seed| seed.parse().unwrap());
        assert_eq!(run, RunConfig::load(&shipped(&format!("{name}.run.toml"))).unwrap(), "{name}.run.toml");
        let policy = swath_training::policy::Policy::load(&shipped(&format!("{name}.safetensors"))).unwrap();
        assert_eq!(&run, policy.run(), "{name}.safetensors");
        assert!(card.contains(policy.digest()), "the card of {name} names {}", policy.digest());
    }
}

/// A campaign in parts is the campaign in one piece, whatever their number and order.
#[test]
fn parts_are_merged_into_what_one_piece_gives() {
    let case = Case::new(TOY);
    let campaigns: [&[&str]; 4] = [
        &["evaluate", "--planner", "heuristic:80", "--planner", "beam"],
        &["evaluate", "--planner", "random", "--plant", "none", "--plant", "torque-10%"],
        &["sweep"],
        &["ground-plan", "--width", "1", "--branches", "2"],
    ];
    let size = ["--episodes", "3", "--orbits", "0.3", "--seed", "3"];
    for campaign in campaigns {
        succeeded(&case.run(&[campaign, &size, &["--json", "whole.json"]].concat()));
        let table = case.run(&[campaign, &size].concat());
        let shares: &[u64] = if *campaign == ["sweep"] { &[1, 2, 3] } else { &[2] };
        for &of in shares {
            let parts: Vec<String> = (1..=of).rev().map(|number| format!("part-{number}-{of}.json")).collect();
            for (number, part) in (1..=of).rev().zip(&parts) {
                let shard = format!("{number}/{of}");
                succeeded(&case.run(&[campaign, &size, &["--shard", &shard, "--json", part]].concat()));
            }
            let parts: Vec<&str> = parts.iter().map(String::as_str).collect();
            let merged = case.run(&[&["merge", "--json", "merged.json"], &parts[..]].concat());
            succeeded(&merged);
            let read = |name: &str| std::fs::read(case.path(name)).unwrap();
            assert_eq!(read("merged.json"), read("whole.json"), "{campaign:?} in {of}");
            assert_eq!(merged.stdout, table.stdout, "{campaign:?} in {of}");
        }
    }
}

#[test]
fn parts_that_are_missing_double_or_foreign_are_named() {
    let case = Case::new(TOY);
    let part = |shard: &str, name: &str, more: &[&str]| {
        let words = ["evaluate", "--planner", "heuristic:80", "--episodes", "4", "--orbits", "0.2", "--shard", shard];
        succeeded(&case.run(&[&words, more, &["--json", name]].concat()));
    };
    for number in 1..=4 {
        part(&format!("{number}/4"), &format!("{number}.json"), &[]);
    }
    part("2/4", "other.json", &["--requests", "2500"]);
    part("2/3", "thirds.json", &[]);
    std::fs::write(case.path("no.json"), "{}").unwrap();
    let refused = |parts: &[&str], text: &str| {
        let output = case.run(&[&["merge"], parts].concat());
        assert_eq!(output.status.code(), Some(1));
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(said.contains(text), "{said}");
    };
    refused(&["1.json", "3.json"], "2 of 4 shards are missing: 2/4, 4/4");
    refused(&["1.json", "2.json", "1.json"], "shard 1/4 is there twice: 1.json and 1.json");
    let foreign = "other.json is of another campaign: head.configuration.episode.scenario.count is [2500,2500] there and \
                   [2000,5000] in 1.json";
    refused(&["1.json", "other.json", "3.json", "4.json"], foreign);
    refused(&["1.json", "thirds.json"], "thirds.json is of another campaign: shards is 3 there and 4 in 1.json");
    refused(&["1.json", "no.json"], "no.json is no part of a campaign");
    refused(&["1.json", "nowhere.json"], "cannot read nowhere.json");
    for (shard, text) in [("5/4", "`5/4` is no share: expected I/N with I from 1 to N"), ("0/2", "`0/2` is no share")] {
        let output = case.run(&["sweep", "--shard", shard, "--json", "part.json"]);
        assert_eq!(output.status.code(), Some(2));
        assert!(String::from_utf8(output.stderr).unwrap().contains(text));
    }
    assert_eq!(case.run(&["sweep", "--shard", "1/2"]).status.code(), Some(2), "a part needs a file");
}
