//! `swath-bag` without the commands that fly missions; the tests of this crate run it.

use std::process::ExitCode;

use clap::Parser;
use swath_bags::{BagError, chain, cli::Command};
use swath_ros::RosArgs;

/// Record, play and inspect rosbag2 bags over MCAP
#[derive(Parser)]
#[command(name = "swath-bag", version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

fn main() -> ExitCode {
    match run() {
        Ok(code) => code,
        Err(error) => {
            eprintln!("error: {}", chain(&error));
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<ExitCode, BagError> {
    let (words, ros) = RosArgs::split(std::env::args())?;
    Cli::parse_from(words).command.run(&ros)
}
