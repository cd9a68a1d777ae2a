//! The command line of `swath-bag`: arguments, and what each command prints.

mod convert;
mod copy;
mod inspect;
mod play;
mod record;
mod signals;

use std::{
    collections::BTreeMap,
    fs,
    io::{self, Write},
    path::{Path, PathBuf},
    process::ExitCode,
};

use clap::{Args, Subcommand};
pub use record::{MANIFEST, MANIFEST_TEXT};
use swath_ros::RosArgs;

use crate::{
    error::{BagError, Result},
    file::source::{MAX_RECORD_BYTES, ReadOptions},
    qos::QosOverride,
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
    /// Kind of files, for scripts that name it; it is seen from the files themselves
    #[arg(short, long, value_name = "KIND", value_parser = ["mcap", "sqlite3"])]
    storage: Option<String>,
}

impl ReadArgs {
    fn options(&self) -> ReadOptions {
        ReadOptions { max_record_bytes: self.max_record_size }
    }
}

/// The bags of `--input BAG [KIND]`, which stands as often as there are bags: kinds are seen from the files.
fn bags(words: Vec<String>) -> Vec<PathBuf> {
    let mut bags: Vec<PathBuf> = Vec::new();
    for word in words {
        let is_kind = matches!(word.as_str(), "mcap" | "sqlite3") && !bags.is_empty() && !Path::new(&word).exists();
        if !is_kind {
            bags.push(word.into());
        }
    }
    bags
}

/// QoS by topic, from a YAML file.
fn overrides(path: Option<&Path>) -> Result<BTreeMap<String, QosOverride>> {
    let Some(path) = path else { return Ok(BTreeMap::new()) };
    let text = fs::read_to_string(path).map_err(BagError::io("read", path))?;
    yaml_serde::from_str(&text).map_err(|e| BagError::Option {
        option: "--qos-profile-overrides-path",
        reason: format!("{}: {e}", path.display()),
    })
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
