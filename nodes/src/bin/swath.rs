//! The operator's command line.

use std::os::unix::process::CommandExt as _;
use std::process::{self, ExitCode};

use anyhow::{Error, Result, anyhow};
use clap::{Parser, Subcommand};
use swath_ground::debrief::{export, refly, report};
use swath_ground::{launch, operate, passes};
use swath_node::out;
use swath_nodes::POLICIES;
use swath_ros::RosArgs;

/// Flies and operates a super-agile Earth-observing satellite that images ground strips.
#[derive(Parser)]
#[command(name = "swath", version)]
struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Start the nodes of a mission, watch them, and leave bag, tasks and summary.
    Launch(launch::LaunchArgs),
    /// Submit strips to a flying mission, ask about them, change them.
    Strips(operate::StripsArgs),
    /// Say what the planner may do by itself, and decide on what it proposes.
    Planner(operate::PlannerArgs),
    /// Say what is wrong, and what operators know of it.
    Alarms(operate::AlarmsArgs),
    /// Say how the radio of a flying mission stands.
    Link(operate::LinkArgs),
    /// Let a wheel, a sensor or a node of a flying mission fail, as a drill or a test.
    Fault(operate::FaultArgs),
    /// Say when stations see the satellite of a mission, from its file alone.
    Passes(passes::PassesArgs),
    /// Show a flying or a recorded mission as a page in a browser.
    Console(swath_console::ConsoleArgs),
    /// Show a flying or a recorded mission in Foxglove.
    Bridge(swath_bridge::BridgeArgs),
    /// Fly a recorded mission again, with the same or another planner, and compare.
    Refly(refly::ReflyArgs),
    /// Tell of a recorded mission in one page: map, timeline, plots, decisions.
    Report(report::ReportArgs),
    /// Write tasks, states and decisions as tables, strips and ground track as GeoJSON, orbit and attitude as CZML.
    Export(export::ExportArgs),
    /// Print the node graph as a Mermaid diagram and as a table.
    Graph,
}

fn main() -> ExitCode {
    let outcome = RosArgs::split(std::env::args()).map_err(Error::from);
    outcome.and_then(|(words, ros)| run(Args::parse_from(words).command, &ros)).unwrap_or_else(|error| {
        out::say(format_args!("error: {}", out::chain(&error)));
        ExitCode::FAILURE
    })
}

/// Becomes the console's own program, with the words that this one was given; returns only what kept it from that.
fn become_console() -> Error {
    let program = match std::env::current_exe() {
        Ok(path) => path.with_file_name("swath-console"),
        Err(error) => return anyhow!("cannot find swath-console: {error}"),
    };
    let words = std::env::args_os().skip_while(|word| *word != "console").skip(1);
    let error = process::Command::new(&program).args(words).exec();
    anyhow!("cannot run {}: {error}", program.display())
}

fn run(command: Command, ros: &RosArgs) -> Result<ExitCode> {
    match command {
        Command::Launch(args) => return launch::run(&args, ros, &POLICIES),
        Command::Strips(args) => operate::run_strips(&args, ros)?,
        Command::Planner(args) => operate::run_planner(&args, ros)?,
        Command::Alarms(args) => operate::run_alarms(&args, ros)?,
        Command::Link(args) => operate::run_link(&args, ros)?,
        Command::Fault(args) => operate::run_fault(&args, ros)?,
        Command::Passes(args) => passes::run(&args)?,
        Command::Console(_) => return Err(become_console()),
        Command::Bridge(args) => swath_bridge::run(&args, ros)?,
        Command::Refly(args) => return args.run(&POLICIES),
        Command::Report(args) => return args.run(),
        Command::Export(args) => return args.run(),
        Command::Graph => {
            out::print(&format!("```mermaid\n{}```\n\n{}", swath_ros::graph::mermaid(), swath_ros::graph::table()))?;
        }
    }
    Ok(ExitCode::SUCCESS)
}
