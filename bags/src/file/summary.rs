//! A file's index from its summary section, and from what lies between its chunks.
//!
//! A summary need not be whole: it may lack channels, schemas, counts or the index of metadata. What it lacks is
//! looked for in the data section; where it does not tell of all messages, the caller walks through the file.

use std::collections::BTreeSet;

use mcap::MAGIC;
use mcap::records::{ChunkIndex, Footer, Record, Statistics, op};

use super::index::{FileIndex, load_chunk};
use super::parts::{ChunkRef, Kind};
use super::record::{self, PREFIX_LEN, Records};
use super::source::Source;
use super::unpack::Unpacker;
use super::walk::{Place, Walk};
use crate::error::Result;

/// Footer record and end magic.
const FOOTER_LEN: u64 = (PREFIX_LEN + 20 + MAGIC.len()) as u64;

/// What a summary tells of messages.
struct Told {
    statistics: Statistics,
    chunks: Vec<ChunkIndex>,
}

impl FileIndex {
    /// Reads the summary and what it lacks; `false` when it does not tell where all messages are.
    pub(super) fn read_summary(&mut self, source: &Source) -> Result<bool> {
        let footer = read_footer(source)?;
        if footer.summary_start == 0 {
            return Ok(false);
        }
        let Some(mut told) = self.read_section(source, &footer)? else {
            return Ok(false);
        };
        if told.chunks.len() as u64 != u64::from(told.statistics.chunk_count) {
            return Ok(false);
        }
        told.chunks.sort_by_key(|chunk| chunk.chunk_start_offset);
        if !self.read_between(source, &told.chunks, footer.summary_start)? {
            return Ok(false);
        }
        let counted: u64 = told.statistics.channel_message_counts.values().fold(0, |sum, n| sum.saturating_add(*n));
        if counted != told.statistics.message_count || self.messages() > counted {
            return Ok(false);
        }
        self.add_indexed(source, &told)?;
        if counted == 0 && !self.chunks.is_empty() {
            return Ok(false);
        }
        self.counts = told.statistics.channel_message_counts;
        Ok(true)
    }

    /// Takes in the definitions that the summary repeats, if it can be trusted, and returns where it says that chunks
    /// begin: what helps to save the rest of a damaged file.
    pub(crate) fn read_repeated(&mut self, source: &Source) -> Vec<u64> {
        let footer = read_footer(source).ok().filter(|footer| footer.summary_start != 0 && footer.summary_crc != 0);
        let told = footer.and_then(|footer| self.read_section(source, &footer).ok().flatten());
        let mut offsets: Vec<u64> =
            told.into_iter().flat_map(|told| told.chunks).map(|chunk| chunk.chunk_start_offset).collect();
        offsets.sort_unstable();
        offsets
    }

    /// Parses the summary section; `None` without statistics.
    fn read_section(&mut self, source: &Source, footer: &Footer) -> Result<Option<Told>> {
        let start = footer.summary_start;
        let end = source.len - FOOTER_LEN;
        if start < MAGIC.len() as u64 || start > end {
            let reason = format!("summary said to start at {start}, outside of the file");
            return Err(source.corrupt(end, reason));
        }
        let mut section = Vec::new();
        // The checksum covers the footer up to the checksum itself.
        source.read_vec(start, end - start + PREFIX_LEN as u64 + 16, &mut section)?;
        let crc = crc32fast::hash(&section);
        if footer.summary_crc != 0 && footer.summary_crc != crc {
            let reason = format!("summary checksum is {crc:08x}, not {:08x}", footer.summary_crc);
            return Err(source.corrupt(start, reason));
        }
        let (mut statistics, mut chunks) = (None, Vec::new());
        for item in Records::new(&section[..(end - start) as usize]) {
            let (at, opcode, body) = item.map_err(|(at, reason)| source.corrupt(start + at as u64, reason))?;
            let offset = start + at as u64;
            if matches!(opcode, op::SCHEMA | op::CHANNEL) {
                self.add(source, Place { offset, opcode, body_len: body.len() as u64 }, body)?;
            } else if matches!(opcode, op::STATISTICS | op::CHUNK_INDEX) {
                match record::parse(opcode, body).map_err(|reason| source.corrupt(offset, reason))? {
                    Record::Statistics(found) => statistics = Some(found),
                    Record::ChunkIndex(chunk) => chunks.push(checked(source, offset, chunk)?),
                    _ => {}
                }
            }
        }
        Ok(statistics.map(|statistics| Told { statistics, chunks }))
    }

    /// Walks what lies between the chunks: metadata, attachments, definitions, and messages outside chunks.
    ///
    /// `false` when there is a chunk that is not in the index.
    fn read_between(&mut self, source: &Source, chunks: &[ChunkIndex], summary_start: u64) -> Result<bool> {
        let mut from = MAGIC.len() as u64;
        for chunk in chunks {
            let offset = chunk.chunk_start_offset;
            if offset < from {
                return Err(source.corrupt(offset, "chunk said to begin within another"));
            }
            if !self.read_gap(source, from, offset)? {
                return Ok(false);
            }
            let end = offset + chunk.chunk_length;
            // Message indexes need no walk where they reach up to what the index knows next.
            let behind_indexes = end.saturating_add(chunk.message_index_length);
            let known = chunks.binary_search_by_key(&behind_indexes, |chunk| chunk.chunk_start_offset).is_ok();
            from = if known { behind_indexes } else { end };
        }
        self.read_gap(source, from, summary_start)
    }

    fn read_gap(&mut self, source: &Source, from: u64, to: u64) -> Result<bool> {
        let mut walk = Walk::between(source, from, to);
        let mut body = Vec::new();
        while let Some(place) = walk.next().transpose()? {
            match place.opcode {
                op::DATA_END => break,
                op::CHUNK => return Ok(false),
                op::ATTACHMENT => self.add_attachment(source, place)?,
                op::MESSAGE => self.add_loose(source, place)?,
                op::SCHEMA | op::CHANNEL | op::METADATA => {
                    walk.read_body(place, &mut body)?;
                    self.add(source, place, &body)?;
                }
                _ => {}
            }
        }
        Ok(true)
    }

    /// Takes in the chunks of the index, unpacking those without whose records something would be missing.
    fn add_indexed(&mut self, source: &Source, told: &Told) -> Result<()> {
        let mut unpacker = Unpacker::default();
        let (mut packed, mut data) = (Vec::new(), Vec::new());
        let spoken_of = spoken_of(told);
        let mut lacking = self.lacks_definitions(told, &spoken_of);
        for chunk in &told.chunks {
            *self.compressions.entry(chunk.compression.clone()).or_insert(0) += 1;
            let mut chunk = chunk_ref(chunk);
            // A chunk without messages has no times to tell, and says so in several ways.
            let timeless = chunk.start > chunk.end || (chunk.start, chunk.end) == (0, 0);
            if timeless || lacking {
                load_chunk(source, &chunk, &mut unpacker, &mut packed, &mut data)?;
                let messages = self.add_definitions(source, &chunk, &data)?;
                lacking = lacking && self.lacks_definitions(told, &spoken_of);
                if timeless {
                    let Some((start, end)) = messages else { continue };
                    (chunk.start, chunk.end) = (start, end);
                }
            }
            self.chunks.push(chunk);
        }
        Ok(())
    }

    /// Whether a channel or schema that is spoken of is not known yet.
    fn lacks_definitions(&self, told: &Told, spoken_of: &BTreeSet<u16>) -> bool {
        self.channels.len() < told.statistics.channel_count as usize
            || self.channels.values().any(|c| c.schema_id != 0 && !self.schemas.contains_key(&c.schema_id))
            || spoken_of.iter().any(|id| !self.channels.contains_key(id))
    }

    /// Takes in the definitions in a chunk; returns the times of its first and last message.
    fn add_definitions(&mut self, source: &Source, chunk: &ChunkRef, data: &[u8]) -> Result<Option<(u64, u64)>> {
        let in_chunk =
            |(at, reason): (usize, String)| source.corrupt(chunk.offset, format!("chunk, byte {at}: {reason}"));
        let mut times: Option<(u64, u64)> = None;
        for item in Records::new(data) {
            let (at, opcode, body) = item.map_err(in_chunk)?;
            if opcode == op::MESSAGE {
                let (message, _) = record::message(body).map_err(|reason| in_chunk((at, reason)))?;
                let time = message.log_time;
                times = Some(times.map_or((time, time), |(start, end)| (start.min(time), end.max(time))));
            } else {
                self.add(source, Place { offset: chunk.offset, opcode, body_len: 0 }, body)?;
            }
        }
        Ok(times)
    }
}

/// Reads the footer at the file's end.
fn read_footer(source: &Source) -> Result<Footer> {
    let len = source.len;
    let missing = "the file's end is missing, it was not closed or was cut off: recover it";
    let Some(at) = len.checked_sub(FOOTER_LEN) else {
        return Err(source.corrupt(len, missing));
    };
    let mut tail = [0; FOOTER_LEN as usize];
    source.read_at(at, &mut tail)?;
    let (record, magic) = tail.split_at(tail.len() - MAGIC.len());
    let footer = Records::new(record).next().and_then(Result::ok).filter(|_| magic == MAGIC);
    match footer.map(|(_, opcode, body)| record::parse(opcode, body)) {
        Some(Ok(Record::Footer(footer))) => Ok(footer),
        _ => Err(source.corrupt(len, missing)),
    }
}

/// A chunk index that lies within the file.
fn checked(source: &Source, offset: u64, chunk: ChunkIndex) -> Result<ChunkIndex> {
    let (start, len) = (chunk.chunk_start_offset, chunk.chunk_length);
    if start.checked_add(len).is_none_or(|end| end > source.len) {
        let reason = format!("chunk said to lie at {start}, {len} bytes long: past the end");
        return Err(source.corrupt(offset, reason));
    }
    Ok(chunk)
}

/// The channels that have messages, as far as the summary says so.
fn spoken_of(told: &Told) -> BTreeSet<u16> {
    let indexed = told.chunks.iter().flat_map(|chunk| chunk.message_index_offsets.keys());
    told.statistics.channel_message_counts.keys().chain(indexed).copied().collect()
}

fn chunk_ref(chunk: &ChunkIndex) -> ChunkRef {
    let channels: Vec<u16> = chunk.message_index_offsets.keys().copied().collect();
    ChunkRef {
        offset: chunk.chunk_start_offset,
        len: chunk.chunk_length,
        start: chunk.message_start_time,
        end: chunk.message_end_time,
        kind: Kind::Chunk,
        channels: (!channels.is_empty()).then_some(channels),
    }
}
