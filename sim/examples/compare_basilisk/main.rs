//! Computes Basilisk histories again with this crate and prints the largest differences.
//!
//! `cargo run --release -p swath-sim --example compare_basilisk -- FILE…`
#![expect(non_snake_case, reason = "frame letters")]
#![allow(clippy::print_stdout, missing_docs, reason = "a command-line tool")]

mod history;
mod resources;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result};
use clap::Parser;

/// Computes Basilisk histories again and prints the largest differences, one line a file.
#[derive(Parser)]
struct Args {
    /// History files: JSON with `meta` and `data`, as described in sim/tests/basilisk/README.md and
    /// sim/tests/basilisk_resources/README.md.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Compare closed loops of `step_*`, `track_*` and `chain_*` only up to this time [s].
    #[arg(long)]
    until: Option<f64>,
    /// Exit with 1 when σ of those differs by more than this; all other quantities have tolerances of their own.
    #[arg(long, default_value_t = 1e-8)]
    tolerance: f64,
}

fn main() -> Result<ExitCode> {
    let args = Args::parse();
    let mut within = true;
    for path in &args.files {
        let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
        let value: serde_json::Value =
            serde_json::from_str(&text).with_context(|| format!("{} is not JSON", path.display()))?;
        within &= if resources::case(&value).is_some() { of_resources(path, &value)? } else { of_loop(path, &args)? };
    }
    Ok(ExitCode::from(u8::from(!within)))
}

/// Compares a history of resources. Says whether it is within its tolerances.
fn of_resources(path: &Path, history: &serde_json::Value) -> Result<bool> {
    let found = resources::compare(path, history)?;
    let holds = found.checks.iter().all(resources::Check::holds);
    let differences: Vec<String> = found
        .checks
        .iter()
        .map(|check| {
            let mark = if check.holds() { "" } else { " OUTSIDE" };
            format!("{} {:.1e}{mark}", check.what, check.difference)
        })
        .collect();
    println!("{} {:>6} rows: {}", label(path, holds), found.rows, differences.join(", "));
    Ok(holds)
}

/// Compares a closed-loop history. Says whether it is within the tolerance.
fn of_loop(path: &Path, args: &Args) -> Result<bool> {
    let history = history::read(path)?;
    // A slew from so far that it tumbles amplifies rounding: its first minute is the comparison.
    let until = args.until.or((history.meta.case_id() == Some(13)).then_some(60.0));
    let found = history::compare(&history, until)?;
    let holds = found.sigma <= args.tolerance;
    println!(
        "{} {:>6} rows: sigma {:.1e}, omega rad/s {:.1e}, command N m {:.1e}, wheel rad/s {:.1e}",
        label(path, holds),
        found.rows,
        found.sigma,
        found.omega,
        found.command,
        found.wheel_speed
    );
    Ok(holds)
}

fn label(path: &Path, holds: bool) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    format!("{name:<40} {:<7}", if holds { "ok" } else { "DIFFERS" })
}
