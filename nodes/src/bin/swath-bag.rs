//! Record, play and inspect rosbag2 bags over MCAP.

use std::process::ExitCode;

use clap::Parser;
use swath_bags::cli::Command;
use swath_bags::{BagError, chain};
use swath_ros::RosArgs;

/// Record, play and inspect rosbag2 bags over MCAP.
#[derive(Parser)]
#[command(version, about)]
struct Args {
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
    Args::parse_from(words).command.run(&ros)
}
