//! Checks that a bag is what it should be, down to every message.

use std::collections::BTreeMap;
use std::path::Path;

use mcap::MAGIC;
use mcap::records::{Record, op};

use super::checks::TopicCheck;
use super::note;
use super::report::Report;
use crate::error::{BagError, Result, chain};
use crate::file::index::FileIndex;
use crate::file::parts::AttachmentRef;
use crate::file::record::{self, misplaced};
use crate::file::source::{ReadOptions, Source};
use crate::file::storage::Storage;
use crate::file::walk::Walk;
use crate::losses::{RESUMED, RESUMED_FILE};
use crate::metadata::{BagInformation, FILE_NAME};
use crate::reader::{Bag, Filter, metadata_path};

/// The version of `metadata.yaml` from which on it has types' hashes.
const HASH_SINCE: u32 = 7;

/// Checks profile, schemas, channel metadata, `metadata.yaml`, checksums, the CDR of every
/// message, sequence gaps, and time gaps longer than `max_gap_ns` where that is given.
///
/// # Errors
/// [`BagError`] only when the path cannot be read at all; damage is a fault of the report.
pub fn validate(path: &Path, max_gap_ns: Option<u64>, options: ReadOptions) -> Result<Report> {
    let bag = match Bag::open_all(&[path.to_owned()], options) {
        Ok(bag) => bag,
        Err(BagError::Io { action, path, source }) => return Err(BagError::Io { action, path, source }),
        Err(error) => return Ok(Report { faults: vec![chain(&error)], ..Report::default() }),
    };
    let mut report = validate_open(&bag, max_gap_ns)?;
    if path.is_dir() {
        check_yaml(&bag, &mut report);
    }
    Ok(report)
}

/// Checks an open bag as [`validate`] does, its `metadata.yaml` excepted.
///
/// # Errors
/// None that the bag's bytes cause.
pub fn validate_open(bag: &Bag, max_gap_ns: Option<u64>) -> Result<Report> {
    let mut report = Report { faults: bag.faults().to_vec(), ..Report::default() };
    for file in bag.indexes() {
        check_file(file, &mut report);
    }
    let mut checks: Vec<TopicCheck> = bag.topics().iter().map(|topic| TopicCheck::new(topic, &mut report)).collect();
    check_messages(bag, &mut checks, &mut report)?;
    for (check, topic) in checks.into_iter().zip(bag.topics()) {
        report.topics.push(check.finish(topic, max_gap_ns, &mut report.faults, &mut report.warnings));
    }
    name_interruptions(bag, &mut report);
    let lost = bag.losses().total();
    if lost > 0 {
        report.warnings.push(format!("the recording lost {lost} messages"));
    }
    Ok(report)
}

/// Names the files before which nobody recorded for a while, because the recording was interrupted.
fn name_interruptions(bag: &Bag, report: &mut Report) {
    for (_, metadata) in bag.metadata().iter().filter(|(name, _)| name == RESUMED) {
        if let Some(file) = metadata.get(RESUMED_FILE) {
            report.warnings.push(format!("the recording was interrupted, and goes on in {file}"));
        }
    }
}

fn check_file(file: &FileIndex, report: &mut Report) {
    let Storage::Mcap(source) = &file.storage else { return };
    if file.profile != "ros2" {
        let path = source.path.display();
        report.faults.push(format!("{path}: profile {:?} is not \"ros2\"", file.profile));
    }
    if let Err(error) = check_data_section(source) {
        report.faults.push(chain(&error));
    }
    for attachment in &file.attachments {
        if let Err(error) = check_attachment(source, attachment) {
            report.faults.push(chain(&error));
        }
    }
}

/// Walks all records and compares the data section's checksum, where the file has one.
fn check_data_section(source: &Source) -> Result<()> {
    let mut crc = crc32fast::Hasher::new();
    crc.update(MAGIC);
    let mut bytes = Vec::new();
    let mut walk = Walk::whole(source);
    while let Some(place) = walk.next().transpose()? {
        if place.opcode != op::DATA_END {
            source.for_each_piece(place.offset, place.end(), |piece| {
                crc.update(piece);
                Ok::<_, BagError>(())
            })?;
            continue;
        }
        walk.read_body(place, &mut bytes)?;
        let corrupt = |reason| source.corrupt(place.offset, reason);
        let saved = match record::parse(op::DATA_END, &bytes).map_err(corrupt)? {
            Record::DataEnd(end) => end.data_section_crc,
            other => return Err(corrupt(misplaced(op::DATA_END, &other))),
        };
        let found = crc.finalize();
        if saved != 0 && saved != found {
            return Err(corrupt(format!("data section checksum is {found:08x}, not {saved:08x}")));
        }
        return Ok(());
    }
    Err(source.corrupt(source.len, "no data end record"))
}

/// Compares an attachment's checksum, where it has one.
pub(super) fn check_attachment(source: &Source, attachment: &AttachmentRef) -> Result<()> {
    let mut crc = crc32fast::Hasher::new();
    let end = attachment.data_end;
    source.for_each_piece(attachment.place.body(), end, |piece| {
        crc.update(piece);
        Ok::<_, BagError>(())
    })?;
    let mut saved = [0; 4];
    source.read_at(end, &mut saved)?;
    let (saved, found) = (u32::from_le_bytes(saved), crc.finalize());
    if saved != 0 && saved != found {
        let reason = format!("attachment checksum is {found:08x}, not {saved:08x}");
        return Err(source.corrupt(attachment.place.offset, reason));
    }
    Ok(())
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
            Err(error) => note(&mut report.faults, &error),
        }
    }
}

/// Compares `metadata.yaml` with the files.
fn check_yaml(bag: &Bag, report: &mut Report) {
    let information = match BagInformation::read(bag.path()) {
        Ok(Some(information)) => information,
        Ok(None) => {
            report.faults.push(format!("{} is missing", metadata_path(bag.path()).display()));
            return;
        }
        // The bag has told it.
        Err(_) => return,
    };
    let mut differs = |what: &str, yaml: String, files: String| {
        if yaml != files {
            report.faults.push(format!("{FILE_NAME}: {what} is {yaml}, the files say {files}"));
        }
    };
    let files = bag.files();
    let storage = files.first().map_or("mcap", |file| file.storage);
    differs("storage identifier", information.storage_identifier.clone(), storage.to_owned());
    differs("message count", information.message_count.to_string(), bag.message_count().to_string());
    // Without messages there is no start that could be wrong.
    if let Some((start, end)) = bag.time_range() {
        differs("starting time", information.starting_time.nanoseconds_since_epoch.to_string(), start.to_string());
        differs("duration", information.duration.nanoseconds.to_string(), (end - start).to_string());
    }
    let name = |path: &Path| path.file_name().map(|name| name.to_string_lossy().into_owned());
    let mut yaml: Vec<String> = information.relative_file_paths.iter().filter_map(|f| name(Path::new(f))).collect();
    yaml.sort();
    let mut names: Vec<String> = files.iter().filter_map(|f| name(&f.path)).collect();
    names.sort();
    differs("list of files", yaml.join(", "), names.join(", "));
    let (yaml, topics) = (listed_topics(&information), found_topics(bag, information.version));
    differs("list of topics", yaml.join(", "), topics.join(", "));
}

/// Name, type, count and hash of the topics in `metadata.yaml`.
fn listed_topics(information: &BagInformation) -> Vec<String> {
    let topics = information.topics_with_message_count.iter().map(|t| {
        let topic = &t.topic_metadata;
        described(&topic.name, &topic.type_name, t.message_count, &topic.type_description_hash)
    });
    let mut topics: Vec<String> = topics.collect();
    topics.sort();
    topics
}

/// The same of the topics in the files, as a version of `metadata.yaml` tells it.
fn found_topics(bag: &Bag, version: u32) -> Vec<String> {
    let mut topics: BTreeMap<(&str, &str), (u64, &str)> = BTreeMap::new();
    for topic in bag.topics() {
        let hash = if version >= HASH_SINCE { topic.topic.type_hash() } else { "" };
        let (count, _) = topics.entry((&topic.topic.name, &topic.topic.type_name)).or_insert((0, hash));
        *count += topic.messages;
    }
    let mut topics: Vec<String> =
        topics.into_iter().map(|((name, kind), (count, hash))| described(name, kind, count, hash)).collect();
    topics.sort();
    topics
}

fn described(name: &str, kind: &str, count: u64, hash: &str) -> String {
    format!("{name} {kind} {count} {hash}")
}
