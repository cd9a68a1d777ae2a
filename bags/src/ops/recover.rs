//! Saves what is whole in damaged or unclosed bags.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use mcap::records::{Metadata, op};

use super::copy::copy_metadata;
use super::note;
use super::validate::check_attachment;
use crate::error::{BagError, Result};
use crate::file::attachment::Attachment;
use crate::file::index::{FileIndex, unpack};
use crate::file::record::{self, Records};
use crate::file::source::{ReadOptions, Source};
use crate::file::sqlite::is_sqlite;
use crate::file::storage::Storage;
use crate::file::unpack::{Unpacker, ZSTD_MAGIC};
use crate::file::walk::{Place, Walk};
use crate::qos::QosTexts;
use crate::reader::{Listing, Message, distinct};
use crate::topic::Topic;
use crate::writer::{BagOptions, BagSummary, BagWriter, TopicId};

/// What was saved, and what was not.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Recovery {
    /// The new bag.
    pub summary: BagSummary,
    /// Damage found, each with file, offset and reason.
    pub faults: Vec<String>,
}

/// Copies every message that is whole into a new bag, with schemas, metadata records and attachments.
///
/// A damaged chunk is left out. Where no record can be found, the walk goes on at the next chunk that the file's index
/// knows, if it has one.
///
/// # Errors
/// [`BagError::NotABag`] when there is no file, and whatever writing reports.
pub fn recover(from: &Path, to: &Path, mut options: BagOptions, read: ReadOptions) -> Result<Recovery> {
    let listing = Listing::of(from)?;
    // A bag that was not closed has none, or one that is out of date: only its free text counts.
    let information = listing.information.unwrap_or_default();
    options.custom_data.extend(information.custom_data.unwrap_or_default());
    let mut faults = listing.faults;
    let mut files = Vec::new();
    for path in listing.files.iter().chain(&listing.unlisted) {
        match open(path, read, &mut faults) {
            Ok(index) => files.push(index),
            Err(error) => note(&mut faults, &error),
        }
    }
    if let Some(first) = files.first() {
        options.profile.clone_from(&first.profile);
    }
    let writer = BagWriter::create(to, options)?;
    let mut metadata = Vec::new();
    for index in files {
        let mut file = Salvage::new(index, &writer);
        file.save(&mut faults);
        metadata.push(file.index.metadata);
        if writer.has_stopped() {
            break;
        }
    }
    copy_metadata(&distinct(metadata.iter().map(|file: &Vec<Metadata>| &file[..])), &writer);
    Ok(Recovery { summary: writer.close()?, faults })
}

/// A file's header, or all of a SQLite file's index.
fn open(path: &Path, options: ReadOptions, faults: &mut Vec<String>) -> Result<FileIndex> {
    match is_sqlite(path)? {
        true => FileIndex::open_sqlite(path, options),
        false => FileIndex::start(&Arc::new(Source::open(path, options, Some(faults))?)),
    }
}

/// A file of which the whole messages are copied.
struct Salvage<'a> {
    index: FileIndex,
    topics: BTreeMap<u16, TopicId>,
    writer: &'a BagWriter,
    unpacker: Unpacker,
    /// A message that was compressed by itself.
    plain: Vec<u8>,
    texts: QosTexts,
}

impl<'a> Salvage<'a> {
    fn new(index: FileIndex, writer: &'a BagWriter) -> Self {
        Self {
            index,
            topics: BTreeMap::new(),
            writer,
            unpacker: Unpacker::default(),
            plain: Vec::new(),
            texts: QosTexts::default(),
        }
    }

    fn save(&mut self, faults: &mut Vec<String>) {
        match self.index.storage.clone() {
            Storage::Mcap(source) => self.save_mcap(&source, faults),
            Storage::Sqlite(_) => self.save_rows(faults),
        }
        // Topics without messages are topics too.
        for id in self.index.channels.keys().copied().collect::<Vec<_>>() {
            if let Err(error) = self.topic(0, id) {
                note(faults, &error);
            }
        }
    }

    fn save_rows(&mut self, faults: &mut Vec<String>) {
        let (mut packed, mut data) = (Vec::new(), Vec::new());
        for chunk in std::mem::take(&mut self.index.chunks) {
            let place = Place { offset: chunk.offset, opcode: op::CHUNK, body_len: 0 };
            let loaded = self.index.load(&chunk, &mut self.unpacker, &mut packed, &mut data);
            if let Err(error) = loaded.and_then(|()| self.save_chunk(place, &data)) {
                note(faults, &error);
            }
        }
    }

    fn save_mcap(&mut self, source: &Arc<Source>, faults: &mut Vec<String>) {
        let chunks = self.index.read_repeated(source);
        let (mut body, mut data) = (Vec::new(), Vec::new());
        let mut walk = Walk::whole(source);
        while let Some(place) = walk.next() {
            let place = match place {
                Ok(place) if matches!(place.opcode, op::DATA_END | op::FOOTER) => break,
                Ok(place) => place,
                Err(error) => {
                    note(faults, &error);
                    let Some(next) = chunks.iter().find(|offset| **offset > walk.offset()) else { break };
                    walk = Walk::between(source, *next, source.len);
                    continue;
                }
            };
            if let Err(error) = self.save_record(source, &walk, place, &mut body, &mut data) {
                note(faults, &error);
            }
            if self.writer.has_stopped() {
                break;
            }
        }
    }

    fn save_record(
        &mut self,
        source: &Arc<Source>,
        walk: &Walk<'_>,
        place: Place,
        body: &mut Vec<u8>,
        data: &mut Vec<u8>,
    ) -> Result<()> {
        match place.opcode {
            op::ATTACHMENT => return self.save_attachment(source, place),
            op::CHUNK | op::MESSAGE | op::METADATA | op::SCHEMA | op::CHANNEL => walk.read_body(place, body)?,
            _ => return Ok(()),
        }
        match place.opcode {
            op::CHUNK => {
                unpack(source, place.offset, body, &mut self.unpacker, data)?;
                self.save_chunk(place, data)
            }
            op::MESSAGE => self.save_message(place, body),
            _ => self.index.add(source, place, body),
        }
    }

    fn save_attachment(&mut self, source: &Arc<Source>, place: Place) -> Result<()> {
        self.index.add_attachment(source, place)?;
        let Some(found) = self.index.attachments.last() else { return Ok(()) };
        check_attachment(source, found)?;
        self.writer.add_attachment(&Attachment::of(source, found));
        Ok(())
    }

    /// Saves a chunk's messages, all or none: a chunk that unpacks badly is not to be trusted.
    fn save_chunk(&mut self, place: Place, data: &[u8]) -> Result<()> {
        let records: Vec<_> = Records::new(data)
            .collect::<Result<_, _>>()
            .map_err(|(at, reason)| self.fault(place.offset, format!("chunk, byte {at}: {reason}")))?;
        for (_, opcode, body) in records {
            match (opcode, self.index.storage.clone()) {
                (op::MESSAGE, _) => self.save_message(place, body)?,
                (_, Storage::Mcap(source)) => self.index.add(&source, Place { opcode, ..place }, body)?,
                _ => {}
            }
        }
        Ok(())
    }

    fn save_message(&mut self, place: Place, body: &[u8]) -> Result<()> {
        let (header, mut data) = record::message(body).map_err(|reason| self.fault(place.offset, reason))?;
        let topic = self.topic(place.offset, header.channel_id)?;
        let is_cdr = self.index.channels.get(&header.channel_id).is_some_and(|c| c.message_encoding == "cdr");
        if is_cdr && data.starts_with(&ZSTD_MAGIC) {
            self.unpacker.unpack_message(&self.index.storage, place.offset, data, &mut self.plain)?;
            data = &self.plain;
        }
        let message = Message {
            topic: 0,
            sequence: header.sequence,
            log_time: header.log_time,
            publish_time: header.publish_time,
            data,
        };
        // A writer that has stopped tells why when it is closed.
        let _ = self.writer.copy(topic, &message);
        Ok(())
    }

    /// The new bag's topic for a channel.
    fn topic(&mut self, offset: u64, id: u16) -> Result<TopicId> {
        if let Some(topic) = self.topics.get(&id) {
            return Ok(*topic);
        }
        let unknown = || self.fault(offset, format!("message of unknown channel {id}"));
        let channel = self.index.channels.get(&id).ok_or_else(unknown)?;
        let schema = self.index.schemas.get(&channel.schema_id);
        let topic = Topic::of_channel(channel, schema, &mut self.texts);
        let topic = self.writer.add_topic(&topic)?;
        self.topics.insert(id, topic);
        Ok(topic)
    }

    fn fault(&self, offset: u64, reason: String) -> BagError {
        self.index.storage.corrupt(offset, reason)
    }
}
