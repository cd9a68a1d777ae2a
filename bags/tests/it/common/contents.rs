//! What an MCAP file holds, by the reader of the `mcap` crate: a second opinion on our own.
#![allow(dead_code, reason = "each test binary uses some of these")]
#![allow(clippy::unwrap_used, reason = "a test that cannot go on should panic")]

use std::collections::BTreeMap;

use mcap::read::ChunkFlattener;
use mcap::records::{AttachmentHeader, Record};
use swath_bags::RECORDING;

use super::conformance::Content;

type Pairs = BTreeMap<String, String>;
/// Name, encoding and bytes.
pub type Schema = (String, String, Vec<u8>);
/// Topic, encoding, metadata and schema.
pub type Channel = (String, String, Pairs, Option<Schema>);
/// Topic, log time, publish time, sequence and data.
pub type Message = (String, u64, u64, u32, Vec<u8>);

/// The content of a file, without what our writer adds of its own.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Found {
    pub profile: String,
    /// In order of topic.
    pub channels: Vec<Channel>,
    /// In order of log time, then of the file.
    pub messages: Vec<Message>,
    pub attachments: Vec<(AttachmentHeader, Vec<u8>)>,
    pub metadata: Vec<(String, Pairs)>,
}

/// Reads the data section of a file without compressed chunks.
pub fn found(bytes: &[u8]) -> Found {
    let mut found = Found::default();
    let (mut schemas, mut topics) = (BTreeMap::new(), BTreeMap::new());
    for record in ChunkFlattener::new(bytes).unwrap() {
        match record.unwrap() {
            Record::Header(header) => found.profile = header.profile,
            Record::Schema { header, data } => {
                schemas.insert(header.id, (header.name, header.encoding, data.into_owned()));
            }
            Record::Channel(channel) => {
                let schema = schemas.get(&channel.schema_id).cloned();
                topics.insert(channel.id, channel.topic.clone());
                found.channels.push((channel.topic, channel.message_encoding, channel.metadata, schema));
            }
            Record::Message { header, data } => {
                let topic = topics[&header.channel_id].clone();
                let (log_time, publish_time, sequence) = (header.log_time, header.publish_time, header.sequence);
                found.messages.push((topic, log_time, publish_time, sequence, data.into_owned()));
            }
            Record::Attachment { header, data, .. } => found.attachments.push((header, data.into_owned())),
            Record::Metadata(metadata) if metadata.name != RECORDING => {
                found.metadata.push((metadata.name, metadata.metadata));
            }
            Record::DataEnd(_) => break,
            _ => {}
        }
    }
    found.channels.sort();
    found.messages.sort_by_key(|message| message.1);
    found
}

/// What a file is defined to hold, as the `mcap` crate reads it.
pub fn defined(content: &Content) -> Found {
    let schema =
        content.schema.as_ref().map(|(header, data)| (header.name.clone(), header.encoding.clone(), data.clone()));
    let channel = content.channel.as_ref().map(|channel| {
        let schema = schema.clone().filter(|_| channel.schema_id > 0);
        (channel.topic.clone(), channel.message_encoding.clone(), channel.metadata.clone(), schema)
    });
    let message = |(header, data): &(mcap::records::MessageHeader, Vec<u8>)| {
        ("example".to_owned(), header.log_time, header.publish_time, header.sequence, data.clone())
    };
    let mut messages: Vec<_> = content.messages.iter().map(message).collect();
    messages.sort_by_key(|message| message.1);
    let attachment = content.attachment.as_ref().map(|(header, data)| (header.clone(), data.clone()));
    Found {
        profile: String::new(),
        channels: channel.into_iter().collect(),
        messages,
        attachments: attachment.into_iter().collect(),
        metadata: content.metadata.iter().cloned().map(|m| (m.name, m.metadata)).collect(),
    }
}
