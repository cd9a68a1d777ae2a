//! Writes one MCAP file in whole records, so that what is on disk can always be closed.

use std::collections::BTreeMap;
use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;

use mcap::MAGIC;
use mcap::records::{
    AttachmentIndex, Channel, ChunkHeader, ChunkIndex, DataEnd, Footer, Header, Metadata, MetadataIndex, SchemaHeader,
    Statistics, SummaryOffset, op,
};

use super::attachment::Attachment;
use super::chunk::{Chunk, Compressor};
use super::record;
use crate::topic::Topic;

/// Where a file's bytes go: positional writes, and cutting off what does not fit.
pub(crate) trait Disk: Send {
    /// Writes all bytes at an offset.
    fn write_at(&mut self, offset: u64, bytes: &[u8]) -> io::Result<()>;
    /// Cuts the file to a length.
    fn truncate(&mut self, len: u64) -> io::Result<()>;
}

impl Disk for File {
    fn write_at(&mut self, offset: u64, bytes: &[u8]) -> io::Result<()> {
        self.write_all_at(bytes, offset)
    }

    fn truncate(&mut self, len: u64) -> io::Result<()> {
        self.set_len(len)
    }
}

/// What one finished file holds.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct FileSummary {
    /// Messages by channel id.
    pub counts: BTreeMap<u16, u64>,
    /// Messages in all.
    pub messages: u64,
    /// Earliest log time [ns].
    pub start: u64,
    /// Latest log time [ns].
    pub end: u64,
    /// Length of the file [bytes].
    pub bytes: u64,
}

/// A chunk on disk, with what must be known to close the file before it.
struct Written {
    index: ChunkIndex,
    counts: Vec<(u16, u64)>,
    crc_before: crc32fast::Hasher,
}

/// An MCAP file that grows by whole records.
///
/// Every method that fails leaves the file as it was before the call.
pub(crate) struct FileWriter {
    disk: Box<dyn Disk>,
    len: u64,
    crc: crc32fast::Hasher,
    scratch: Vec<u8>,
    definitions: Vec<u8>,
    schemas: u16,
    channels: u32,
    metadata: Vec<MetadataIndex>,
    attachments: Vec<AttachmentIndex>,
    chunks: Vec<Written>,
}

impl FileWriter {
    /// Starts a file with its header.
    pub(crate) fn create(disk: Box<dyn Disk>, profile: &str) -> io::Result<Self> {
        let mut file = Self {
            disk,
            len: 0,
            crc: crc32fast::Hasher::new(),
            scratch: Vec::new(),
            definitions: Vec::new(),
            schemas: 0,
            channels: 0,
            metadata: Vec::new(),
            attachments: Vec::new(),
            chunks: Vec::new(),
        };
        let library = concat!("swath-bags ", env!("CARGO_PKG_VERSION")).to_owned();
        file.scratch.extend_from_slice(MAGIC);
        record::put(&mut file.scratch, op::HEADER, &Header { profile: profile.to_owned(), library });
        file.append_scratch()?;
        Ok(file)
    }

    /// Length of the file so far [bytes].
    pub(crate) fn len(&self) -> u64 {
        self.len
    }

    /// Messages in the file so far.
    pub(crate) fn messages(&self) -> u64 {
        self.chunks.iter().flat_map(|c| &c.counts).map(|(_, n)| n).sum()
    }

    /// Writes a topic's schema (when `new_schema`) and channel, ahead of its messages.
    ///
    /// They stand outside chunks, so that a damaged chunk does not take them along.
    pub(crate) fn add_topic(&mut self, topic: &Topic, ids: TopicIds) -> io::Result<()> {
        self.scratch.clear();
        if let (true, Some(definition)) = (ids.new_schema, &topic.definition) {
            let encoding = definition.encoding.clone();
            let header = SchemaHeader { id: ids.schema, name: topic.type_name.clone(), encoding };
            record::put_with(&mut self.scratch, op::SCHEMA, |out| {
                record::put_fields(out, &header);
                out.extend_from_slice(&(definition.data.len() as u32).to_le_bytes());
                out.extend_from_slice(&definition.data);
            });
        }
        let channel = Channel {
            id: ids.channel,
            schema_id: ids.schema,
            topic: topic.name.clone(),
            message_encoding: topic.message_encoding.clone(),
            metadata: topic.metadata.clone(),
        };
        record::put(&mut self.scratch, op::CHANNEL, &channel);
        self.append_scratch()?;
        self.definitions.extend_from_slice(&self.scratch);
        self.schemas += u16::from(ids.new_schema);
        self.channels += 1;
        Ok(())
    }

    /// Writes a metadata record.
    pub(crate) fn add_metadata(&mut self, metadata: &Metadata) -> io::Result<()> {
        let offset = self.len;
        self.scratch.clear();
        record::put(&mut self.scratch, op::METADATA, metadata);
        self.append_scratch()?;
        let length = self.len - offset;
        self.metadata.push(MetadataIndex { offset, length, name: metadata.name.clone() });
        Ok(())
    }

    /// Copies an attachment's record, byte for byte, a piece at a time.
    pub(crate) fn add_attachment(&mut self, attachment: &Attachment) -> io::Result<()> {
        let (offset, crc) = (self.len, self.crc.clone());
        let place = attachment.place;
        let copied = attachment.source.for_each_piece(place.offset, place.end(), |piece| {
            self.scratch.clear();
            self.scratch.extend_from_slice(piece);
            self.append_scratch()
        });
        if let Err(error) = copied {
            (self.len, self.crc) = (offset, crc);
            // The first error tells more than a failed clean-up would.
            let _ = self.disk.truncate(offset);
            return Err(error);
        }
        let Attachment { log_time, create_time, bytes, name, media_type, .. } = attachment.clone();
        let length = self.len - offset;
        let index = AttachmentIndex { offset, length, log_time, create_time, data_size: bytes, name, media_type };
        self.attachments.push(index);
        Ok(())
    }

    /// Writes a chunk and its message indexes in one piece.
    pub(crate) fn add_chunk(&mut self, chunk: &Chunk, compressor: &mut Compressor) -> io::Result<()> {
        let compression = compressor.kind().mcap_name();
        let packed = compressor.compress(&chunk.data)?;
        let out = &mut self.scratch;
        out.clear();
        let compressed_size = packed.len() as u64;
        let header = ChunkHeader {
            message_start_time: chunk.start,
            message_end_time: chunk.end,
            uncompressed_size: chunk.data.len() as u64,
            uncompressed_crc: crc32fast::hash(&chunk.data),
            compression: compression.to_owned(),
            compressed_size,
        };
        record::put_with(out, op::CHUNK, |out| {
            record::put_fields(out, &header);
            out.extend_from_slice(packed);
        });
        let chunk_length = out.len() as u64;
        let message_index_offsets = put_message_indexes(out, chunk, self.len);
        let index = ChunkIndex {
            message_start_time: chunk.start,
            message_end_time: chunk.end,
            chunk_start_offset: self.len,
            chunk_length,
            message_index_offsets,
            message_index_length: out.len() as u64 - chunk_length,
            compression: compression.to_owned(),
            compressed_size,
            uncompressed_size: chunk.data.len() as u64,
        };
        let crc_before = self.crc.clone();
        self.append_scratch()?;
        self.chunks.push(Written { index, counts: chunk.counts().collect(), crc_before });
        Ok(())
    }

    /// Takes the last chunk, and all after it, off the file; `None` when there is none.
    ///
    /// Returns the number of messages taken off.
    pub(crate) fn drop_last_chunk(&mut self) -> io::Result<Option<u64>> {
        let Some(last) = self.chunks.last() else {
            return Ok(None);
        };
        let offset = last.index.chunk_start_offset;
        self.disk.truncate(offset)?;
        let messages = last.counts.iter().map(|(_, n)| n).sum();
        self.len = offset;
        self.crc = last.crc_before.clone();
        self.metadata.retain(|m| m.offset < offset);
        self.attachments.retain(|a| a.offset < offset);
        self.chunks.pop();
        Ok(Some(messages))
    }

    /// Writes index, statistics and footer: the file is whole after this.
    pub(crate) fn finish(&mut self) -> io::Result<FileSummary> {
        let summary = self.summary();
        self.scratch.clear();
        let data_section_crc = self.crc.clone().finalize();
        record::put(&mut self.scratch, op::DATA_END, &DataEnd { data_section_crc });
        let data_end_len = self.scratch.len();
        let groups = self.put_summary(&summary);
        let summary_start = self.len + data_end_len as u64;
        let summary_offset_start = self.len + self.scratch.len() as u64;
        for group in groups {
            record::put(&mut self.scratch, op::SUMMARY_OFFSET, &group);
        }
        self.put_footer(data_end_len, summary_start, summary_offset_start);
        self.append_scratch()?;
        Ok(FileSummary { bytes: self.len, ..summary })
    }

    fn summary(&self) -> FileSummary {
        let mut summary = FileSummary::default();
        for (channel, n) in self.chunks.iter().flat_map(|c| &c.counts) {
            *summary.counts.entry(*channel).or_insert(0) += n;
            summary.messages += n;
        }
        summary.start = self.chunks.iter().map(|c| c.index.message_start_time).min().unwrap_or(0);
        summary.end = self.chunks.iter().map(|c| c.index.message_end_time).max().unwrap_or(0);
        summary
    }

    /// Appends the summary section to the scratch buffer; returns where its groups lie.
    fn put_summary(&mut self, summary: &FileSummary) -> Vec<SummaryOffset> {
        let statistics = self.statistics(summary);
        let out = &mut self.scratch;
        let mut groups = Vec::new();
        let mut group = |group_opcode, from: usize, to: usize| {
            if to > from {
                let group_start = self.len + from as u64;
                let group_length = (to - from) as u64;
                groups.push(SummaryOffset { group_opcode, group_start, group_length });
            }
        };
        // Readers look for schemas and channels as two groups, as summary offsets name them.
        for opcode in [op::SCHEMA, op::CHANNEL] {
            let from = out.len();
            for (at, found, body) in record::Records::new(&self.definitions).flatten() {
                if found == opcode {
                    let whole = at..at + record::PREFIX_LEN + body.len();
                    out.extend_from_slice(&self.definitions[whole]);
                }
            }
            group(opcode, from, out.len());
        }
        let from = out.len();
        record::put(out, op::STATISTICS, &statistics);
        group(op::STATISTICS, from, out.len());
        let from = out.len();
        self.chunks.iter().for_each(|chunk| record::put(out, op::CHUNK_INDEX, &chunk.index));
        group(op::CHUNK_INDEX, from, out.len());
        let from = out.len();
        self.attachments.iter().for_each(|index| record::put(out, op::ATTACHMENT_INDEX, index));
        group(op::ATTACHMENT_INDEX, from, out.len());
        let from = out.len();
        self.metadata.iter().for_each(|index| record::put(out, op::METADATA_INDEX, index));
        group(op::METADATA_INDEX, from, out.len());
        groups
    }

    fn statistics(&self, summary: &FileSummary) -> Statistics {
        Statistics {
            message_count: summary.messages,
            schema_count: self.schemas,
            channel_count: self.channels,
            attachment_count: self.attachments.len() as u32,
            metadata_count: self.metadata.len() as u32,
            chunk_count: self.chunks.len() as u32,
            message_start_time: summary.start,
            message_end_time: summary.end,
            channel_message_counts: summary.counts.clone(),
        }
    }

    /// Appends footer and end magic; the CRC covers all from the summary's start to itself.
    fn put_footer(&mut self, data_end_len: usize, summary_start: u64, summary_offset_start: u64) {
        let out = &mut self.scratch;
        record::put(out, op::FOOTER, &Footer { summary_start, summary_offset_start, summary_crc: 0 });
        let crc_at = out.len() - 4;
        let crc = crc32fast::hash(&out[data_end_len..crc_at]);
        out[crc_at..].copy_from_slice(&crc.to_le_bytes());
        out.extend_from_slice(MAGIC);
    }

    /// Writes the scratch buffer behind the file, or cuts the file back to where it was.
    fn append_scratch(&mut self) -> io::Result<()> {
        if let Err(error) = self.disk.write_at(self.len, &self.scratch) {
            // The first error tells more than a failed clean-up would.
            let _ = self.disk.truncate(self.len);
            return Err(error);
        }
        self.len += self.scratch.len() as u64;
        self.crc.update(&self.scratch);
        Ok(())
    }
}

/// The numbers under which a file knows a topic.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TopicIds {
    /// Channel id, from 0.
    pub channel: u16,
    /// Schema id, from 1; 0 for none.
    pub schema: u16,
    /// Whether this topic is the first with that schema.
    pub new_schema: bool,
}

/// Appends one message index for each channel; returns their offsets in the file.
fn put_message_indexes(out: &mut Vec<u8>, chunk: &Chunk, base: u64) -> BTreeMap<u16, u64> {
    let mut offsets = BTreeMap::new();
    for (channel, entries) in chunk.index.iter().enumerate().filter(|(_, e)| !e.is_empty()) {
        let channel = channel as u16;
        offsets.insert(channel, base + out.len() as u64);
        record::put_with(out, op::MESSAGE_INDEX, |out| {
            out.extend_from_slice(&channel.to_le_bytes());
            out.extend_from_slice(&((entries.len() * 16) as u32).to_le_bytes());
            for (time, offset) in entries {
                out.extend_from_slice(&time.to_le_bytes());
                out.extend_from_slice(&offset.to_le_bytes());
            }
        });
    }
    offsets
}
