//! `swath-bag` without the commands that fly missions; the tests of this crate run it.

use std::process::ExitCode;

use clap::Parser;
use swath_bags::{chain, cli::Command};

/// Record, play and inspect rosbag2 bags over MCAP
#[derive(Parser)]
#[command(name = "swath-bag", version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

fn main() -> ExitCode {
    match Cli::parse().command.run() {
        Ok(code) => code,
        Err(error) => {
            eprintln!("error: {}", chain(&error));
            ExitCode::FAILURE
        }
    }
}
