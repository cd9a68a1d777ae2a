//! Writes a bag's `metadata.yaml` anew, from its files.

use std::collections::BTreeMap;
use std::path::Path;

use crate::error::Result;
use crate::file::source::{ReadOptions, is_packed};
use crate::metadata::{self, BagInformation, FileInformation, Nanoseconds, SinceEpoch, TopicCount, TopicMetadata};
use crate::reader::{Bag, BagFile};

/// Reads the index of every bag file in a directory and writes `metadata.yaml`; what one told before of more than the
/// files is kept. Returns what could not be read.
///
/// # Errors
/// [`crate::BagError::NotABag`] when there is no file, [`crate::BagError::Corrupt`] when none can be read, and
/// [`crate::BagError::Io`] when the directory cannot be written.
pub fn reindex(dir: &Path, options: ReadOptions) -> Result<(BagInformation, Vec<String>)> {
    let before = BagInformation::read(dir).ok().flatten();
    let bag = Bag::open_directory(dir, options)?;
    let told = before.as_ref().or(bag.information());
    let files: Vec<FileInformation> = bag.files().iter().map(file_information).collect();
    let (start, end) = bag.time_range().unwrap_or((0, 0));
    let packed = bag.files().iter().any(|file| is_packed(&file.path));
    let by_message = told.filter(|told| told.compression_mode.eq_ignore_ascii_case("message"));
    let (compression_format, compression_mode) = match (packed, by_message) {
        (true, _) => ("zstd".to_owned(), "FILE".to_owned()),
        (false, Some(told)) => (told.compression_format.clone(), told.compression_mode.clone()),
        (false, None) => (String::new(), String::new()),
    };
    let information = BagInformation {
        version: metadata::VERSION,
        storage_identifier: bag.files().first().map_or("mcap", |file| file.storage).to_owned(),
        duration: Nanoseconds { nanoseconds: end - start },
        starting_time: SinceEpoch { nanoseconds_since_epoch: start },
        message_count: bag.message_count(),
        topics_with_message_count: topics(&bag),
        compression_format,
        compression_mode,
        relative_file_paths: files.iter().map(|file| file.path.clone()).collect(),
        files,
        custom_data: told.and_then(|told| told.custom_data.clone()),
        ros_distro: told.map(|told| told.ros_distro.clone()).unwrap_or_default(),
    };
    information.write(dir)?;
    Ok((information, bag.faults().to_vec()))
}

fn file_information(file: &BagFile) -> FileInformation {
    FileInformation {
        path: file.path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default(),
        starting_time: SinceEpoch { nanoseconds_since_epoch: file.start },
        duration: Nanoseconds { nanoseconds: file.end - file.start },
        message_count: file.messages,
    }
}

/// Each topic once, in order of name.
fn topics(bag: &Bag) -> Vec<TopicCount> {
    let mut topics: BTreeMap<(&str, &str), TopicCount> = BTreeMap::new();
    for known in bag.topics() {
        let topic = &known.topic;
        let count = topics.entry((&topic.name, &topic.type_name)).or_insert_with(|| TopicCount {
            topic_metadata: TopicMetadata {
                name: topic.name.clone(),
                type_name: topic.type_name.clone(),
                serialization_format: topic.message_encoding.clone(),
                offered_qos_profiles: topic.qos.clone(),
                type_description_hash: topic.type_hash().to_owned(),
            },
            message_count: 0,
        });
        count.message_count += known.messages;
    }
    topics.into_values().collect()
}
