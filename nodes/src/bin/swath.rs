//! The operator's command line.

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use swath_ground::{launch, operate};
use swath_node::node;
use swath_nodes::POLICIES;

/// Flies and operates a super-agile Earth-observing satellite that images ground strips.
#[derive(Parser)]
#[command(version, about)]
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
    /// Print the node graph as a Mermaid diagram and as a table.
    Graph,
}

#[expect(clippy::print_stdout, reason = "the diagram is this command's result")]
fn main() -> ExitCode {
    node::exit_code(match Args::parse().command {
        Command::Launch(args) => launch::run(&args, &POLICIES),
        Command::Strips(args) => operate::run_strips(&args),
        Command::Planner(args) => operate::run_planner(&args),
        Command::Graph => {
            print!("```mermaid\n{}```\n\n{}", swath_ros::graph::mermaid(), swath_ros::graph::table());
            Ok(())
        }
    })
}
