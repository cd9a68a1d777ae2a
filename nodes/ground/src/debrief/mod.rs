//! The commands of `swath-bag` that know what a mission is: fly it again, report it, export it.

pub mod export;
pub mod places;
pub mod recorded;
pub mod refly;
pub mod report;

use std::process::ExitCode;

use anyhow::Result;
use clap::Subcommand;
use swath_bags::chain;
use swath_ros::RosArgs;

use swath_mission::guarded::Policies;

/// All commands of `swath-bag`.
#[derive(Debug, Subcommand)]
#[expect(clippy::large_enum_variant, reason = "one value a process")]
pub enum Command {
    /// What any bag can.
    #[command(flatten)]
    Bag(swath_bags::cli::Command),
    /// Fly a recorded mission again, with the same or another planner, and compare
    Refly(refly::ReflyArgs),
    /// Tell of a recorded mission in one page: map, timeline, plots, decisions
    Report(report::ReportArgs),
    /// Write tasks, states and decisions as tables, strips and ground track as GeoJSON, orbit and attitude as CZML
    Export(export::ExportArgs),
}

impl Command {
    /// Runs the command; results go to stdout, progress and warnings to stderr. `ros` is what stood
    /// after `--ros-args`, `policies` make the planner that flies a mission again.
    ///
    /// # Errors
    /// Whatever kept the command from running to its end.
    pub fn run(self, ros: &RosArgs, policies: &Policies) -> Result<ExitCode> {
        match self {
            Self::Bag(command) => command.run(ros).map_err(|error| anyhow::anyhow!(chain(&error))),
            Self::Refly(args) => args.run(policies),
            Self::Report(args) => args.run(),
            Self::Export(args) => args.run(),
        }
    }
}
