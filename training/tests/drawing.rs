//! `swath-train figures` on what runs and evaluations leave.

use crate::case::{Case, STRIPS, TOY, succeeded};

fn drawn(case: &Case, name: &str) -> String {
    std::fs::read_to_string(case.path(&format!("out/figures/{name}.svg"))).unwrap()
}

/// A case with evaluations of the same planners, plain and on plants, and of other densities.
fn evaluated() -> Case {
    let case = Case::new(STRIPS);
    let planners =
        ["evaluate", "--planner", "heuristic:90", "--planner", "random", "--episodes", "2", "--orbits", "0.5"];
    for (file, more) in [
        ("plain.json", &["--requests", "800"][..]),
        ("dense.json", &["--requests", "1600"]),
        ("range.json", &["--requests", "300..400"]),
        ("plants.json", &["--requests", "900", "--plant", "none", "--plant", "torque-10%"]),
        ("one-plant.json", &["--requests", "950", "--plant", "none"]),
    ] {
        succeeded(&case.run(&[&planners[..], more, &["--json", file]].concat()));
    }
    case
}

#[test]
fn evaluations_with_and_without_plants_are_drawn_with_labels_of_their_own() {
    let case = evaluated();
    let figures = ["figures", "--evaluation", "plain=plain.json", "--evaluation", "plants=plants.json"];
    let densities = ["--density", "plain.json", "--density", "dense.json", "--density", "range.json"];
    succeeded(&case.run(&[&figures[..], &densities, &["--density", "one-plant.json"]].concat()));
    let plants = drawn(&case, "plants");
    for label in ["heuristic:90, none", "random, none", "heuristic:90, torque-10%", "random, torque-10%"] {
        assert_eq!(plants.matches(&format!("\n{label}\n")).count(), 1, "{label}");
    }
    assert!(!drawn(&case, "plain").contains(", none"));
    let densities = drawn(&case, "fig5");
    for group in ["800", "1600", "300 to 400", "950"] {
        assert_eq!(densities.matches(&format!("\n{group}\n")).count(), 4, "{group} under each of four panels");
    }
    let twice = case.run(&["figures", "--density", "plain.json", "--density", "plain.json"]);
    case.refused(&twice, &["plain.json is not the only one of 800 strips"]);
    let other = case.run(&["figures", "--density", "plain.json", "--density", "plants.json"]);
    case.refused(&other, &["plain.json and plants.json are not of the same planners"]);
}

#[test]
fn torn_lines_of_progress_are_told_and_left_out() {
    let case = Case::new(TOY);
    succeeded(&case.train(&[]));
    let progress = case.path("out/toy-seed0/progress.jsonl");
    let whole = std::fs::read_to_string(&progress).unwrap();
    let draw = |curve: &str| case.run(&["figures", "--curve", &format!("toy={curve}")]);
    succeeded(&draw("out/toy-seed0/progress.jsonl"));
    let wanted = drawn(&case, "fig3");
    std::fs::write(&progress, format!("{whole}{{\"clip_fraction\":0.2,\"ent")).unwrap();
    let output = draw("out/toy-seed0/progress.jsonl");
    succeeded(&output);
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(told.contains("warning: line 11 of out/toy-seed0/progress.jsonl is torn and left out"), "{told}");
    assert_eq!(drawn(&case, "fig3"), wanted);
    case.refused(&draw("run.toml"), &["run.toml is no progress file"]);
}

#[test]
fn the_axis_names_the_length_of_an_episode_where_the_run_lies_beside_its_curve() {
    let case = Case::new(&STRIPS.replace("steps = 60", "steps = 120"));
    succeeded(&case.train(&[]));
    let draw = |file: &str| {
        succeeded(&case.run(&["figures", "--curve", &format!("strips={file}")]));
        drawn(&case, "fig3")
    };
    assert!(draw("out/strips-seed0/progress.jsonl").contains("reward per episode of 0.5 orbits"));
    std::fs::copy(case.path("out/strips-seed0/progress.jsonl"), case.path("alone.progress.jsonl")).unwrap();
    let alone = draw("alone.progress.jsonl");
    assert!(alone.contains("reward per episode") && !alone.contains("orbits"));
}

#[test]
fn names_stay_in_the_folder_and_nothing_to_draw_is_an_error() {
    let case = evaluated();
    case.refused(&case.run(&["figures"]), &["nothing to draw: give --curve, --evaluation or --density"]);
    assert!(!case.path("out/figures").exists());
    for name in ["../outside", "/tmp/outside", "a/b", ".hidden", ""] {
        let output = case.run(&["figures", "--evaluation", &format!("{name}=plain.json")]);
        assert_eq!(output.status.code(), Some(2), "{name}");
        assert!(String::from_utf8_lossy(&output.stderr).contains("a figure's name has letters"), "{name}");
    }
    let twice = case.run(&["figures", "--evaluation", "fig5=plain.json", "--density", "plain.json"]);
    case.refused(&twice, &["two figures are called fig5"]);
    std::fs::write(case.path("empty.json"), r#"{"missions":{"requests":[1,1]},"planners":[]}"#).unwrap();
    let empty = case.run(&["figures", "--evaluation", "a=empty.json"]);
    case.refused(&empty, &["empty.json holds no planner: there is nothing to draw"]);
    std::fs::write(case.path("early.jsonl"), "{\"steps\":40,\"return\":null}\n").unwrap();
    let early = case.run(&["figures", "--curve", "early=early.jsonl"]);
    case.refused(&early, &["nothing to draw: curve early: no episode ended"]);
    succeeded(&case.run(&["figures", "--evaluation", "fig.4=plain.json"]));
    assert!(case.path("out/figures/fig.4.svg").exists() && case.path("out/figures/fig.4.png").exists());
}
