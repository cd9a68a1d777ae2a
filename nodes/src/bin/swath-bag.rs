//! Record, play, inspect, re-fly and report rosbag2 bags over MCAP.

use std::process::ExitCode;

use anyhow::Result;
use clap::Parser;
use swath_ground::debrief::Command;
use swath_nodes::POLICIES;
use swath_ros::RosArgs;

/// Record, play, inspect, re-fly and report rosbag2 bags over MCAP.
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
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<ExitCode> {
    let (words, ros) = RosArgs::split(std::env::args())?;
    Args::parse_from(words).command.run(&ros, &POLICIES)
}
