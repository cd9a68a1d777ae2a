//! `swath strips export`: every strip with its history, and the audit trail.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, ErrorKind, Write};
use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::Args;
use serde_json::{Value, json};
use swath_msgs::swath_msgs as msg;
use swath_ros::graph;

use super::client::{Operator, check};
use super::show::{history_json, state_name, status_json};
use crate::requests::store::Store;
use swath_mission::orders::geojson::feature_of;

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
const PAGE: u32 = 100;

/// What is exported: features, and the audit trail.
struct Everything {
    features: Vec<Value>,
    trail: Vec<Value>,
}

/// Exports strips or the audit trail.
///
/// # Errors
/// When the mission does not answer, the store cannot be read, or the file cannot be written.
pub fn export(args: &ExportArgs) -> Result<()> {
    let everything = match &args.store {
        Some(path) => from_store(&Store::open_read_only(path)?)?,
        None => from_mission()?,
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
    let Everything { mut features, trail: lines } = everything;
    if trail {
        for line in &lines {
            writeln!(to, "{line}")?;
        }
        return to.flush();
    }
    let mut histories: BTreeMap<u64, Vec<Value>> = BTreeMap::new();
    for line in lines {
        histories.entry(line["strip"].as_u64().unwrap_or(0)).or_default().push(line);
    }
    writeln!(to, "{{\"type\":\"FeatureCollection\",\"features\":[")?;
    let count = features.len();
    for (i, feature) in features.iter_mut().enumerate() {
        let id = feature["properties"]["id"].as_u64().unwrap_or(0);
        feature["properties"]["history"] = histories.remove(&id).unwrap_or_default().into();
        writeln!(to, "{feature}{}", if i + 1 < count { "," } else { "" })?;
    }
    writeln!(to, "]}}")?;
    to.flush()
}

fn from_mission() -> Result<Everything> {
    let operator = Operator::start()?;
    let desk = operator.desk(&graph::LIST_STRIPS)?;
    let mut features = Vec::new();
    let mut call = msg::ListStripsRequest { limit: PAGE, ..Default::default() };
    loop {
        let page = desk.call(call.clone())?;
        check(page.reason_code, &page.reason)?;
        features.extend(page.strips.iter().map(|status| {
            let mut properties = status_json(status);
            let coordinates = json!([properties["start"].take(), properties["end"].take()]);
            json!({
                "type": "Feature", "properties": properties,
                "geometry": { "type": "LineString", "coordinates": coordinates },
            })
        }));
        call.after_id = page.strips.last().map_or(call.after_id, |status| status.strip.id);
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
        trail.extend(page.entries.iter().map(history_json));
        call.after_sequence = page.entries.last().map_or(call.after_sequence, |entry| entry.sequence);
        if !page.more {
            return Ok(Everything { features, trail });
        }
    }
}

fn from_store(store: &Store) -> Result<Everything> {
    let features = (1_u64..).zip(store.snapshot()?.requests).map(|(id, stored)| {
        let request = stored.request;
        let mut feature = feature_of(&request.named);
        let properties = &mut feature["properties"];
        properties["id"] = id.into();
        properties["state"] = request.state.name().into();
        properties["reason_code"] = request.reason.0.into();
        properties["reason"] = request.reason.1.into();
        properties["attempts"] = request.standing.attempts.into();
        properties["reward"] = request.standing.reward.into();
        feature
    });
    let features = features.collect();
    let mut trail = Vec::new();
    let mut after = 0;
    loop {
        let lines = store.trail(after, PAGE as usize)?;
        let Some(last) = lines.last() else { return Ok(Everything { features, trail }) };
        after = last.sequence;
        trail.extend(lines.iter().map(|line| {
            json!({
                "sequence": line.sequence, "strip": line.id.0, "client_ref": line.client_ref, "name": line.name,
                "tick": line.tick.0, "state": state_name(line.state.number()), "reason_code": line.reason.0,
                "reason": line.reason.1, "actor": line.actor,
            })
        }));
    }
}
