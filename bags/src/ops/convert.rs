//! Writes bags anew with other settings, as rosbag2's file of output options says.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use regex::Regex;
use serde::Deserialize;
use yaml_serde::{Mapping, Value};

use super::copy::{Copied, Sequences, copy};
use crate::error::{BagError, Result};
use crate::file::chunk::Compression;
use crate::file::source::ReadOptions;
use crate::preset::Preset;
use crate::qos::{QosOverride, QosProfile};
use crate::reader::{Bag, Filter, TopicPattern};
use crate::tap::is_hidden;
use crate::topic::Topic;
use crate::writer::BagOptions;

/// The option in error texts.
const OPTION: &str = "--output-options";

/// The file of output options.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    output_bags: Vec<Mapping>,
}

/// One bag that is written: rosbag2's storage options and record options.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Output {
    uri: PathBuf,
    storage_id: String,
    max_bagfile_size: u64,
    max_bagfile_duration: u64,
    storage_preset_profile: String,
    custom_data: BTreeMap<String, String>,
    start_time_ns: Option<i64>,
    end_time_ns: Option<i64>,
    all: bool,
    all_topics: bool,
    all_services: bool,
    topics: Vec<String>,
    topic_types: Vec<String>,
    services: Vec<String>,
    regex: String,
    /// `exclude` in older files.
    #[serde(alias = "exclude")]
    exclude_regex: String,
    exclude_topics: Vec<String>,
    exclude_topic_types: Vec<String>,
    exclude_services: Vec<String>,
    rmw_serialization_format: String,
    compression_mode: String,
    compression_format: String,
    topic_qos_profile_overrides: BTreeMap<String, QosOverride>,
    include_hidden_topics: bool,
}

/// Keys that mean something to a recording only, or to how rosbag2 goes about its work.
const OF_RECORDINGS: [&str; 14] = [
    "max_cache_size",
    "storage_config_uri",
    "snapshot_mode",
    "is_discovery_disabled",
    "topic_polling_interval",
    "node_prefix",
    "compression_queue_size",
    "compression_threads",
    "compression_threads_priority",
    "include_unpublished_topics",
    "ignore_leaf_topics",
    "start_paused",
    "use_sim_time",
    "disable_keyboard_controls",
];

/// Reads some bags as one and writes them as often as the options say; each new bag with its path.
///
/// # Errors
/// [`BagError::Option`] when the options are not understood or ask for what is not written, and whatever reading and
/// writing report.
pub fn convert(from: &[PathBuf], options: &Path, read: ReadOptions) -> Result<Vec<(PathBuf, Copied)>> {
    let text = fs::read_to_string(options).map_err(BagError::io("read", options))?;
    let refuse =
        |reason: String| BagError::Option { option: OPTION, reason: format!("{}: {reason}", options.display()) };
    let document: Document = yaml_serde::from_str(&text).map_err(|e| refuse(e.to_string()))?;
    let mut bag = Bag::open_all(from, read)?;
    let sequences = if from.len() == 1 { Sequences::Keep } else { Sequences::Renew };
    let outputs = document.output_bags.into_iter().map(|keys| Output::new(keys).map_err(&refuse));
    let outputs = outputs.collect::<Result<Vec<_>>>()?;
    let outputs = outputs.iter().map(|output| {
        let selected = Selected::new(output).map_err(&refuse)?;
        Ok((output, output.bag_options().map_err(&refuse)?, selected))
    });
    // Everything is checked before anything is written.
    let outputs = outputs.collect::<Result<Vec<_>>>()?;
    let mut copied = Vec::new();
    for (output, options, selected) in outputs {
        let names = bag.topics().iter().filter(|topic| selected.takes(&topic.topic));
        let names = names.map(|topic| topic.topic.name.clone()).collect();
        let filter = Filter { topics: TopicPattern::only(names), from: output.from(), until: output.until() };
        bag.change_qos(&output.topic_qos_profile_overrides)?;
        copied.push((output.uri.clone(), copy(&bag, &filter, &output.uri, options, sequences)?));
    }
    Ok(copied)
}

impl Output {
    fn new(mut keys: Mapping) -> Result<Self, String> {
        for key in OF_RECORDINGS {
            keys.remove(key);
        }
        yaml_serde::from_value(Value::Mapping(keys)).map_err(|e| e.to_string())
    }

    fn bag_options(&self) -> Result<BagOptions, String> {
        if self.uri.as_os_str().is_empty() {
            return Err("an output bag has no uri".to_owned());
        }
        if !matches!(self.storage_id.as_str(), "" | "mcap") {
            return Err(format!("storage_id {:?} is not written, only mcap is", self.storage_id));
        }
        if !matches!(self.rmw_serialization_format.as_str(), "" | "cdr") {
            let format = &self.rmw_serialization_format;
            return Err(format!("rmw_serialization_format {format:?} is not written, only cdr is"));
        }
        let mut options = BagOptions {
            max_file_bytes: Some(self.max_bagfile_size).filter(|size| *size > 0),
            max_file_duration: Some(Duration::from_secs(self.max_bagfile_duration)).filter(|d| !d.is_zero()),
            custom_data: self.custom_data.clone(),
            ..BagOptions::default()
        };
        if let Some(preset) = Preset::named(&self.storage_preset_profile)? {
            preset.apply(&mut options);
        }
        // What rosbag2 compresses message by message or as a whole file is compressed in chunks, which all readers read.
        match self.compression_mode.to_ascii_lowercase().as_str() {
            "" | "none" => {}
            "message" | "file" => {
                let format = if self.compression_format.is_empty() { "zstd" } else { &self.compression_format };
                options.compression = format.parse::<Compression>().map_err(|e| e.to_string())?;
            }
            other => return Err(format!("compression_mode {other:?} is none of none, file, message")),
        }
        Ok(options)
    }

    fn from(&self) -> u64 {
        self.start_time_ns.map_or(0, |time| time.max(0).unsigned_abs())
    }

    fn until(&self) -> u64 {
        self.end_time_ns.and_then(|time| u64::try_from(time).ok()).unwrap_or(u64::MAX)
    }
}

/// Which topics go into a bag.
struct Selected<'a> {
    output: &'a Output,
    regex: Option<Regex>,
    exclude: Option<Regex>,
}

impl<'a> Selected<'a> {
    fn new(output: &'a Output) -> Result<Self, String> {
        let expression = |text: &str| match text {
            "" => Ok(None),
            text => Regex::new(text).map(Some).map_err(|e| e.to_string()),
        };
        Ok(Self { output, regex: expression(&output.regex)?, exclude: expression(&output.exclude_regex)? })
    }

    /// As rosbag2 decides: services by their events' topics, expressions by a part of the name.
    fn takes(&self, topic: &Topic) -> bool {
        let output = self.output;
        let among = |names: &[String], name: &str| names.iter().any(|known| known == name);
        let matches = |regex: &Option<Regex>, name: &str| regex.as_ref().is_some_and(|regex| regex.is_match(name));
        if let Some(service) = topic.name.strip_suffix("/_service_event") {
            let wanted = output.all || output.all_services || among(&output.services, service);
            let excluded = among(&output.exclude_services, service) || matches(&self.exclude, service);
            return (wanted || matches(&self.regex, service)) && !excluded;
        }
        let wanted = output.all
            || output.all_topics
            || among(&output.topics, &topic.name)
            || among(&output.topic_types, &topic.type_name)
            || matches(&self.regex, &topic.name);
        let excluded = among(&output.exclude_topics, &topic.name)
            || among(&output.exclude_topic_types, &topic.type_name)
            || matches(&self.exclude, &topic.name);
        let hidden = is_hidden(&topic.name) && !output.include_hidden_topics && !among(&output.topics, &topic.name);
        wanted && !excluded && !hidden
    }
}

impl Bag {
    /// Changes the QoS that topics are said to have been offered with.
    fn change_qos(&mut self, changes: &BTreeMap<String, QosOverride>) -> Result<()> {
        for topic in self.topics_mut() {
            if let Some(change) = changes.get(&topic.name) {
                let offered = topic.qos.first().copied().unwrap_or(QosProfile::reliable(10));
                topic.set_qos(vec![change.apply(offered)])?;
            }
        }
        Ok(())
    }
}
