//! `swath strips export`: every strip with its history, and the audit trail.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, ErrorKind, Write};
use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::Args;
use serde_json::Value;
use swath_msgs::swath_msgs as msg;
use swath_ros::{RosArgs, graph};

use super::client::{Operator, check};
use crate::requests::json::{exported, history_json};
use crate::requests::messages::history_entry;
use crate::requests::orders::stored;
use crate::requests::store::Store;
use swath_mission::orders::order::Order;
use swath_node::orders::order_of;

/// `swath strips export`.
#[derive(Debug, Args)]
pub struct ExportArgs {
    /// The store of a mission that need not fly any more: `requests.sqlite` in its output folder.
    #[arg(long)]
    store: Option<PathBuf>,
    /// Write to this file instead of stdout.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Write the audit trail, every change in order as a JSON line, instead of GeoJSON.
    #[arg(long)]
    trail: bool,
}

/// Entries in one page: with Fast DDS a longer answer than 64 kB would not arrive.
const PAGE: u32 = 50;

/// What is exported: orders and where they stand, and the audit trail.
struct Everything {
    requests: Vec<(Order, msg::StripStatus)>,
    trail: Vec<msg::HistoryEntry>,
}

/// Exports strips or the audit trail.
///
/// # Errors
/// When the mission does not answer, the store cannot be read, or the file cannot be written.
pub fn export(args: &ExportArgs, ros: &RosArgs) -> Result<()> {
    let everything = match &args.store {
        Some(path) => from_store(&Store::open_read_only(path)?)?,
        None => from_mission(ros)?,
    };
    match &args.out {
        Some(path) => {
            let file = File::create(path).with_context(|| format!("cannot write {}", path.display()))?;
            let written = write(everything, args.trail, BufWriter::new(file));
            written.with_context(|| format!("cannot write {}", path.display()))
        }
        None => match write(everything, args.trail, std::io::stdout().lock()) {
            // Whoever reads it has read enough.
            Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
            written => written.context("cannot write to standard output"),
        },
    }
}

fn write(everything: Everything, trail: bool, mut to: impl Write) -> std::io::Result<()> {
    let lines = everything.trail.iter().map(history_json);
    if trail {
        for line in lines {
            writeln!(to, "{line}")?;
        }
        return to.flush();
    }
    let mut histories: BTreeMap<u64, Vec<Value>> = BTreeMap::new();
    for (line, entry) in lines.zip(&everything.trail) {
        histories.entry(entry.strip_id).or_default().push(line);
    }
    writeln!(to, "{{\"type\":\"FeatureCollection\",\"features\":[")?;
    let count = everything.requests.len();
    for (i, (order, status)) in everything.requests.iter().enumerate() {
        let feature = exported(order, status, histories.remove(&status.strip.id).unwrap_or_default());
        writeln!(to, "{feature}{}", if i + 1 < count { "," } else { "" })?;
    }
    writeln!(to, "]}}")?;
    to.flush()
}

fn from_mission(ros: &RosArgs) -> Result<Everything> {
    let operator = Operator::start(ros)?;
    let desk = operator.desk(&graph::LIST_STRIPS)?;
    let mut requests = Vec::new();
    let mut call = msg::ListStripsRequest { limit: PAGE, with_requests: true, ..Default::default() };
    loop {
        let page = desk.call(call.clone())?;
        check(page.reason_code, &page.reason)?;
        call.after_id = page.strips.last().map_or(call.after_id, |status| status.strip.id);
        requests.extend(page.requests.iter().map(order_of).zip(page.strips));
        if !page.more {
            break;
        }
    }
    let desk = operator.desk(&graph::LIST_HISTORY)?;
    let mut trail = Vec::new();
    let mut call = msg::ListHistoryRequest { after_sequence: 0, limit: PAGE };
    loop {
        let page = desk.call(call)?;
        check(page.reason_code, &page.reason)?;
        call.after_sequence = page.entries.last().map_or(call.after_sequence, |entry| entry.sequence);
        trail.extend(page.entries);
        if !page.more {
            return Ok(Everything { requests, trail });
        }
    }
}

fn from_store(store: &Store) -> Result<Everything> {
    let requests = stored(store)?;
    let stamper = store.stamper()?;
    let mut trail: Vec<msg::HistoryEntry> = Vec::new();
    loop {
        let lines = store.trail(trail.last().map_or(0, |entry| entry.sequence), PAGE as usize)?;
        if lines.is_empty() {
            return Ok(Everything { requests, trail });
        }
        trail.extend(lines.iter().map(|line| history_entry(&stamper, line)));
    }
}
