//! What is in a bag, as `ros2 bag info` tells it, with the mission's facts.

use std::collections::BTreeMap;
use std::fmt::{self, Display, Formatter};

use chrono::DateTime;
use serde::Serialize;

use crate::error::Result;
use crate::losses::RECORDING;
use crate::qos::{self, QosProfile};
use crate::reader::{Bag, BagTopic, Filter};

/// Longest metadata value that is printed [characters].
const VALUE_LEN: usize = 100;

/// A bag's facts.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Info {
    /// Files in order of time.
    pub files: Vec<String>,
    /// Size of all files [bytes].
    pub bytes: u64,
    /// `mcap` or `sqlite3`.
    pub storage: String,
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
    /// Services whose events were recorded, in order of name.
    pub services: Vec<ServiceInfo>,
    /// Attachments in order of the files.
    pub attachments: Vec<AttachmentInfo>,
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
    /// What is told on request.
    #[serde(flatten)]
    pub details: Option<TopicDetails>,
}

/// More facts of a topic.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct TopicDetails {
    /// Size of its messages [bytes].
    pub message_bytes: u64,
    /// `ros2msg` and others; empty when no schema is known.
    pub schema_encoding: String,
    /// What the publishers offered.
    pub offered_qos_profiles: Vec<QosProfile>,
}

/// A service's facts.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ServiceInfo {
    /// Its name.
    pub name: String,
    /// `pkg/srv/Type`.
    #[serde(rename = "type")]
    pub type_name: String,
    /// Its events.
    pub events: u64,
    /// Requests and responses among them, each counted where it was sent and where it was received; told on request.
    #[serde(flatten)]
    pub details: Option<ServiceDetails>,
}

/// Events of a service by their kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct ServiceDetails {
    /// Requests.
    pub requests: u64,
    /// Responses.
    pub responses: u64,
}

/// An attachment's facts.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct AttachmentInfo {
    /// Its name.
    pub name: String,
    /// Its media type.
    pub media_type: String,
    /// Length of its data [bytes].
    pub bytes: u64,
    /// Time of recording [ns].
    pub log_time_ns: u64,
}

/// Gathers a bag's facts.
pub fn info(bag: &Bag) -> Info {
    let files = bag.files();
    let mut compressions: Vec<String> = files.iter().flat_map(|f| f.compressions.keys()).cloned().collect();
    compressions.iter_mut().filter(|c| c.is_empty()).for_each(|c| *c = "none".to_owned());
    compressions.sort();
    compressions.dedup();
    let mut metadata = BTreeMap::new();
    for (name, pairs) in bag.metadata().into_iter().filter(|(name, _)| name != RECORDING) {
        metadata.entry(name).or_insert(pairs);
    }
    let attachments = bag.attachments().into_iter().map(|attachment| AttachmentInfo {
        name: attachment.name,
        media_type: attachment.media_type,
        bytes: attachment.bytes,
        log_time_ns: attachment.log_time,
    });
    let name = |path: &std::path::Path| path.file_name().map(|n| n.to_string_lossy().into_owned());
    let topics = topics(bag.topics());
    Info {
        bytes: files.iter().map(|f| f.bytes).sum(),
        storage: files.first().map_or("mcap", |file| file.storage).to_owned(),
        compressions,
        ros_distro: bag.information().map(|i| i.ros_distro.clone()).unwrap_or_default(),
        start_ns: bag.time_range().map(|(start, _)| start),
        end_ns: bag.time_range().map(|(_, end)| end),
        messages: bag.message_count(),
        lost: bag.losses().total(),
        services: topics.iter().filter_map(service).collect(),
        topics,
        attachments: attachments.collect(),
        metadata,
        files: files.iter().filter_map(|f| name(&f.path)).collect(),
    }
}

/// Gathers a bag's facts, and those that take a look at every message.
///
/// # Errors
/// [`crate::BagError::Corrupt`] when a chunk is damaged.
pub fn info_in_detail(bag: &Bag) -> Result<Info> {
    let mut info = info(bag);
    let mut places = BTreeMap::new();
    for (index, known) in bag.topics().iter().enumerate() {
        let same = |topic: &TopicInfo| is_same(topic, known);
        if let Some(place) = info.topics.iter().position(same) {
            places.insert(index, place);
            let details = info.topics[place].details.get_or_insert_with(|| TopicDetails {
                message_bytes: 0,
                schema_encoding: known.topic.schema_encoding().to_owned(),
                offered_qos_profiles: Vec::new(),
            });
            details.offered_qos_profiles.extend(&known.topic.qos);
        }
    }
    let mut events: BTreeMap<String, ServiceDetails> = BTreeMap::new();
    let mut messages = bag.messages(&Filter::default())?;
    while let Some(message) = messages.next()? {
        let topic = &mut info.topics[places[&message.topic]];
        if let Some(details) = &mut topic.details {
            details.message_bytes += message.data.len() as u64;
        }
        if let Some(service) = service(topic) {
            let counts = events.entry(service.name).or_default();
            // The kind of event is the first byte behind the encapsulation header: requests are 0 and 1.
            match message.data.get(4) {
                Some(0 | 1) => counts.requests += 1,
                Some(_) => counts.responses += 1,
                None => {}
            }
        }
    }
    for service in &mut info.services {
        service.details = Some(events.remove(&service.name).unwrap_or_default());
    }
    Ok(info)
}

/// Topics of one name, type and encoding as one.
fn topics(all: &[BagTopic]) -> Vec<TopicInfo> {
    let mut topics: Vec<TopicInfo> = Vec::new();
    for known in all {
        // They stand in order of name.
        match topics.iter_mut().rev().take_while(|t| t.name == known.topic.name).find(|t| is_same(t, known)) {
            Some(topic) => topic.messages = topic.messages.saturating_add(known.messages),
            None => topics.push(TopicInfo {
                name: known.topic.name.clone(),
                type_name: known.topic.type_name.clone(),
                messages: known.messages,
                serialization_format: known.topic.message_encoding.clone(),
                type_hash: known.topic.type_hash().to_owned(),
                details: None,
            }),
        }
    }
    topics
}

fn is_same(topic: &TopicInfo, known: &BagTopic) -> bool {
    let known = &known.topic;
    let ours = (&topic.name, &topic.type_name, &topic.serialization_format);
    ours == (&known.name, &known.type_name, &known.message_encoding)
}

/// The service whose events a topic holds.
fn service(topic: &TopicInfo) -> Option<ServiceInfo> {
    let name = topic.name.strip_suffix("/_service_event")?;
    let type_name = topic.type_name.strip_suffix("_Event")?;
    Some(ServiceInfo { name: name.to_owned(), type_name: type_name.to_owned(), events: topic.messages, details: None })
}

impl Display for Info {
    /// As `ros2 bag info` prints it, then the metadata records.
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let (start, end) = (self.start_ns.unwrap_or(0), self.end_ns.unwrap_or(0));
        writeln!(f)?;
        list(f, "Files:", &self.files)?;
        writeln!(f, "{:<19}{}", "Bag size:", size(self.bytes))?;
        writeln!(f, "{:<19}{}", "Storage id:", self.storage)?;
        writeln!(f, "{:<19}{}", "Compression:", self.compressions.join(", "))?;
        writeln!(f, "{:<19}{}", "ROS Distro:", self.ros_distro)?;
        writeln!(f, "{:<19}{}s", "Duration:", seconds(end.saturating_sub(start)))?;
        writeln!(f, "{:<19}{}", "Start:", date(start))?;
        writeln!(f, "{:<19}{}", "End:", date(end))?;
        writeln!(f, "{:<19}{}", "Messages:", self.messages)?;
        writeln!(f, "{:<19}{}", "Lost:", self.lost)?;
        list(f, "Topic information:", &self.topics.iter().flat_map(topic_lines).collect::<Vec<_>>())?;
        if !self.services.is_empty() {
            writeln!(f, "{:<19}{}", "Service:", self.services.len())?;
            list(f, "Service information:", &self.services.iter().map(service_line).collect::<Vec<_>>())?;
        }
        if !self.attachments.is_empty() {
            let line = |a: &AttachmentInfo| format!("{} | {} | {}", a.name, a.media_type, size(a.bytes));
            list(f, "Attachments:", &self.attachments.iter().map(line).collect::<Vec<_>>())?;
        }
        for (name, pairs) in &self.metadata {
            writeln!(f, "\n{name}:")?;
            for (key, value) in pairs {
                writeln!(f, "  {key}: {}", shortened(value))?;
            }
        }
        Ok(())
    }
}

fn topic_lines(topic: &TopicInfo) -> Vec<String> {
    let (name, kind, n, format) = (&topic.name, &topic.type_name, topic.messages, &topic.serialization_format);
    let Some(details) = &topic.details else {
        return vec![format!("Topic: {name} | Type: {kind} | Count: {n} | Serialization Format: {format}")];
    };
    let bytes = size(details.message_bytes);
    let (hash, encoding) = (or_none(&topic.type_hash), or_none(&details.schema_encoding));
    let mut lines = vec![
        format!(
            "Topic: {name} | Type: {kind} | Count: {n} | Size Contribution: {bytes} | Serialization Format: {format}"
        ),
        format!("  Type hash: {hash} | Schema: {encoding}"),
    ];
    lines.extend(details.offered_qos_profiles.iter().map(|profile| format!("  QoS: {}", qos::in_a_line(profile))));
    lines
}

fn service_line(service: &ServiceInfo) -> String {
    let ServiceInfo { name, type_name, events, details } = service;
    let mut line = format!("Service: {name} | Type: {type_name} | Event Count: {events}");
    if let Some(ServiceDetails { requests, responses }) = details {
        line += &format!(" | Requests: {requests} | Responses: {responses}");
    }
    line
}

fn or_none(text: &str) -> &str {
    if text.is_empty() { "none" } else { text }
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
    let time = DateTime::from_timestamp((ns / 1_000_000_000).cast_signed(), (ns % 1_000_000_000) as u32);
    format!("{} UTC ({})", time.unwrap_or_default().format("%Y-%m-%d %H:%M:%S%.3f"), seconds(ns))
}
