//! `swath-train`: trains, evaluates and compares strip planners.

mod command;

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use swath_training::process;

/// Trains, evaluates and compares strip planners.
#[derive(Debug, Parser)]
#[command(version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Train a planner, or go on with a run
    Train(command::train::TrainArgs),
    /// Plan whole missions on the ground, fly the plans blindly, and say what no plan can exceed
    GroundPlan(command::ground_plan::GroundPlanArgs),
    /// Fly the same missions with several planners and compare them
    Evaluate(command::evaluate::EvaluateArgs),
    /// Fly the heuristic with fixed transition times of 10 to 120 s
    Sweep(command::evaluate::SweepArgs),
    /// Put the parts of an evaluation, a sweep or ground plans together that were flown with --shard
    Merge(command::campaign::MergeArgs),
    /// Draw the paper's Figures 3, 4 and 5 from recorded runs and evaluations
    Figures(command::figures::FiguresArgs),
}

fn main() -> ExitCode {
    process::prepare();
    let outcome = match Cli::parse().command {
        Command::Train(args) => command::train::train(&args),
        Command::GroundPlan(args) => command::ground_plan::ground_plan(&args),
        Command::Evaluate(args) => command::evaluate::evaluate(&args),
        Command::Sweep(args) => command::evaluate::sweep(&args),
        Command::Merge(args) => command::campaign::merge(&args),
        Command::Figures(args) => command::figures::figures(&args),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
