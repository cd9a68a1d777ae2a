//! What is in a bag, as `ros2 bag info` tells it, with the mission's facts.

use std::{
    collections::BTreeMap,
    fmt::{self, Display, Formatter},
};

use serde::Serialize;

use crate::{reader::Bag, writer::RECORDING};

/// Longest metadata value that is printed [characters].
const VALUE_LEN: usize = 100;

/// A bag's facts.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Info {
    /// Files in order of time.
    pub files: Vec<String>,
    /// Size of all files [bytes].
    pub bytes: u64,
    /// Chunk compressions in use; "none" for uncompressed chunks.
    pub compressions: Vec<String>,
    /// ROS distribution of `metadata.yaml`; empty without it.
    pub ros_distro: String,
    /// Earliest log time [ns]; `None` without messages.
    pub start_ns: Option<u64>,
    /// Latest log time [ns]; `None` without messages.
    pub end_ns: Option<u64>,
    /// Messages in all files.
    pub messages: u64,
    /// Messages that the recording lost.
    pub lost: u64,
    /// Topics in order of name.
    pub topics: Vec<TopicInfo>,
    /// Metadata records by name; of one name the first.
    pub metadata: BTreeMap<String, BTreeMap<String, String>>,
}

/// A topic's facts.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct TopicInfo {
    /// Its name.
    pub name: String,
    /// `pkg/msg/Type`.
    #[serde(rename = "type")]
    pub type_name: String,
    /// Its messages.
    pub messages: u64,
    /// `cdr`.
    pub serialization_format: String,
    /// `RIHS01_…`, or empty.
    pub type_hash: String,
}

/// Gathers a bag's facts.
pub fn info(bag: &Bag) -> Info {
    let files = bag.files();
    let mut compressions: Vec<String> = files.iter().flat_map(|f| f.compressions.keys()).cloned().collect();
    compressions.iter_mut().filter(|c| c.is_empty()).for_each(|c| *c = "none".to_owned());
    compressions.sort();
    compressions.dedup();
    let topics = bag.topics().iter().map(|t| TopicInfo {
        name: t.topic.name.clone(),
        type_name: t.topic.type_name.clone(),
        messages: t.messages,
        serialization_format: t.topic.message_encoding.clone(),
        type_hash: t.topic.type_hash.clone(),
    });
    let mut metadata = BTreeMap::new();
    for (name, pairs) in bag.metadata().into_iter().filter(|(name, _)| name != RECORDING) {
        metadata.entry(name).or_insert(pairs);
    }
    let name = |path: &std::path::Path| path.file_name().map(|n| n.to_string_lossy().into_owned());
    Info {
        bytes: files.iter().map(|f| f.bytes).sum(),
        compressions,
        ros_distro: bag.information().map(|i| i.ros_distro.clone()).unwrap_or_default(),
        start_ns: bag.time_range().map(|(start, _)| start),
        end_ns: bag.time_range().map(|(_, end)| end),
        messages: bag.message_count(),
        lost: bag.losses().total(),
        topics: topics.collect(),
        metadata,
        files: files.iter().filter_map(|f| name(&f.path)).collect(),
    }
}

impl Display for Info {
    /// As `ros2 bag info` prints it, then the metadata records.
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let (start, end) = (self.start_ns.unwrap_or(0), self.end_ns.unwrap_or(0));
        writeln!(f)?;
        list(f, "Files:", &self.files)?;
        writeln!(f, "{:<19}{}", "Bag size:", size(self.bytes))?;
        writeln!(f, "{:<19}mcap", "Storage id:")?;
        writeln!(f, "{:<19}{}", "Compression:", self.compressions.join(", "))?;
        writeln!(f, "{:<19}{}", "ROS Distro:", self.ros_distro)?;
        writeln!(f, "{:<19}{}s", "Duration:", seconds(end.saturating_sub(start)))?;
        writeln!(f, "{:<19}{}", "Start:", date(start))?;
        writeln!(f, "{:<19}{}", "End:", date(end))?;
        writeln!(f, "{:<19}{}", "Messages:", self.messages)?;
        writeln!(f, "{:<19}{}", "Lost:", self.lost)?;
        let topic = |t: &TopicInfo| {
            let (name, kind, n) = (&t.name, &t.type_name, t.messages);
            let format = &t.serialization_format;
            format!("Topic: {name} | Type: {kind} | Count: {n} | Serialization Format: {format}")
        };
        list(f, "Topic information:", &self.topics.iter().map(topic).collect::<Vec<_>>())?;
        for (name, pairs) in &self.metadata {
            writeln!(f, "\n{name}:")?;
            for (key, value) in pairs {
                writeln!(f, "  {key}: {}", shortened(value))?;
            }
        }
        Ok(())
    }
}

/// A label with its values, one a line.
fn list(f: &mut Formatter<'_>, label: &str, values: &[String]) -> fmt::Result {
    let mut label = label;
    for value in values {
        writeln!(f, "{label:<19}{value}")?;
        label = "";
    }
    if values.is_empty() {
        writeln!(f, "{label}")?;
    }
    Ok(())
}

fn shortened(value: &str) -> String {
    match value.chars().count() {
        len if len > VALUE_LEN || value.contains('\n') => {
            let start: String = value.lines().next().unwrap_or("").chars().take(60).collect();
            format!("{start}… ({} bytes)", value.len())
        }
        _ => value.to_owned(),
    }
}

fn size(bytes: u64) -> String {
    let mut value = bytes as f64;
    for unit in ["B", "KiB", "MiB"] {
        if value < 1024.0 {
            return format!("{value:.1} {unit}");
        }
        value /= 1024.0;
    }
    format!("{value:.1} GiB")
}

fn seconds(ns: u64) -> String {
    format!("{}.{:09}", ns / 1_000_000_000, ns % 1_000_000_000)
}

/// `2026-01-31 12:00:00.000 UTC (1769860800.000000000)`.
fn date(ns: u64) -> String {
    let day = crate::date::date(ns / 1_000_000_000);
    format!("{day}.{:03} UTC ({})", ns / 1_000_000 % 1000, seconds(ns))
}
