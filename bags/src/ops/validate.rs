//! Checks that a bag is what it should be, down to every message.

use std::path::Path;

use serde::Serialize;

use crate::{
    error::{BagError, Result, chain},
    file::{
        records::{Body, DataEnd, MAGIC, op},
        scan::{Places, Source},
    },
    metadata::{BagInformation, FILE_NAME},
    ops::checks::TopicCheck,
    reader::{Bag, Filter},
};

/// Faults of one kind that are written out before the rest is only counted.
pub(super) const SHOWN: u64 = 5;

/// What validation found.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct Report {
    /// What makes the bag wrong.
    pub faults: Vec<String>,
    /// What is odd and allowed.
    pub warnings: Vec<String>,
    /// Messages checked.
    pub messages: u64,
    /// Findings by topic.
    pub topics: Vec<TopicReport>,
}

/// What validation found on one topic.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct TopicReport {
    /// Its name.
    pub topic: String,
    /// Its messages.
    pub messages: u64,
    /// Sequence numbers that are missing.
    pub missing: u64,
    /// Messages recorded after a later one.
    pub out_of_order: u64,
    /// Longest time between two messages [ns].
    pub longest_gap_ns: u64,
}

/// Checks profile, schemas, channel metadata, `metadata.yaml`, checksums, the CDR of every
/// message, sequence gaps, and time gaps longer than `max_gap_ns` where that is given.
///
/// # Errors
/// [`BagError`] only when the path cannot be read at all; damage is a fault of the report.
pub fn validate(path: &Path, max_gap_ns: Option<u64>) -> Result<Report> {
    let mut report = Report::default();
    let bag = match Bag::open(path) {
        Ok(bag) => bag,
        Err(error @ (BagError::Corrupt { .. } | BagError::NotABag { .. })) => {
            report.faults.push(chain(&error));
            return Ok(report);
        }
        Err(error) => return Err(error),
    };
    check_files(&bag, &mut report);
    let mut checks: Vec<TopicCheck> = bag.topics().iter().map(|topic| TopicCheck::new(topic, &mut report)).collect();
    check_messages(&bag, &mut checks, &mut report)?;
    for (check, topic) in checks.into_iter().zip(bag.topics()) {
        report.topics.push(check.finish(topic, max_gap_ns, &mut report.faults, &mut report.warnings));
    }
    let lost = bag.losses().total();
    if lost > 0 {
        report.warnings.push(format!("the recording lost {lost} messages"));
    }
    if path.is_dir() {
        check_yaml(&bag, &mut report);
    }
    Ok(report)
}

fn check_files(bag: &Bag, report: &mut Report) {
    for file in bag.files() {
        let path = file.path.display();
        if file.profile != "ros2" {
            report.faults.push(format!("{path}: profile {:?} is not \"ros2\"", file.profile));
        }
        if let Err(error) = check_data_section(&file.path) {
            report.faults.push(chain(&error));
        }
    }
}

/// Walks all records and compares the data section's checksum, where the file has one.
fn check_data_section(path: &Path) -> Result<()> {
    let source = Source::open(path)?;
    let mut crc = crc32fast::Hasher::new();
    crc.update(MAGIC);
    let mut bytes = Vec::new();
    for place in Places::new(&source) {
        let place = place?;
        if place.opcode != op::DATA_END {
            source.update_crc(place.offset, place.end(), &mut crc)?;
            continue;
        }
        place.read_body(&source, &mut bytes)?;
        let end = DataEnd::parse(&bytes).map_err(|reason| source.corrupt(place.offset, reason))?;
        let saved = end.data_section_crc;
        let found = crc.finalize();
        if saved != 0 && saved != found {
            let reason = format!("data section checksum is {found:08x}, not {saved:08x}");
            return Err(source.corrupt(place.offset, reason));
        }
        return Ok(());
    }
    Err(source.corrupt(source.len, "no data end record"))
}

/// Decodes every message; goes on behind a damaged chunk.
fn check_messages(bag: &Bag, checks: &mut [TopicCheck], report: &mut Report) -> Result<()> {
    let mut messages = bag.messages(&Filter::default())?;
    loop {
        match messages.next() {
            Ok(Some(message)) => {
                report.messages += 1;
                checks[message.topic].message(&message, &mut report.faults);
            }
            Ok(None) => return Ok(()),
            Err(error) => report.faults.push(chain(&error)),
        }
    }
}

/// Compares `metadata.yaml` with the files.
fn check_yaml(bag: &Bag, report: &mut Report) {
    let information = match BagInformation::read(bag.path()) {
        Ok(Some(information)) => information,
        Ok(None) => {
            report.faults.push(format!("{} is missing", bag.path().join(FILE_NAME).display()));
            return;
        }
        Err(error) => {
            report.faults.push(chain(&error));
            return;
        }
    };
    let mut differs = |what: &str, yaml: String, files: String| {
        if yaml != files {
            report.faults.push(format!("{FILE_NAME}: {what} is {yaml}, the files say {files}"));
        }
    };
    let (start, end) = bag.time_range().unwrap_or((0, 0));
    let yaml_start = information.starting_time.nanoseconds_since_epoch;
    differs("storage identifier", information.storage_identifier.clone(), "mcap".to_owned());
    differs("message count", information.message_count.to_string(), bag.message_count().to_string());
    differs("starting time", yaml_start.to_string(), start.to_string());
    differs("duration", information.duration.nanoseconds.to_string(), end.saturating_sub(start).to_string());
    let mut yaml: Vec<String> = information.relative_file_paths.clone();
    yaml.sort();
    let names = bag.files().into_iter().filter_map(|f| f.path.file_name().map(|n| n.to_owned()));
    let mut names: Vec<String> = names.map(|n| n.to_string_lossy().into_owned()).collect();
    names.sort();
    differs("list of files", yaml.join(", "), names.join(", "));
    let mut yaml: Vec<String> = information
        .topics_with_message_count
        .iter()
        .map(|t| {
            let topic = &t.topic_metadata;
            format!("{} {} {} {}", topic.name, topic.type_name, t.message_count, topic.type_description_hash)
        })
        .collect();
    yaml.sort();
    let describe =
        |t: &crate::BagTopic| format!("{} {} {} {}", t.topic.name, t.topic.type_name, t.messages, t.topic.type_hash);
    let mut topics: Vec<String> = bag.topics().iter().map(describe).collect();
    topics.sort();
    differs("list of topics", yaml.join(", "), topics.join(", "));
}
