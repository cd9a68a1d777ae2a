//! Makes the files of MCAP's public conformance suite, byte by byte, from what its variants are defined to be.
//!
//! Six contents, each in every sensible combination of ten features: 416 files. Their digests are those of the
//! suite's own files, see `tests/data/README.md`.
#![allow(dead_code, reason = "each user uses some of these")]
#![allow(clippy::unwrap_used, reason = "a test that cannot go on should panic")]

use std::collections::BTreeMap;
use std::io::Cursor;

use binrw::BinWrite;
use mcap::MAGIC;
use mcap::records::{
    AttachmentHeader, AttachmentIndex, Channel, ChunkHeader, ChunkIndex, DataEnd, Footer, Header, MessageHeader,
    MessageIndex, MessageIndexEntry, Metadata, MetadataIndex, SchemaHeader, Statistics, SummaryOffset, op,
};

/// The features by the names that the suite's file names have, in their order there.
const FEATURES: [&str; 10] = ["ax", "ch", "chx", "mdx", "mx", "pad", "rch", "rsh", "st", "sum"];

/// What stands at the end of records when they are padded.
const PADDING: [u8; 3] = [1, 0xff, 0xff];

/// What a file holds.
#[derive(Debug, Clone, Default)]
pub struct Content {
    pub name: &'static str,
    pub schema: Option<(SchemaHeader, Vec<u8>)>,
    pub channel: Option<Channel>,
    pub messages: Vec<(MessageHeader, Vec<u8>)>,
    pub attachment: Option<(AttachmentHeader, Vec<u8>)>,
    pub metadata: Option<Metadata>,
}

/// One file of the suite.
pub struct File {
    pub name: String,
    pub content: Content,
    pub bytes: Vec<u8>,
}

/// All files.
pub fn files() -> Vec<File> {
    let mut files = Vec::new();
    for content in contents() {
        for set in 0..1u32 << FEATURES.len() {
            let features = Features(set);
            if features.suit(&content) {
                let bytes = Builder::new(features).file(&content);
                files.push(File { name: features.file_name(&content), content: content.clone(), bytes });
            }
        }
    }
    files
}

fn contents() -> Vec<Content> {
    let foo_bar = BTreeMap::from([("foo".to_owned(), "bar".to_owned())]);
    let header = SchemaHeader { id: 1, name: "Example".into(), encoding: "c".into() };
    let schema = Some((header, vec![4, 5, 6]));
    let channel = |schema_id, message_encoding: &str, metadata| {
        let (topic, message_encoding) = ("example".into(), message_encoding.into());
        Some(Channel { id: 1, schema_id, topic, message_encoding, metadata })
    };
    let message = |sequence, log_time, publish_time| {
        (MessageHeader { channel_id: 1, sequence, log_time, publish_time }, vec![1, 2, 3])
    };
    let described = Content { schema, channel: channel(1, "a", foo_bar.clone()), ..Content::default() };
    let times = (0..).zip([0, 2, 1, 3, 3, 5, 4, 7, 8, 9]);
    let (name, media_type) = ("myFile".into(), "application/octet-stream".into());
    let attachment = AttachmentHeader { log_time: 2, create_time: 1, name, media_type };
    vec![
        Content { name: "NoData", ..Content::default() },
        Content {
            name: "OneSchemalessMessage",
            channel: channel(0, "text", BTreeMap::new()),
            messages: vec![message(10, 2, 1)],
            ..Content::default()
        },
        Content { name: "OneMessage", messages: vec![message(10, 2, 1)], ..described.clone() },
        Content { name: "OneAttachment", attachment: Some((attachment, vec![1, 2, 3])), ..Content::default() },
        Content {
            name: "OneMetadata",
            metadata: Some(Metadata { name: "myMetadata".into(), metadata: foo_bar }),
            ..Content::default()
        },
        Content { name: "TenMessages", messages: times.map(|(n, t)| message(n, t, t)).collect(), ..described },
    ]
}

/// A set of features.
#[derive(Clone, Copy)]
struct Features(u32);

impl Features {
    fn has(self, feature: &str) -> bool {
        let bit = FEATURES.iter().position(|known| *known == feature).unwrap();
        self.0 >> bit & 1 == 1
    }

    /// Whether the combination makes sense, for this content.
    fn suit(self, content: &Content) -> bool {
        let needs = |feature: &str, there: bool| there || !self.has(feature);
        let chunked = content.schema.is_some() || content.channel.is_some() || !content.messages.is_empty();
        let summarised = ["chx", "rsh", "rch", "mdx", "ax", "st"].iter().any(|feature| self.has(feature));
        needs("ax", content.attachment.is_some())
            && needs("mdx", content.metadata.is_some())
            && needs("rsh", content.schema.is_some())
            && needs("rch", content.channel.is_some())
            && ["ch", "chx", "mx"].iter().all(|feature| needs(feature, chunked))
            && needs("sum", summarised)
            && ["chx", "mx"].iter().all(|feature| needs(feature, self.has("ch")))
    }

    fn file_name(self, content: &Content) -> String {
        let mut parts = vec![content.name];
        parts.extend(FEATURES.iter().filter(|feature| self.has(feature)));
        parts.join("-") + ".mcap"
    }
}

/// A file on its way.
struct Builder {
    features: Features,
    out: Vec<u8>,
}

impl Builder {
    fn new(features: Features) -> Self {
        Self { features, out: MAGIC.to_vec() }
    }

    fn len(&self) -> u64 {
        self.out.len() as u64
    }

    fn file(mut self, content: &Content) -> Vec<u8> {
        let (profile, library) = (String::new(), String::new());
        self.out.extend(self.padded(op::HEADER, &le(&Header { profile, library })));
        let (attachment_index, metadata_index) = self.unchunked(content);
        let definitions = self.definitions(content, self.features.has("pad") && !self.features.has("ch"));
        let chunk_index = if self.features.has("ch") {
            Some(self.chunk(content))
        } else {
            let messages = content.messages.iter().map(message).collect::<Vec<_>>().concat();
            self.out.extend([definitions, vec![messages]].concat().concat());
            None
        };
        let data_section_crc = crc32fast::hash(&self.out);
        self.out.extend(record(op::DATA_END, &le(&DataEnd { data_section_crc })));
        self.summary(content, attachment_index, metadata_index, chunk_index);
        self.out
    }

    /// A record, padded if the features say so.
    fn padded(&self, opcode: u8, body: &[u8]) -> Vec<u8> {
        match self.features.has("pad") {
            true => record(opcode, &[body, &PADDING].concat()),
            false => record(opcode, body),
        }
    }

    /// Appends what never lies in chunks; returns its index records.
    fn unchunked(&mut self, content: &Content) -> (Option<AttachmentIndex>, Option<MetadataIndex>) {
        let offset = self.len();
        let attachment = content.attachment.as_ref().map(|(header, data)| {
            let mut body = [le(header), (data.len() as u64).to_le_bytes().to_vec(), data.clone()].concat();
            body.extend(crc32fast::hash(&body).to_le_bytes());
            self.out.extend(self.padded(op::ATTACHMENT, &body));
            let AttachmentHeader { log_time, create_time, name, media_type } = header.clone();
            let (length, data_size) = (self.len() - offset, data.len() as u64);
            AttachmentIndex { offset, length, log_time, create_time, data_size, name, media_type }
        });
        let metadata = content.metadata.as_ref().map(|metadata| {
            self.out.extend(self.padded(op::METADATA, &le(metadata)));
            MetadataIndex { offset, length: self.len() - offset, name: metadata.name.clone() }
        });
        (attachment, metadata)
    }

    /// Schema and channel, a record each.
    fn definitions(&self, content: &Content, padded: bool) -> Vec<Vec<u8>> {
        let schema = content.schema.as_ref().map(|(header, data)| {
            let data = [(data.len() as u32).to_le_bytes().to_vec(), data.clone()].concat();
            (op::SCHEMA, [le(header), data].concat())
        });
        let channel = content.channel.as_ref().map(|channel| (op::CHANNEL, le(channel)));
        let put = |(opcode, body): (u8, Vec<u8>)| match padded {
            true => record(opcode, &[&body[..], &PADDING].concat()),
            false => record(opcode, &body),
        };
        schema.into_iter().chain(channel).map(put).collect()
    }

    /// Appends the chunk, whose records are never padded, and its message index.
    fn chunk(&mut self, content: &Content) -> ChunkIndex {
        let mut data = self.definitions(content, false).concat();
        let mut entries = Vec::new();
        for one in &content.messages {
            entries.push(MessageIndexEntry { log_time: one.0.log_time, offset: data.len() as u64 });
            data.extend(message(one));
        }
        let times = || content.messages.iter().map(|(header, _)| header.log_time);
        let (message_start_time, message_end_time) = (times().min().unwrap_or(0), times().max().unwrap_or(0));
        let (uncompressed_size, compression) = (data.len() as u64, String::new());
        let header = ChunkHeader {
            message_start_time,
            message_end_time,
            uncompressed_size,
            uncompressed_crc: crc32fast::hash(&data),
            compression: compression.clone(),
            compressed_size: uncompressed_size,
        };
        let chunk_start_offset = self.len();
        self.out.extend(record(op::CHUNK, &[le(&header), data].concat()));
        let chunk_length = self.len() - chunk_start_offset;
        let mut message_index_offsets = BTreeMap::new();
        if self.features.has("mx") && content.channel.is_some() {
            message_index_offsets.insert(1, self.len());
            let index = MessageIndex { channel_id: 1, records: entries };
            self.out.extend(self.padded(op::MESSAGE_INDEX, &le(&index)));
        }
        ChunkIndex {
            message_start_time,
            message_end_time,
            chunk_start_offset,
            chunk_length,
            message_index_offsets,
            message_index_length: self.len() - chunk_start_offset - chunk_length,
            compression,
            compressed_size: uncompressed_size,
            uncompressed_size,
        }
    }

    fn summary(
        &mut self,
        content: &Content,
        attachment: Option<AttachmentIndex>,
        metadata: Option<MetadataIndex>,
        chunk: Option<ChunkIndex>,
    ) {
        let start = self.len();
        let has = |feature| self.features.has(feature);
        let mut groups: Vec<(u8, Vec<u8>)> = Vec::new();
        for definition in self.definitions(content, has("pad")) {
            let opcode = definition[0];
            if has(if opcode == op::SCHEMA { "rsh" } else { "rch" }) {
                groups.push((opcode, definition));
            }
        }
        if has("st") {
            groups.push((op::STATISTICS, self.padded(op::STATISTICS, &le(&self.statistics(content)))));
        }
        if let Some(index) = metadata.filter(|_| has("mdx")) {
            groups.push((op::METADATA_INDEX, self.padded(op::METADATA_INDEX, &le(&index))));
        }
        if let Some(index) = attachment.filter(|_| has("ax")) {
            groups.push((op::ATTACHMENT_INDEX, self.padded(op::ATTACHMENT_INDEX, &le(&index))));
        }
        if let Some(index) = chunk.filter(|_| has("chx")) {
            groups.push((op::CHUNK_INDEX, self.padded(op::CHUNK_INDEX, &le(&index))));
        }
        let mut offsets = Vec::new();
        for (group_opcode, bytes) in &groups {
            let (group_start, group_length) = (self.len(), bytes.len() as u64);
            let offset = SummaryOffset { group_opcode: *group_opcode, group_start, group_length };
            offsets.extend(self.padded(op::SUMMARY_OFFSET, &le(&offset)));
            self.out.extend(bytes);
        }
        let summary_start = if groups.is_empty() { 0 } else { start };
        let summary_offset_start = if self.features.has("sum") { self.len() } else { 0 };
        if self.features.has("sum") {
            self.out.extend(offsets);
        }
        let footer = Footer { summary_start, summary_offset_start, summary_crc: 0 };
        self.out.extend(record(op::FOOTER, &le(&footer)));
        let crc_at = self.out.len() - 4;
        let crc = crc32fast::hash(&self.out[start as usize..crc_at]);
        self.out[crc_at..].copy_from_slice(&crc.to_le_bytes());
        self.out.extend(MAGIC);
    }

    fn statistics(&self, content: &Content) -> Statistics {
        let times = || content.messages.iter().map(|(header, _)| header.log_time);
        let count = content.messages.len() as u64;
        Statistics {
            message_count: count,
            schema_count: content.schema.is_some().into(),
            channel_count: content.channel.is_some().into(),
            attachment_count: content.attachment.is_some().into(),
            metadata_count: content.metadata.is_some().into(),
            chunk_count: self.features.has("ch").into(),
            message_start_time: times().min().unwrap_or(0),
            message_end_time: times().max().unwrap_or(0),
            channel_message_counts: (count > 0).then_some((1, count)).into_iter().collect(),
        }
    }
}

fn message((header, data): &(MessageHeader, Vec<u8>)) -> Vec<u8> {
    record(op::MESSAGE, &[&le(header)[..], data].concat())
}

/// Opcode, length and body.
fn record(opcode: u8, body: &[u8]) -> Vec<u8> {
    [&[opcode][..], &(body.len() as u64).to_le_bytes(), body].concat()
}

/// A record's fields as bytes.
fn le<T: for<'a> BinWrite<Args<'a> = ()>>(value: &T) -> Vec<u8> {
    let mut bytes = Vec::new();
    value.write_le_args(&mut Cursor::new(&mut bytes), ()).unwrap();
    bytes
}
