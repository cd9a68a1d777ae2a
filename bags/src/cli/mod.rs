//! The command line of `swath-bag`: arguments, and what each command prints.

mod copy;
mod inspect;
mod play;
mod record;

use std::{
    io::{self, Write},
    process::ExitCode,
};

use clap::{Args, Subcommand};
pub use record::{MANIFEST, MANIFEST_TEXT};
use swath_ros::RosArgs;

use crate::{
    error::{BagError, Result},
    file::source::{MAX_RECORD_BYTES, ReadOptions},
};

/// The exit code of a command that has done its work, with loss.
const WITH_LOSS: u8 = 3;

/// How bags are read.
#[derive(Debug, Args)]
struct ReadArgs {
    /// Largest message, and largest chunk once unpacked, that is read into memory [bytes]
    #[arg(
        long,
        value_name = "BYTES",
        default_value_t = MAX_RECORD_BYTES,
        value_parser = clap::value_parser!(u64).range(1024..=u64::from(u32::MAX))
    )]
    max_record_size: u64,
}

impl ReadArgs {
    fn options(&self) -> ReadOptions {
        ReadOptions { max_record_bytes: self.max_record_size }
    }
}

/// The exit code of a command that has done its work; tells what was lost on the way.
fn done(faults: &[String]) -> ExitCode {
    for fault in faults {
        eprintln!("warning: {fault}");
    }
    if faults.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(WITH_LOSS) }
}

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
