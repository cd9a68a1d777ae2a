//! The index of one MCAP file: topics, chunks and counts, from its summary or by a walk through it.

use std::{collections::BTreeMap, path::Path, sync::Arc};

use super::{
    record::{FOOTER_LEN, PREFIX_LEN, Records},
    records::{self, Body, Chunk, MAGIC, Schema, op},
    scan::{Place, Places, Source},
    unpack::Unpacker,
};
use crate::error::Result;

/// Messages of a run of loose records (outside chunks) that are read at a time [bytes].
const LOOSE_BYTES: u64 = 1 << 20;

/// Where messages lie: a chunk, or a run of message records outside chunks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ChunkRef {
    /// Offset of the chunk's record, or of the run.
    pub offset: u64,
    /// Length, prefix included.
    pub len: u64,
    /// Earliest log time [ns].
    pub start: u64,
    /// Latest log time [ns].
    pub end: u64,
    /// Whether it is a run of loose records.
    pub loose: bool,
}

/// All that is known of one file before its messages are read.
#[derive(Debug)]
pub(crate) struct FileIndex {
    pub source: Arc<Source>,
    pub profile: String,
    pub library: String,
    pub schemas: BTreeMap<u16, Schema>,
    pub channels: BTreeMap<u16, records::Channel>,
    pub chunks: Vec<ChunkRef>,
    pub metadata: Vec<records::Metadata>,
    /// Messages by channel.
    pub counts: BTreeMap<u16, u64>,
    /// Compressions in use, with the number of chunks.
    pub compressions: BTreeMap<String, u64>,
}

impl FileIndex {
    /// Opens a file and reads its index.
    ///
    /// # Errors
    /// [`crate::BagError::Corrupt`] when the file is no MCAP file, has lost its end, or contradicts itself.
    pub(crate) fn open(path: &Path) -> Result<Self> {
        let mut index = Self::start(Source::open(path)?)?;
        let footer = index.read_footer()?;
        if footer.summary_start == 0 || !index.read_summary(&footer)? {
            index.walk()?;
        }
        Ok(index)
    }

    /// An index that knows the header only.
    pub(crate) fn start(source: Source) -> Result<Self> {
        let mut body = Vec::new();
        let first = Places::new(&source).next().transpose()?;
        let mut index = Self::empty(source);
        if let Some(place) = first.filter(|place| place.opcode == op::HEADER) {
            place.read_body(&index.source, &mut body)?;
            index.add(place, &body)?;
            return Ok(index);
        }
        Err(index.source.corrupt(8, "the first record is no header"))
    }

    fn empty(source: Source) -> Self {
        Self {
            source: Arc::new(source),
            profile: String::new(),
            library: String::new(),
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            chunks: Vec::new(),
            metadata: Vec::new(),
            counts: BTreeMap::new(),
            compressions: BTreeMap::new(),
        }
    }

    /// Messages in the file.
    pub(crate) fn messages(&self) -> u64 {
        self.counts.values().fold(0, |sum, n| sum.saturating_add(*n))
    }

    fn read_footer(&self) -> Result<records::Footer> {
        let len = self.source.len;
        let missing = "the file's end is missing, it was not closed or was cut off: recover it";
        let Some(at) = len.checked_sub(FOOTER_LEN) else {
            return Err(self.source.corrupt(len, missing));
        };
        let mut tail = [0; FOOTER_LEN as usize];
        self.source.read_at(at, &mut tail)?;
        let (record, magic) = tail.split_at(tail.len() - MAGIC.len());
        match (Records::new(record).next(), magic == MAGIC) {
            (Some(Ok((0, op::FOOTER, body))), true) => self.parse(at, body),
            _ => Err(self.source.corrupt(len, missing)),
        }
    }

    /// Reads the summary section; `false` when it does not tell where the messages are.
    fn read_summary(&mut self, footer: &records::Footer) -> Result<bool> {
        let start = footer.summary_start;
        let end = self.source.len - FOOTER_LEN;
        if start < MAGIC.len() as u64 || start > end {
            let reason = format!("summary said to start at {start}, outside of the file");
            return Err(self.source.corrupt(end, reason));
        }
        let mut section = Vec::new();
        // The checksum covers the footer up to the checksum itself.
        self.source.read_vec(start, end - start + PREFIX_LEN as u64 + 16, &mut section)?;
        let crc = crc32fast::hash(&section);
        if footer.summary_crc != 0 && footer.summary_crc != crc {
            let reason = format!("summary checksum is {crc:08x}, not {:08x}", footer.summary_crc);
            return Err(self.source.corrupt(start, reason));
        }
        let mut statistics = None;
        for item in Records::new(&section[..(end - start) as usize]) {
            let (at, opcode, body) = item.map_err(|(at, reason)| self.source.corrupt(start + at as u64, reason))?;
            let offset = start + at as u64;
            match opcode {
                op::STATISTICS => statistics = Some(self.parse::<records::Statistics>(offset, body)?),
                op::CHUNK_INDEX => self.add_chunk_index(offset, &self.parse(offset, body)?)?,
                op::METADATA_INDEX => self.read_metadata(&self.parse(offset, body)?)?,
                _ => self.add(Place { offset, opcode, body_len: body.len() as u64 }, body)?,
            }
        }
        let Some(statistics) = statistics else {
            return Ok(self.forget());
        };
        if self.chunks.is_empty() && statistics.message_count > 0 {
            return Ok(self.forget());
        }
        self.counts = statistics.channel_message_counts;
        Ok(true)
    }

    /// Drops what an insufficient summary told, for the walk to find out.
    fn forget(&mut self) -> bool {
        self.chunks.clear();
        self.metadata.clear();
        self.compressions.clear();
        false
    }

    fn parse<T: Body>(&self, offset: u64, body: &[u8]) -> Result<T> {
        T::parse(body).map_err(|reason| self.source.corrupt(offset, reason))
    }

    fn add_chunk_index(&mut self, offset: u64, chunk: &records::ChunkIndex) -> Result<()> {
        let (start, len) = (chunk.chunk_start_offset, chunk.chunk_length);
        if start.checked_add(len).is_none_or(|end| end > self.source.len) {
            let reason = format!("chunk said to lie at {start}, {len} bytes long: past the end");
            return Err(self.source.corrupt(offset, reason));
        }
        let (from, to) = (chunk.message_start_time, chunk.message_end_time);
        self.chunks.push(ChunkRef { offset: start, len, start: from, end: to, loose: false });
        *self.compressions.entry(chunk.compression.clone()).or_insert(0) += 1;
        Ok(())
    }

    fn read_metadata(&mut self, index: &records::MetadataIndex) -> Result<()> {
        let mut body = Vec::new();
        self.source.read_vec(index.offset, index.length, &mut body)?;
        let record = Records::new(&body).next();
        let Some(Ok((0, op::METADATA, body))) = record else {
            let reason = format!("no metadata record {:?} here", index.name);
            return Err(self.source.corrupt(index.offset, reason));
        };
        self.add(Place { offset: index.offset, opcode: op::METADATA, body_len: 0 }, body)
    }

    /// Takes in a header, schema, channel or metadata record; ignores others.
    pub(crate) fn add(&mut self, place: Place, body: &[u8]) -> Result<()> {
        match place.opcode {
            op::HEADER => {
                let header: records::Header = self.parse(place.offset, body)?;
                (self.profile, self.library) = (header.profile, header.library);
            }
            op::SCHEMA => {
                let schema: Schema = self.parse(place.offset, body)?;
                self.schemas.insert(schema.id, schema);
            }
            op::CHANNEL => {
                let channel: records::Channel = self.parse(place.offset, body)?;
                self.channels.insert(channel.id, channel);
            }
            op::METADATA => self.metadata.push(self.parse(place.offset, body)?),
            _ => {}
        }
        Ok(())
    }

    /// Builds the index from the records themselves, up to the data section's end.
    fn walk(&mut self) -> Result<()> {
        let source = Arc::clone(&self.source);
        let mut unpacker = Unpacker::default();
        let (mut body, mut data) = (Vec::new(), Vec::new());
        for place in Places::new(&source) {
            let place = place?;
            match place.opcode {
                op::DATA_END => break,
                op::ATTACHMENT | op::MESSAGE_INDEX => continue,
                _ => place.read_body(&source, &mut body)?,
            }
            match place.opcode {
                op::CHUNK => {
                    let chunk = unpack(&source, place, &body, &mut unpacker, &mut data)?;
                    self.add_chunk(place, &chunk, &data)?;
                }
                op::MESSAGE => self.add_loose(place, &body)?,
                _ => self.add(place, &body)?,
            }
        }
        Ok(())
    }

    /// Takes in a chunk whose records are in `data`.
    pub(crate) fn add_chunk(&mut self, place: Place, chunk: &Chunk<'_>, data: &[u8]) -> Result<()> {
        for item in Records::new(data) {
            let (at, opcode, body) =
                item.map_err(|(at, reason)| self.source.corrupt(place.offset, format!("chunk, byte {at}: {reason}")))?;
            match opcode {
                op::MESSAGE => {
                    let message = message_header(body)
                        .map_err(|reason| self.source.corrupt(place.offset, format!("chunk, byte {at}: {reason}")))?;
                    *self.counts.entry(message.channel_id).or_insert(0) += 1;
                }
                _ => self.add(Place { opcode, ..place }, body)?,
            }
        }
        let len = place.end() - place.offset;
        let (start, end) = (chunk.message_start_time, chunk.message_end_time);
        self.chunks.push(ChunkRef { offset: place.offset, len, start, end, loose: false });
        *self.compressions.entry(chunk.compression.to_string()).or_insert(0) += 1;
        Ok(())
    }

    /// Takes in a message outside chunks: it joins the run before it, or starts one.
    fn add_loose(&mut self, place: Place, body: &[u8]) -> Result<()> {
        let message = message_header(body).map_err(|r| self.source.corrupt(place.offset, r))?;
        *self.counts.entry(message.channel_id).or_insert(0) += 1;
        let time = message.log_time;
        match self.chunks.last_mut() {
            Some(run) if run.loose && run.offset + run.len == place.offset && run.len < LOOSE_BYTES => {
                run.len = place.end() - run.offset;
                (run.start, run.end) = (run.start.min(time), run.end.max(time));
            }
            _ => {
                let len = place.end() - place.offset;
                let offset = place.offset;
                self.chunks.push(ChunkRef { offset, len, start: time, end: time, loose: true });
            }
        }
        Ok(())
    }
}

/// Reads the messages' records of a chunk, or of a run of loose ones, into `data`.
pub(crate) fn load(
    source: &Source,
    chunk: &ChunkRef,
    unpacker: &mut Unpacker,
    packed: &mut Vec<u8>,
    data: &mut Vec<u8>,
) -> Result<()> {
    if chunk.loose {
        return source.read_vec(chunk.offset, chunk.len, data);
    }
    source.read_vec(chunk.offset, chunk.len, packed)?;
    let Some(Ok((0, op::CHUNK, body))) = Records::new(packed).next() else {
        return Err(source.corrupt(chunk.offset, "no chunk here, the index says there is one"));
    };
    let place = Place { offset: chunk.offset, opcode: op::CHUNK, body_len: body.len() as u64 };
    unpack(source, place, body, unpacker, data).map(|_| ())
}

/// Unpacks the body of a chunk record into `data`.
pub(crate) fn unpack<'b>(
    source: &Source,
    place: Place,
    body: &'b [u8],
    unpacker: &mut Unpacker,
    data: &mut Vec<u8>,
) -> Result<Chunk<'b>> {
    let corrupt = |reason: String| source.corrupt(place.offset, reason);
    let chunk = Chunk::parse(body).map_err(corrupt)?;
    unpacker.unpack(&chunk, data).map_err(corrupt)?;
    Ok(chunk)
}

/// The header of a message record's body.
pub(crate) fn message_header(body: &[u8]) -> Result<records::MessageHeader, String> {
    let short = || format!("message record of {} bytes", body.len());
    let (channel, rest) = body.split_first_chunk().ok_or_else(short)?;
    let (sequence, rest) = rest.split_first_chunk().ok_or_else(short)?;
    let (log_time, rest) = rest.split_first_chunk().ok_or_else(short)?;
    let (publish_time, _) = rest.split_first_chunk().ok_or_else(short)?;
    Ok(records::MessageHeader {
        channel_id: u16::from_le_bytes(*channel),
        sequence: u32::from_le_bytes(*sequence),
        log_time: u64::from_le_bytes(*log_time),
        publish_time: u64::from_le_bytes(*publish_time),
    })
}
