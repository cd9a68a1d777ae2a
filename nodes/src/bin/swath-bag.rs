//! Record, play and inspect rosbag2 bags over MCAP.

use std::process::ExitCode;

use clap::Parser;
use swath_bags::chain;
use swath_bags::cli::Command;

/// Record, play and inspect rosbag2 bags over MCAP.
#[derive(Parser)]
#[command(version, about)]
struct Args {
    #[command(subcommand)]
    command: Command,
}

fn main() -> ExitCode {
    match Args::parse().command.run() {
        Ok(code) => code,
        Err(error) => {
            eprintln!("error: {}", chain(&error));
            ExitCode::FAILURE
        }
    }
}
