//! Flies Basilisk histories again with this crate and prints the largest differences.
//!
//! `cargo run --release -p swath-sim --example compare_basilisk -- FILE…`
#![expect(non_snake_case, reason = "frame letters")]
#![allow(clippy::print_stdout, missing_docs, reason = "a command-line tool")]

mod history;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Result;
use clap::Parser;

/// Flies Basilisk histories again and prints the largest differences.
#[derive(Parser)]
struct Args {
    /// History files: JSON with `meta` and `data`, as described in sim/tests/basilisk/README.md.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Compare only up to this time [s].
    #[arg(long)]
    until: Option<f64>,
    /// Exit with 1 when σ differs by more than this.
    #[arg(long, default_value_t = 1e-8)]
    tolerance: f64,
}

fn main() -> Result<ExitCode> {
    let args = Args::parse();
    let mut within = true;
    println!(
        "{:<36} {:>6} {:>10} {:>12} {:>12} {:>12}",
        "file", "rows", "sigma", "omega rad/s", "command N m", "wheel rad/s"
    );
    for path in &args.files {
        let history = history::read(path)?;
        // A slew from so far that it tumbles amplifies rounding: its first minute is the comparison.
        let until = args.until.or((history.meta.case_id() == Some(13)).then_some(60.0));
        let found = history::compare(&history, until)?;
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        println!(
            "{name:<36} {:>6} {:>10.1e} {:>12.1e} {:>12.1e} {:>12.1e}",
            found.rows, found.sigma, found.omega, found.command, found.wheel_speed
        );
        within &= found.sigma <= args.tolerance;
    }
    Ok(ExitCode::from(u8::from(!within)))
}
