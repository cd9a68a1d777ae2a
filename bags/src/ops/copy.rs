//! Copies messages from bags into a new one: filtering and merging.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::note;
use crate::error::{BagError, Result};
use crate::file::source::ReadOptions;
use crate::losses::{Losses, RECORDING};
use crate::reader::{Bag, Filter};
use crate::writer::{BagOptions, BagSummary, BagWriter, TopicId};

/// A new bag, and what of the old ones could not be read.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Copied {
    /// The new bag.
    pub summary: BagSummary,
    /// Damage found, each with file, offset and reason.
    pub faults: Vec<String>,
}

/// Copies what a filter lets through into a new bag; schemas, metadata records and attachments come along as they are.
/// Damage is passed over and told.
///
/// # Errors
/// [`BagError::Exists`] when `to` is there, and whatever writing reports.
pub fn filter(from: &Bag, filter: &Filter, to: &Path, options: BagOptions) -> Result<Copied> {
    copy(from, filter, to, options, Sequences::Keep)
}

/// Merges bags into a new one, in order of time.
///
/// # Errors
/// [`BagError::Topic`] when a topic has different types, and as [`filter()`].
pub fn merge(from: &[PathBuf], to: &Path, options: BagOptions, read: ReadOptions) -> Result<Copied> {
    let bag = Bag::open_all(from, read)?;
    for pair in bag.topics().windows(2) {
        let (a, b) = (&pair[0].topic, &pair[1].topic);
        if a.name == b.name && a.type_name != b.type_name {
            let reason = format!("is {} in one bag, {} in another", a.type_name, b.type_name);
            return Err(BagError::Topic { topic: a.name.clone(), reason });
        }
    }
    copy(&bag, &Filter::default(), to, options, Sequences::Renew)
}

/// What becomes of the messages' sequence numbers.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Sequences {
    /// A gap in the recording stays visible.
    Keep,
    /// Those of several recordings would contradict each other.
    Renew,
}

/// Copies what a filter lets through.
pub(crate) fn copy(
    from: &Bag,
    filter: &Filter,
    to: &Path,
    mut options: BagOptions,
    sequences: Sequences,
) -> Result<Copied> {
    // What is wrong with the filter is told before anything is written.
    from.messages(filter)?;
    if let Some(information) = from.information() {
        let custom_data = information.custom_data.clone().unwrap_or_default();
        options.custom_data.extend(custom_data);
        options.ros_distro.clone_from(&information.ros_distro);
    }
    options.profile = from.profile().to_owned();
    let writer = BagWriter::create(to, options)?;
    copy_metadata(&from.metadata(), &writer);
    from.attachments().iter().for_each(|attachment| writer.add_attachment(attachment));
    let mut topics = BTreeMap::new();
    for (index, topic) in from.topics().iter().enumerate() {
        if filter.topics.selects(&topic.topic.name) {
            topics.insert(index, writer.add_topic(&topic.topic)?);
        }
    }
    let mut faults = from.faults().to_vec();
    copy_messages(from, filter, &topics, &writer, sequences, &mut faults)?;
    Ok(Copied { summary: writer.close()?, faults })
}

fn copy_messages(
    from: &Bag,
    filter: &Filter,
    topics: &BTreeMap<usize, TopicId>,
    writer: &BagWriter,
    sequences: Sequences,
    faults: &mut Vec<String>,
) -> Result<()> {
    let mut messages = from.messages(filter)?;
    loop {
        let message = match messages.next() {
            Ok(Some(message)) => message,
            Ok(None) => return Ok(()),
            Err(error) => {
                note(faults, &error);
                continue;
            }
        };
        let topic = topics[&message.topic];
        let written = match sequences {
            Sequences::Keep => writer.copy(topic, &message),
            Sequences::Renew => writer.write(topic, message.log_time, message.publish_time, message.data),
        };
        if written.is_err() {
            // The writer has stopped; closing it tells why.
            return Ok(());
        }
    }
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
