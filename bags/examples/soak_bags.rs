//! Reads damaged bags for as long as it takes: `cargo xtask soak bags [SEEDS]`, or `soak_bags FIRST_SEED COUNT` for some of
//! them; prints one JSON object.
//!
//! Each bag follows from its seed, so that a run may be cut into ranges and a failure tried again by itself. Every
//! hundredth is recovered and filtered, too. A bag that takes longer than [`PATIENCE`] ends the run.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a measurement that cannot go on should panic")]

#[path = "../tests/it/common/conformance.rs"]
mod conformance;
#[path = "../tests/it/common/mutate.rs"]
mod mutate;

use std::path::Path;
use std::process::exit;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};
use std::{env, panic, thread};

use serde_json::json;

/// How long one bag may take.
const PATIENCE: Duration = Duration::from_secs(20);
/// Of so many bags one is recovered and filtered.
const SAVED: u64 = 100;

fn main() {
    let args: Vec<String> = env::args().skip(1).collect();
    let args: Vec<&str> = args.iter().map(String::as_str).collect();
    let (first, count): (u64, u64) = match args[..] {
        ["--plan"] => {
            println!("{}", json!({ "seeds": 10_000_000, "chunk": 100_000 }));
            return;
        }
        [first, count] => (first.parse().unwrap(), count.parse().unwrap()),
        _ => panic!("usage: soak_bags --plan | FIRST_SEED COUNT"),
    };
    let samples = mutate::samples(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data"));
    let memory = Path::new("/dev/shm");
    let folder = if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() }.unwrap();
    let current = watch(first);
    panic::set_hook(Box::new(|info| eprintln!("{info}")));
    let (mut opened, mut panics) = (0u64, Vec::new());
    let start = Instant::now();
    for seed in first..first + count {
        current.store(seed, Ordering::Relaxed);
        let outcome = panic::catch_unwind(|| {
            let bytes = mutate::mutated(&samples, seed);
            if seed.is_multiple_of(SAVED) {
                mutate::save(&bytes, folder.path());
            }
            mutate::read(bytes)
        });
        match outcome {
            Ok(could_open) => opened += u64::from(could_open),
            Err(_) => panics.push(seed),
        }
    }
    let result = json!({
        "bags": count,
        "opened": opened,
        "panics": panics,
        "max_memory_MB": memory_mb(),
        "seconds": start.elapsed().as_secs_f64().round(),
    });
    println!("{result}");
    exit(i32::from(!panics.is_empty()));
}

/// Watches that the seed moves on.
fn watch(first: u64) -> Arc<AtomicU64> {
    let current = Arc::new(AtomicU64::new(first));
    let watched = Arc::clone(&current);
    thread::spawn(move || {
        let mut last = u64::MAX;
        loop {
            thread::sleep(PATIENCE);
            let seed = watched.load(Ordering::Relaxed);
            if seed == last {
                eprintln!("seed {seed} takes longer than {PATIENCE:?}");
                exit(2);
            }
            last = seed;
        }
    });
    current
}

/// Largest resident set of this process [MB].
fn memory_mb() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find(|line| line.starts_with("VmHWM:")).unwrap();
    line.split_whitespace().nth(1).unwrap().parse::<f64>().unwrap() / 1000.0
}
