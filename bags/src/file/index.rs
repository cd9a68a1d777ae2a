//! The index of one file of a bag: topics, chunks and counts, from its summary or by a walk through it.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use mcap::MAGIC;
use mcap::records::{Channel, ChunkHeader, Metadata, Record, op};

use super::parts::{AttachmentRef, ChunkRef, Kind, Schema};
use super::record::{self, Records, misplaced};
use super::source::Source;
use super::storage::Storage;
use super::unpack::Unpacker;
use super::walk::{Place, Walk};
use crate::error::Result;

/// Messages of a run of loose records (outside chunks) that are read at a time [bytes].
const LOOSE_BYTES: u64 = 1 << 20;

/// All that is known of one file before its messages are read.
#[derive(Debug)]
pub(crate) struct FileIndex {
    pub storage: Storage,
    pub profile: String,
    pub library: String,
    pub schemas: BTreeMap<u16, Schema>,
    pub channels: BTreeMap<u16, Channel>,
    pub chunks: Vec<ChunkRef>,
    pub metadata: Vec<Metadata>,
    pub attachments: Vec<AttachmentRef>,
    /// Messages by channel.
    pub counts: BTreeMap<u16, u64>,
    /// Compressions in use, with the number of chunks.
    pub compressions: BTreeMap<String, u64>,
}

impl FileIndex {
    /// Reads the index of an MCAP file.
    ///
    /// # Errors
    /// [`BagError::Corrupt`] when the file is no MCAP file, has lost its end, or contradicts itself.
    pub(crate) fn open(source: Source) -> Result<Self> {
        let source = Arc::new(source);
        let mut index = Self::start(&source)?;
        if !index.read_summary(&source)? {
            index = Self::start(&source)?;
            index.walk(&source)?;
        }
        Ok(index)
    }

    /// An index that knows the header only.
    pub(crate) fn start(source: &Arc<Source>) -> Result<Self> {
        let mut magic = [0; MAGIC.len()];
        if source.len >= magic.len() as u64 {
            source.read_at(0, &mut magic)?;
        }
        if magic != *MAGIC {
            return Err(source.corrupt(0, "no MCAP file: it does not start with MCAP's magic"));
        }
        let mut walk = Walk::whole(source);
        let mut body = Vec::new();
        if let Some(place) = walk.next().transpose()?
            && place.opcode == op::HEADER
        {
            walk.read_body(place, &mut body)?;
            let mut index = Self::empty(Storage::Mcap(Arc::clone(source)));
            index.add(source, place, &body)?;
            return Ok(index);
        }
        Err(source.corrupt(8, "the first record is no header"))
    }

    /// An index that knows nothing.
    pub(crate) fn empty(storage: Storage) -> Self {
        Self {
            storage,
            profile: String::new(),
            library: String::new(),
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            chunks: Vec::new(),
            metadata: Vec::new(),
            attachments: Vec::new(),
            counts: BTreeMap::new(),
            compressions: BTreeMap::new(),
        }
    }

    /// Messages in the file.
    pub(crate) fn messages(&self) -> u64 {
        self.counts.values().fold(0, |sum, n| sum.saturating_add(*n))
    }

    /// Takes in a header, schema, channel or metadata record; ignores others.
    ///
    /// Of two records for one number the first counts, which the messages before the second mean.
    pub(crate) fn add(&mut self, source: &Source, place: Place, body: &[u8]) -> Result<()> {
        if !matches!(place.opcode, op::HEADER | op::SCHEMA | op::CHANNEL | op::METADATA) {
            return Ok(());
        }
        match record::parse(place.opcode, body).map_err(|reason| source.corrupt(place.offset, reason))? {
            Record::Header(header) => (self.profile, self.library) = (header.profile, header.library),
            Record::Schema { header, data } => {
                let schema = || Schema { name: header.name, encoding: header.encoding, data: data.as_ref().into() };
                self.schemas.entry(header.id).or_insert_with(schema);
            }
            Record::Channel(channel) => {
                self.channels.entry(channel.id).or_insert(channel);
            }
            Record::Metadata(metadata) => self.metadata.push(metadata),
            _ => {}
        }
        Ok(())
    }

    /// Takes in an attachment without reading its data.
    pub(crate) fn add_attachment(&mut self, source: &Source, place: Place) -> Result<()> {
        let corrupt = |reason| source.corrupt(place.offset, reason);
        // Names of more than 64 KiB are no names.
        let mut start = Vec::new();
        source.read_vec(place.body(), place.body_len.min(64 << 10), &mut start)?;
        let (header, data_len, header_len) = record::attachment_header(&start).map_err(corrupt)?;
        let room = place.body_len.checked_sub(header_len + 4);
        if room.is_none_or(|room| data_len > room) {
            return Err(corrupt(format!("attachment of {data_len} bytes in a record of {}", place.body_len)));
        }
        let data_end = place.body() + header_len + data_len;
        self.attachments.push(AttachmentRef { header, data_len, data_end, place });
        Ok(())
    }

    /// Builds the index from the records themselves, up to the data section's end.
    fn walk(&mut self, source: &Arc<Source>) -> Result<()> {
        let mut unpacker = Unpacker::default();
        let (mut body, mut data) = (Vec::new(), Vec::new());
        let mut walk = Walk::whole(source);
        while let Some(place) = walk.next().transpose()? {
            match place.opcode {
                op::DATA_END | op::FOOTER => break,
                op::ATTACHMENT => self.add_attachment(source, place)?,
                op::CHUNK => {
                    walk.read_body(place, &mut body)?;
                    let header = unpack(source, place.offset, &body, &mut unpacker, &mut data)?;
                    self.add_chunk(source, place, &header, &data)?;
                }
                op::MESSAGE => self.add_loose(source, place)?,
                op::SCHEMA | op::CHANNEL | op::METADATA => {
                    walk.read_body(place, &mut body)?;
                    self.add(source, place, &body)?;
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Takes in a chunk whose records are in `data`: definitions, counts, and the chunk if it has messages.
    fn add_chunk(&mut self, source: &Source, place: Place, header: &ChunkHeader, data: &[u8]) -> Result<()> {
        let in_chunk =
            |(at, reason): (usize, String)| source.corrupt(place.offset, format!("chunk, byte {at}: {reason}"));
        let mut channels = BTreeSet::new();
        let (mut start, mut end) = (u64::MAX, 0);
        for item in Records::new(data) {
            let (at, opcode, body) = item.map_err(in_chunk)?;
            if opcode == op::MESSAGE {
                let (message, _) = record::message(body).map_err(|reason| in_chunk((at, reason)))?;
                *self.counts.entry(message.channel_id).or_insert(0) += 1;
                channels.insert(message.channel_id);
                (start, end) = (start.min(message.log_time), end.max(message.log_time));
            } else {
                self.add(source, Place { opcode, ..place }, body)?;
            }
        }
        *self.compressions.entry(header.compression.clone()).or_insert(0) += 1;
        if !channels.is_empty() {
            let (offset, len) = (place.offset, place.end() - place.offset);
            let channels = Some(channels.into_iter().collect());
            self.chunks.push(ChunkRef { offset, len, start, end, kind: Kind::Chunk, channels });
        }
        Ok(())
    }

    /// Takes in a message outside chunks: it joins the run before it, or starts one.
    pub(crate) fn add_loose(&mut self, source: &Source, place: Place) -> Result<()> {
        let mut body = [0; record::MESSAGE_HEADER_LEN];
        let len = body.len().min(usize::try_from(place.body_len).unwrap_or(usize::MAX));
        source.read_at(place.body(), &mut body[..len])?;
        let (message, _) = record::message(&body[..len]).map_err(|reason| source.corrupt(place.offset, reason))?;
        *self.counts.entry(message.channel_id).or_insert(0) += 1;
        let (time, whole) = (message.log_time, place.end() - place.offset);
        match self.chunks.last_mut() {
            Some(run)
                if run.kind == Kind::Loose
                    && run.offset + run.len == place.offset
                    && run.len + whole <= LOOSE_BYTES =>
            {
                run.len = place.end() - run.offset;
                (run.start, run.end) = (run.start.min(time), run.end.max(time));
                if let Some(channels) = run.channels.as_mut().filter(|ids| !ids.contains(&message.channel_id)) {
                    channels.push(message.channel_id);
                }
            }
            _ => {
                let (offset, len) = (place.offset, whole);
                let channels = Some(vec![message.channel_id]);
                self.chunks.push(ChunkRef { offset, len, start: time, end: time, kind: Kind::Loose, channels });
            }
        }
        Ok(())
    }

    /// Reads the message records of a chunk, of a run of loose ones, or made of rows, into `data`.
    pub(crate) fn load(
        &self,
        chunk: &ChunkRef,
        unpacker: &mut Unpacker,
        packed: &mut Vec<u8>,
        data: &mut Vec<u8>,
    ) -> Result<()> {
        match (&self.storage, chunk.kind) {
            (Storage::Sqlite(sqlite), Kind::Rows(rows)) => sqlite.load(rows, data),
            (Storage::Mcap(source), Kind::Loose) => source.read_vec(chunk.offset, chunk.len, data),
            (Storage::Mcap(source), Kind::Chunk) => load_chunk(source, chunk, unpacker, packed, data).map(|_| ()),
            _ => Err(self.storage.corrupt(chunk.offset, "no such messages in a file of this kind")),
        }
    }
}

/// Reads and unpacks a chunk that the index speaks of.
pub(super) fn load_chunk(
    source: &Source,
    chunk: &ChunkRef,
    unpacker: &mut Unpacker,
    packed: &mut Vec<u8>,
    data: &mut Vec<u8>,
) -> Result<ChunkHeader> {
    source.read_vec(chunk.offset, chunk.len, packed)?;
    let Some(Ok((0, op::CHUNK, body))) = Records::new(packed).next() else {
        return Err(source.corrupt(chunk.offset, "no chunk here, the index says there is one"));
    };
    unpack(source, chunk.offset, body, unpacker, data)
}

/// Unpacks the body of the chunk record at an offset into `data`.
pub(crate) fn unpack(
    source: &Source,
    offset: u64,
    body: &[u8],
    unpacker: &mut Unpacker,
    data: &mut Vec<u8>,
) -> Result<ChunkHeader> {
    let corrupt = |reason: String| source.corrupt(offset, reason);
    match record::parse(op::CHUNK, body).map_err(corrupt)? {
        Record::Chunk { header, data: packed } => {
            unpacker.unpack(source, offset, &header, &packed, data)?;
            Ok(header)
        }
        other => Err(corrupt(misplaced(op::CHUNK, &other))),
    }
}
