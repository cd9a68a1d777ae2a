//! Record, play, inspect and mend rosbag2 bags.

use std::env;
use std::os::unix::process::CommandExt;
use std::process::{self, ExitCode};

use clap::{Args, Parser, Subcommand};
use swath_bags::cli::Command;
use swath_bags::{chain, say};
use swath_ros::RosArgs;

/// Record, play, inspect and mend rosbag2 bags
#[derive(Parser)]
#[command(
    name = "swath-bag",
    version,
    after_help = "What knows missions is in `swath`: refly, report, export. `swath-bag refly` and so on run it there."
)]
struct Cli {
    #[command(subcommand)]
    command: Words,
}

#[derive(Subcommand)]
#[expect(clippy::large_enum_variant, reason = "there is one in a process")]
enum Words {
    #[command(flatten)]
    Bag(Command),
    #[command(hide = true, disable_help_flag = true)]
    Refly(Handed),
    #[command(hide = true, disable_help_flag = true)]
    Report(Handed),
    #[command(hide = true, disable_help_flag = true)]
    Export(Handed),
}

/// What is handed to `swath` as it stands.
#[derive(Args)]
struct Handed {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    words: Vec<String>,
}

impl Handed {
    /// Becomes `swath NAME WORDS`; returns only what kept it from that.
    fn become_swath(self, name: &str) -> String {
        let program = match env::current_exe() {
            Ok(path) => path.with_file_name("swath"),
            Err(error) => return format!("cannot find swath: {error}"),
        };
        say(&format!("swath-bag {name} runs `swath {name}`"));
        let error = process::Command::new(&program).arg(name).args(self.words).exec();
        format!("cannot run {}: {error}", program.display())
    }
}

fn main() -> ExitCode {
    match run() {
        Ok(code) => code,
        Err(error) => {
            say(&format!("error: {error}"));
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<ExitCode, String> {
    let (words, ros) = RosArgs::split(env::args()).map_err(|error| chain(&error))?;
    match Cli::parse_from(words).command {
        Words::Bag(command) => command.run(&ros).map_err(|error| chain(&error)),
        Words::Refly(handed) => Err(handed.become_swath("refly")),
        Words::Report(handed) => Err(handed.become_swath("report")),
        Words::Export(handed) => Err(handed.become_swath("export")),
    }
}
