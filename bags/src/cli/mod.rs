//! The command line of `swath-bag`: arguments, and what each command prints.

mod common;
mod convert;
mod copy;
mod inspect;
mod play;
mod record;
mod signals;

use std::io;
use std::process::ExitCode;

use clap::Subcommand;
pub use record::{MANIFEST, MANIFEST_TEXT, NO_ROOM};
use swath_ros::RosArgs;

use crate::error::{BagError, Result};

/// The commands of `swath-bag` that need no simulation.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Record topics into a new bag
    Record(record::RecordArgs),
    /// Publish a bag's messages
    Play(play::PlayArgs),
    /// Tell what is in a bag: topics, times, counts, and the mission's facts
    Info(inspect::InfoArgs),
    /// Print messages as JSON lines
    Cat(inspect::CatArgs),
    /// Check profile, schemas, metadata, checksums, order, gaps and the CDR of every message
    Validate(inspect::ValidateArgs),
    /// Copy some topics or a span of time into a new bag
    Filter(copy::FilterArgs),
    /// Merge bags into a new one, in order of time
    Merge(copy::MergeArgs),
    /// Save what is whole in a bag that is damaged or was not closed
    Recover(copy::RecoverArgs),
    /// Write a bag's metadata.yaml anew, from its files
    Reindex(convert::ReindexArgs),
    /// Write bags anew with other settings, as a file of rosbag2's output options says
    Convert(convert::ConvertArgs),
}

impl Command {
    /// Runs the command; results go to stdout, progress and warnings to stderr. `ros` is what stood
    /// after `--ros-args`, see [`RosArgs::split`].
    ///
    /// The exit code is not 0 where the command ran and found a fault.
    ///
    /// # Errors
    /// Whatever kept the command from running to its end.
    pub fn run(self, ros: &RosArgs) -> Result<ExitCode> {
        let result = match self {
            Self::Record(args) => args.run(ros),
            Self::Play(args) => args.run(ros),
            Self::Info(args) => args.run(),
            Self::Cat(args) => args.run(),
            Self::Validate(args) => args.run(),
            Self::Filter(args) => args.run(),
            Self::Merge(args) => args.run(),
            Self::Recover(args) => args.run(),
            Self::Reindex(args) => args.run(),
            Self::Convert(args) => args.run(),
        };
        match result {
            // The reader of our output has seen enough, as `head` does.
            Err(BagError::Io { source, .. }) if source.kind() == io::ErrorKind::BrokenPipe => Ok(ExitCode::SUCCESS),
            other => other,
        }
    }
}
