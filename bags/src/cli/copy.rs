//! `filter`, `merge` and `recover`, and the arguments that select messages and shape new bags.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use clap::Args;

use super::common::{ReadArgs, WITH_LOSS, done, print_json};
use crate::error::{BagError, Result};
use crate::file::chunk::Compression;
use crate::ops::copy::{Copied, filter, merge};
use crate::ops::recover::recover;
use crate::out::print;
use crate::reader::{Bag, Filter, TopicPattern};
use crate::writer::{BagOptions, BagSummary};

/// Which messages of a bag.
#[derive(Debug, Args)]
pub struct Selection {
    /// Topics to take; all without this and --regex
    #[arg(short, long, value_name = "TOPIC", num_args = 1..)]
    topic: Vec<String>,
    /// Topics to take, by a regular expression for the whole name
    #[arg(short = 'e', long)]
    regex: Option<String>,
    /// Topics to leave out, by a regular expression for the whole name
    #[arg(short = 'x', long)]
    exclude: Option<String>,
    /// First log time [s]; with + ahead, from the bag's start
    #[arg(long, value_name = "SECONDS")]
    from: Option<String>,
    /// Last log time [s]; with + ahead, from the bag's start
    #[arg(long, value_name = "SECONDS")]
    to: Option<String>,
}

impl Selection {
    /// The filter for a bag, whose start `+` times refer to.
    pub(super) fn filter(&self, bag: &Bag) -> Result<Filter> {
        let start = bag.time_range().map_or(0, |(start, _)| start);
        let time = |option: &'static str, text: &Option<String>, otherwise: u64| -> Result<u64> {
            let Some(text) = text else { return Ok(otherwise) };
            let (base, number) = match text.strip_prefix('+') {
                Some(number) => (start, number),
                None => (0, text.as_str()),
            };
            let ns = seconds(number).map_err(|reason| BagError::Option { option, reason })?;
            Ok(base.saturating_add(ns))
        };
        Ok(Filter {
            topics: TopicPattern::new(&self.topic, self.regex.as_deref(), self.exclude.as_deref())?,
            from: time("--from", &self.from, 0)?,
            until: time("--to", &self.to, u64::MAX)?,
        })
    }
}

/// Parses seconds into nanoseconds.
pub(super) fn seconds(text: &str) -> Result<u64, String> {
    let value: f64 = text.parse().map_err(|_| format!("{text:?} is no number of seconds"))?;
    // 2^63 ns, the range of ROS times.
    let limit = 9_223_372_036.0;
    if !(0.0..=limit).contains(&value) {
        return Err(format!("{value} s is outside 0 to {limit} s"));
    }
    Ok((value * 1e9).round() as u64)
}

/// How a new bag is stored.
#[derive(Debug, Args)]
pub struct Shape {
    /// Compression of chunks: zstd, lz4 or none
    #[arg(long, default_value = "zstd")]
    pub(super) compression: Compression,
    /// Level of zstd, 1 (fast) to 19 (small)
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(i32).range(1..=19))]
    pub(super) compression_level: i32,
    /// Size of chunks before compression [bytes]
    #[arg(long, default_value_t = 1 << 20, value_parser = clap::value_parser!(u64).range(1024..=64 << 20))]
    chunk_size: u64,
    /// Start a new file when one reaches this size [bytes]
    #[arg(short = 'b', long, value_name = "BYTES", value_parser = clap::value_parser!(u64).range(1024..))]
    max_bag_size: Option<u64>,
    /// Start a new file when one spans this log time [s]
    #[arg(short = 'd', long, value_name = "SECONDS", value_parser = seconds)]
    max_bag_duration: Option<u64>,
}

impl Shape {
    /// The writer's options.
    pub(super) fn options(&self) -> BagOptions {
        BagOptions {
            compression: self.compression,
            zstd_level: self.compression_level,
            chunk_bytes: self.chunk_size as usize,
            max_file_bytes: self.max_bag_size,
            max_file_duration: self.max_bag_duration.map(Duration::from_nanos),
            ..BagOptions::default()
        }
    }
}

/// Arguments of `filter`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  swath-bag filter out/bag -o attitude -t /clock /swath/state --from +600 --to +1200"
)]
pub struct FilterArgs {
    /// Bag directory or .mcap file
    bag: PathBuf,
    /// Directory of the new bag
    #[arg(short, long)]
    output: PathBuf,
    #[command(flatten)]
    selection: Selection,
    #[command(flatten)]
    shape: Shape,
    #[command(flatten)]
    read: ReadArgs,
}

impl FilterArgs {
    pub(super) fn run(self) -> Result<ExitCode> {
        let bag = Bag::open_all(&[self.bag], self.read.options())?;
        let wanted = self.selection.filter(&bag)?;
        report(&filter(&bag, &wanted, &self.output, self.shape.options())?)
    }
}

/// Arguments of `merge`.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  swath-bag merge pass1 pass2 -o day")]
pub struct MergeArgs {
    /// Bag directories or .mcap files
    #[arg(required = true, num_args = 2..)]
    bags: Vec<PathBuf>,
    /// Directory of the new bag
    #[arg(short, long)]
    output: PathBuf,
    #[command(flatten)]
    shape: Shape,
    #[command(flatten)]
    read: ReadArgs,
}

impl MergeArgs {
    pub(super) fn run(self) -> Result<ExitCode> {
        report(&merge(&self.bags, &self.output, self.shape.options(), self.read.options())?)
    }
}

fn report(copied: &Copied) -> Result<ExitCode> {
    let BagSummary { messages, files, bytes, .. } = copied.summary;
    print(&format!("{messages} messages in {files} files, {bytes} bytes\n"))?;
    Ok(done(&copied.faults))
}

/// Arguments of `recover`.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  swath-bag recover killed -o saved && swath-bag validate saved")]
pub struct RecoverArgs {
    /// Bag directory or .mcap file
    bag: PathBuf,
    /// Directory of the new bag
    #[arg(short, long)]
    output: PathBuf,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    shape: Shape,
    #[command(flatten)]
    read: ReadArgs,
}

impl RecoverArgs {
    pub(super) fn run(self) -> Result<ExitCode> {
        let recovery = recover(&self.bag, &self.output, self.shape.options(), self.read.options())?;
        let messages = recovery.summary.messages;
        if self.json {
            print_json(&serde_json::json!({ "messages": messages, "faults": recovery.faults }))?;
        } else {
            let mut text = String::new();
            for fault in &recovery.faults {
                text += &format!("damage: {fault}\n");
            }
            print(&(text + &format!("{messages} messages saved\n")))?;
        }
        Ok(if recovery.faults.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(WITH_LOSS) })
    }
}
