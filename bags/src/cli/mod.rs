//! The command line of `swath-bag`: arguments, and what each command prints.

mod copy;
mod inspect;
mod play;
mod record;

use std::{
    io::{self, Write},
    process::ExitCode,
};

use clap::Subcommand;
pub use record::{MANIFEST, MANIFEST_TEXT};
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
        };
        match result {
            // The reader of our output has seen enough, as `head` does.
            Err(BagError::Io { source, .. }) if source.kind() == io::ErrorKind::BrokenPipe => Ok(ExitCode::SUCCESS),
            other => other,
        }
    }
}

/// Prints a text to stdout.
fn print(text: &str) -> Result<()> {
    let mut out = io::stdout().lock();
    out.write_all(text.as_bytes()).and_then(|()| out.flush()).map_err(|source| BagError::Io {
        action: "write to",
        path: "standard output".into(),
        source,
    })
}

/// Prints a value as one line of JSON.
fn print_json(value: &impl serde::Serialize) -> Result<()> {
    let text =
        serde_json::to_string(value).map_err(|e| BagError::Option { option: "--json", reason: e.to_string() })?;
    print(&(text + "\n"))
}
