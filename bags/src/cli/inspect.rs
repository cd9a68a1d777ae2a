//! `info`, `cat` and `validate`.

use std::io;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use super::common::{ReadArgs, done, print_json};
use super::copy::Selection;
use crate::error::Result;
use crate::ops::cat::cat;
use crate::ops::info::{info, info_in_detail};
use crate::ops::validate::validate;
use crate::out::print;
use crate::reader::Bag;

/// Arguments of `info`.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  swath-bag info out/bag")]
pub struct InfoArgs {
    /// Bag directory or .mcap file
    bag: PathBuf,
    /// Tell more: sizes by topic, QoS, type hashes, requests and responses of services; reads every message
    #[arg(short, long)]
    verbose: bool,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    read: ReadArgs,
}

impl InfoArgs {
    pub(super) fn run(self) -> Result<ExitCode> {
        let bag = Bag::open_all(&[self.bag], self.read.options())?;
        let info = if self.verbose { info_in_detail(&bag)? } else { info(&bag) };
        match self.json {
            true => print_json(&info)?,
            false => print(&info.to_string())?,
        }
        Ok(done(bag.faults()))
    }
}

/// Arguments of `cat`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  swath-bag cat out/bag --topic /swath/task_result --from 600 --to +5400 | jq .message"
)]
pub struct CatArgs {
    /// Bag directory or .mcap file
    bag: PathBuf,
    #[command(flatten)]
    selection: Selection,
    /// Stop after this many messages
    #[arg(short = 'n', long)]
    limit: Option<u64>,
    #[command(flatten)]
    read: ReadArgs,
}

impl CatArgs {
    pub(super) fn run(self) -> Result<ExitCode> {
        let bag = Bag::open_all(&[self.bag], self.read.options())?;
        let filter = self.selection.filter(&bag)?;
        let mut out = io::BufWriter::new(io::stdout().lock());
        let mut faults = bag.faults().to_vec();
        cat(&bag, &filter, self.limit, &mut out, &mut faults)?;
        Ok(done(&faults))
    }
}

/// Arguments of `validate`.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  swath-bag validate out/bag --max-gap 60\n\nExits with 1 when there is a fault.")]
pub struct ValidateArgs {
    /// Bag directory or .mcap file
    bag: PathBuf,
    /// Longest time between two messages of a topic [s]; longer is a fault
    #[arg(long, value_name = "SECONDS", value_parser = super::copy::seconds)]
    max_gap: Option<u64>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    read: ReadArgs,
}

impl ValidateArgs {
    pub(super) fn run(self) -> Result<ExitCode> {
        let report = validate(&self.bag, self.max_gap, self.read.options())?;
        let code = if report.faults.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE };
        if self.json {
            print_json(&report)?;
            return Ok(code);
        }
        let mut text = String::new();
        for warning in &report.warnings {
            text += &format!("warning: {warning}\n");
        }
        for fault in &report.faults {
            text += &format!("fault: {fault}\n");
        }
        let (messages, topics) = (report.messages, report.topics.len());
        let (faults, warnings) = (report.faults.len(), report.warnings.len());
        text += &format!("{messages} messages on {topics} topics checked: {faults} faults, {warnings} warnings\n");
        print(&text)?;
        Ok(code)
    }
}
