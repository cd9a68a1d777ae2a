//! `soak fuzz`: coverage-guided fuzzing of what comes from outside, on the stable toolchain.
//!
//! libFuzzer drives the programs of `fuzz/`; `fuzz/instrument`, before rustc, makes the code of this workspace count what
//! it reaches. Inputs that reach something new stand in `target/soak/fuzz/NAME`, so that one that was stopped goes on
//! with what it has found.

use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

use anyhow::{Context, Result, bail};
use serde_json::{Map, Value, json};

use crate::process;

/// What is fuzzed, and where there are inputs to begin with.
const TARGETS: [(&str, &str); 4] = [
    ("cdr", "fuzz/begin/cdr"),
    ("missions", "examples/missions"),
    ("faults", "fuzz/begin/faults"),
    ("words", "fuzz/begin/words"),
];
/// Inputs for each.
const INPUTS: u64 = 10_000_000;
/// How long an input may take [s].
const TIMEOUT_S: u32 = 10;

/// Fuzzes each target with so many inputs and prints what was reached.
pub fn run(root: &Path, inputs: Option<u64>) -> Result<()> {
    let inputs = inputs.unwrap_or(INPUTS);
    let mut build = process::cargo(root, "build");
    build.args(["--quiet", "--release", "--package", "swath-fuzz", "--features", "fuzzing", "--bins"]);
    process::run(build.env("RUSTC_WORKSPACE_WRAPPER", root.join("fuzz/instrument")))?;
    let mut found = Map::new();
    for (name, begin) in TARGETS {
        found.insert(name.to_owned(), fuzz(root, name, begin, inputs)?);
    }
    let text = serde_json::to_string_pretty(&found).context("cannot print the figures")?;
    writeln!(std::io::stdout(), "{text}").context("cannot print the figures")
}

fn fuzz(root: &Path, name: &str, begin: &str, inputs: u64) -> Result<Value> {
    let folder = root.join("target/soak/fuzz").join(name);
    fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let words = root.join("fuzz/begin").join(format!("{name}.dict"));
    eprintln!("{name}: {inputs} inputs; what reaches something new is in {}", folder.display());
    let mut fuzzer = Command::new(root.join("target/release").join(format!("fuzz-{name}")));
    fuzzer.args([&folder, &root.join(begin)]);
    fuzzer.args([format!("-runs={inputs}"), format!("-timeout={TIMEOUT_S}"), format!("-dict={}", words.display())]);
    fuzzer.args(["-seed=1", "-max_len=4096", "-rss_limit_mb=4096", "-print_final_stats=1", "-verbosity=1"]);
    fuzzer.arg(format!("-artifact_prefix={}/", root.join("target/soak/fuzz").display()));
    let begin = Instant::now();
    let said = fuzzer.stderr(Stdio::piped()).output().with_context(|| format!("cannot start fuzz-{name}"))?;
    let text = String::from_utf8_lossy(&said.stderr);
    if !said.status.success() {
        let last: Vec<&str> = text.lines().rev().take(30).collect();
        bail!("{name} has found something: {}", last.into_iter().rev().collect::<Vec<_>>().join("\n"));
    }
    let number = |key: &str| {
        let line = text.lines().rev().find_map(|line| line.split_once(key))?;
        line.1.split_whitespace().next()?.parse::<u64>().ok()
    };
    Ok(json!({
        "inputs": number("stat::number_of_executed_units:"),
        "edges_reached": number("cov: "),
        "inputs_kept": number("stat::new_units_added:"),
        "peak_memory_mb": number("stat::peak_rss_mb:"),
        "seconds": begin.elapsed().as_secs(),
    }))
}
