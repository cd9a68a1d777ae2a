//! The console alone: `swath console` becomes this program, which is half as large in memory without the planners.

use std::process::ExitCode;

use anyhow::{Error, Result};
use clap::Parser;
use swath_console::ConsoleArgs;
use swath_node::out;
use swath_ros::RosArgs;

/// Show a flying or a recorded mission as a page in a browser.
#[derive(Parser)]
#[command(name = "swath-console", version)]
struct Args {
    #[command(flatten)]
    console: ConsoleArgs,
}

fn main() -> ExitCode {
    let outcome = RosArgs::split(std::env::args()).map_err(Error::from);
    let run = |(words, ros): (Vec<String>, RosArgs)| -> Result<()> {
        swath_console::run(&Args::parse_from(words).console, &ros)
    };
    outcome.and_then(run).map_or_else(
        |error| {
            out::say(format_args!("error: {}", out::chain(&error)));
            ExitCode::FAILURE
        },
        |()| ExitCode::SUCCESS,
    )
}
