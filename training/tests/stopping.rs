//! Runs that are stopped at any moment, and folders that two runs want.

use std::path::Path;
use std::time::Duration;

use crate::case::{Case, STRIPS, TOY, checkpoints, progress_steps, succeeded};

/// A run is answered within this time whatever it is doing.
const PATIENCE: Duration = Duration::from_secs(5);

/// A toy whose updates, and lessons if it has a teacher, would take minutes.
fn endless(warm_start: &str) -> Case {
    let run = TOY.replace("steps = 400", "steps = 1_000_000_000").replace("batch = 40,", "batch = 4_000_000,");
    Case::new(&format!("{run}{warm_start}"))
}

fn run_is_described(folder: &Path) -> bool {
    folder.join("out/toy-seed0/run.toml").exists()
}

#[test]
fn ctrl_c_saves_and_the_run_goes_on_from_there() {
    let case = Case::new(&TOY.replace("steps = 400", "steps = 1_000_000_000"));
    let progress = case.path("out/toy-seed0/progress.jsonl");
    let mut run = case.start(&[], |_| !std::fs::read_to_string(&progress).unwrap_or_default().is_empty());
    run.signal(libc::SIGINT);
    assert_eq!(run.ends_within(PATIENCE), Some(0), "{}", case.stderr());
    assert!(case.stderr().contains("SIGINT: the run is saved as it was before this update"), "{}", case.stderr());
    let saved = checkpoints(&case.path("out/toy-seed0/checkpoints"));
    let steps = progress_steps(&progress);
    let last = steps.len() as u64 * 40;
    assert_eq!(saved.last().unwrap(), &format!("step-{last:012}.safetensors"));
    succeeded(&case.train(&["--resume", "--stop-after", &(last + 40).to_string()]));
    assert_eq!(progress_steps(&progress).last(), Some(&(last + 40)));
}

#[test]
fn a_signal_in_the_middle_of_an_update_is_answered_in_time_and_saves_what_was_before() {
    for (warm_start, saved) in [
        ("", "step-000000000000.safetensors"),
        ("warm_start = { decisions = 100_000_000, learning_rate = 1e-3 }\n", "lesson-000000000000.safetensors"),
    ] {
        let case = endless(warm_start);
        let mut run = case.start(&[], run_is_described);
        std::thread::sleep(Duration::from_millis(500));
        run.signal(libc::SIGTERM);
        assert_eq!(run.ends_within(PATIENCE), Some(0), "{}", case.stderr());
        assert!(case.stderr().contains("SIGTERM: the run is saved"), "{}", case.stderr());
        assert_eq!(checkpoints(&case.path("out/toy-seed0/checkpoints")), [saved]);
        let mut run = case.start(&["--resume"], |_| case.stderr().contains("going on from"));
        std::thread::sleep(Duration::from_millis(300));
        run.signal(libc::SIGINT);
        assert_eq!(run.ends_within(PATIENCE), Some(0), "{}", case.stderr());
    }
}

#[test]
fn a_warm_start_that_was_stopped_ends_with_the_same_policy_as_one_that_was_not() {
    let run = format!("{STRIPS}[warm_start]\ndecisions = 3000\nlearning_rate = 1e-3\nteacher = \"heuristic:90\"\n");
    let (whole, parts) = (Case::new(&run), Case::new(&run));
    succeeded(&whole.train(&[]));
    let shown = |_: &Path| parts.stderr().contains("warm start: 90 decisions");
    let mut stopped = parts.start(&[], shown);
    stopped.signal(libc::SIGTERM);
    assert_eq!(stopped.ends_within(PATIENCE), Some(0), "{}", parts.stderr());
    let saved = checkpoints(&parts.path("out/strips-seed0/checkpoints"));
    assert!(saved.last().unwrap().starts_with("lesson-"), "{saved:?}");
    succeeded(&parts.train(&["--resume"]));
    for name in ["policy.safetensors", "checkpoints/step-000000000060.safetensors"] {
        let read = |case: &Case| std::fs::read(case.path("out/strips-seed0").join(name)).unwrap();
        assert_eq!(read(&whole), read(&parts), "{name}");
    }
}

#[test]
fn a_folder_belongs_to_one_run_at_a_time() {
    let case = Case::new(&TOY.replace("steps = 400", "steps = 1_000_000_000"));
    let progress = case.path("out/toy-seed0/progress.jsonl");
    let mut run = case.start(&[], |_| std::fs::read_to_string(&progress).unwrap_or_default().lines().count() > 3);
    let holder = format!("out/toy-seed0 belongs to a run that is going on, process {}", run.id());
    case.refused(&case.train(&[]), &[&holder, "--out or --seed"]);
    run.signal(libc::SIGINT);
    assert_eq!(run.ends_within(PATIENCE), Some(0), "{}", case.stderr());
    let before = progress_steps(&progress);
    let mut run = case.start(&["--resume"], |_| progress_steps(&progress).len() > before.len());
    let holder = format!("out/toy-seed0 belongs to a run that is going on, process {}", run.id());
    case.refused(&case.train(&["--resume"]), &[&holder]);
    succeeded(&case.train(&["--seed", "1", "--stop-after", "40"]));
    run.signal(libc::SIGINT);
    assert_eq!(run.ends_within(PATIENCE), Some(0), "{}", case.stderr());
    let steps = progress_steps(&progress);
    assert_eq!(steps, (1..=steps.len() as u64).map(|update| 40 * update).collect::<Vec<_>>(), "every line once");
}

#[test]
fn a_run_that_goes_on_says_in_its_folder_for_how_long() {
    let case = Case::new(TOY);
    succeeded(&case.train(&["--stop-after", "80"]));
    let described = || std::fs::read_to_string(case.path("out/toy-seed0/run.toml")).unwrap();
    assert!(described().contains("\nsteps = 400\n"), "{}", described());
    assert!(described().starts_with(&format!("# As swath-train {}, revision ", env!("CARGO_PKG_VERSION"))));
    succeeded(&case.train(&["--resume", "--steps", "160"]));
    assert!(described().contains("\nsteps = 160\n"), "{}", described());
    assert_eq!(progress_steps(&case.path("out/toy-seed0/progress.jsonl")), [40, 80, 120, 160]);
    swath_training::config::RunConfig::load(&case.path("out/toy-seed0/run.toml")).unwrap();
}
