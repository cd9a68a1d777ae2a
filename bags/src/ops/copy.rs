//! Copies messages from bags into a new one: filtering and merging.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use crate::{
    error::Result,
    reader::{Bag, Filter},
    writer::{BagOptions, BagSummary, BagWriter, Losses, RECORDING},
};

/// Copies what a filter lets through into a new bag; metadata records come along.
///
/// # Errors
/// [`crate::BagError::Exists`] when `to` is there, and whatever reading and writing report.
pub fn filter(from: &Bag, filter: &Filter, to: &Path, options: BagOptions) -> Result<BagSummary> {
    copy(from, filter, to, options, Sequences::Keep)
}

/// Merges bags into a new one, in order of time.
///
/// # Errors
/// [`crate::BagError::Topic`] when two bags have a topic with different types, and as [`filter()`].
pub fn merge(from: &[PathBuf], to: &Path, options: BagOptions) -> Result<BagSummary> {
    let bag = Bag::open_all(from)?;
    copy(&bag, &Filter::default(), to, options, Sequences::Renew)
}

/// What becomes of the messages' sequence numbers.
#[derive(Clone, Copy, PartialEq)]
enum Sequences {
    /// A gap in the recording stays visible.
    Keep,
    /// Those of several recordings would contradict each other.
    Renew,
}

fn copy(from: &Bag, filter: &Filter, to: &Path, mut options: BagOptions, sequences: Sequences) -> Result<BagSummary> {
    let mut messages = from.messages(filter)?;
    if let Some(information) = from.information() {
        let custom_data = information.custom_data.clone().unwrap_or_default();
        options.custom_data.extend(custom_data);
        options.ros_distro.clone_from(&information.ros_distro);
    }
    let writer = BagWriter::create(to, options)?;
    copy_metadata(&from.metadata(), &writer);
    let mut topics = BTreeMap::new();
    for (index, topic) in from.topics().iter().enumerate() {
        if filter.topics.selects(&topic.topic.name) {
            topics.insert(index, writer.add_topic(&topic.topic)?);
        }
    }
    while let Some(message) = messages.next()? {
        let topic = topics[&message.topic];
        let written = match sequences {
            Sequences::Keep => writer.copy(topic, &message),
            Sequences::Renew => writer.write(topic, message.log_time, message.publish_time, message.data),
        };
        if written.is_err() {
            // The writer has stopped; closing it tells why.
            break;
        }
    }
    writer.close()
}

/// Takes metadata records along; losses add to those of the new bag.
pub(super) fn copy_metadata(metadata: &[(String, BTreeMap<String, String>)], writer: &BagWriter) {
    for (name, pairs) in metadata {
        if name == RECORDING {
            writer.carry_lost(&Losses::from_metadata(pairs));
        } else {
            writer.add_metadata(name, pairs.clone());
        }
    }
}
