//! Saves what is whole in damaged or unclosed bags.

use std::{collections::BTreeMap, path::Path};

use super::copy::copy_metadata;
use crate::{
    error::{Result, chain},
    file::{
        index::{FileIndex, message_header, unpack},
        record::{MESSAGE_HEADER_LEN, Records},
        records::{Schema, op},
        scan::{Place, Places, Source},
        unpack::Unpacker,
    },
    metadata::BagInformation,
    reader::{Message, channel_topic, mcap_files},
    writer::{BagOptions, BagSummary, BagWriter, TopicId},
};

/// What was saved, and what was not.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Recovery {
    /// The new bag.
    pub summary: BagSummary,
    /// Damage found, each with file, offset and reason.
    pub faults: Vec<String>,
}

/// Copies every message that is whole into a new bag.
///
/// A damaged chunk is left out; the walk through a file ends where no record can be found.
///
/// # Errors
/// [`crate::BagError::NotABag`] when there is no MCAP file, and whatever writing reports.
pub fn recover(from: &Path, to: &Path, mut options: BagOptions) -> Result<Recovery> {
    let files = mcap_files(from)?;
    // A bag that was not closed has none, or one that is out of date: only its free text counts.
    if let Ok(Some(information)) = BagInformation::read(from) {
        options.custom_data.extend(information.custom_data.unwrap_or_default());
    }
    let writer = BagWriter::create(to, options)?;
    let mut faults = Vec::new();
    for file in &files {
        if let Err(error) = salvage(file, &writer, &mut faults) {
            faults.push(chain(&error));
        }
        if writer.has_stopped() {
            break;
        }
    }
    Ok(Recovery { summary: writer.close()?, faults })
}

/// Copies the whole messages of one file.
fn salvage(path: &Path, writer: &BagWriter, faults: &mut Vec<String>) -> Result<()> {
    let index = FileIndex::start(Source::open(path)?)?;
    let source = std::sync::Arc::clone(&index.source);
    let mut file = Salvage { index, topics: BTreeMap::new(), writer };
    let mut unpacker = Unpacker::default();
    let (mut body, mut data) = (Vec::new(), Vec::new());
    for place in Places::new(&source) {
        let place = match place {
            Ok(place) => place,
            Err(error) => {
                faults.push(chain(&error));
                break;
            }
        };
        if matches!(place.opcode, op::DATA_END | op::FOOTER) {
            break;
        }
        let saved = place.read_body(&source, &mut body).and_then(|()| match place.opcode {
            op::CHUNK => {
                unpack(&source, place, &body, &mut unpacker, &mut data)?;
                file.save_chunk(place, &data)
            }
            op::MESSAGE => file.save_message(place, &body),
            op::METADATA | op::SCHEMA | op::CHANNEL => file.index.add(place, &body),
            _ => Ok(()),
        });
        if let Err(error) = saved {
            faults.push(chain(&error));
        }
        if writer.has_stopped() {
            break;
        }
    }
    let metadata = file.index.metadata.into_iter().map(|m| (m.name, m.metadata));
    let metadata: Vec<_> = metadata.collect();
    copy_metadata(&metadata, writer);
    Ok(())
}

struct Salvage<'a> {
    index: FileIndex,
    topics: BTreeMap<u16, TopicId>,
    writer: &'a BagWriter,
}

impl Salvage<'_> {
    /// Saves a chunk's messages, all or none: a chunk that unpacks badly is not to be trusted.
    fn save_chunk(&mut self, place: Place, data: &[u8]) -> Result<()> {
        let records: Vec<_> = Records::new(data)
            .collect::<Result<_, _>>()
            .map_err(|(at, reason)| self.fault(place, format!("chunk, byte {at}: {reason}")))?;
        for (_, opcode, body) in records {
            match opcode {
                op::MESSAGE => self.save_message(place, body)?,
                _ => self.index.add(Place { opcode, ..place }, body)?,
            }
        }
        Ok(())
    }

    fn save_message(&mut self, place: Place, body: &[u8]) -> Result<()> {
        let header = message_header(body).map_err(|reason| self.fault(place, reason))?;
        let topic = match self.topics.get(&header.channel_id) {
            Some(topic) => *topic,
            None => self.add_topic(place, header.channel_id)?,
        };
        let message = Message {
            topic: 0,
            sequence: header.sequence,
            log_time: header.log_time,
            publish_time: header.publish_time,
            data: &body[MESSAGE_HEADER_LEN..],
        };
        // A writer that has stopped tells why when it is closed.
        let _ = self.writer.copy(topic, &message);
        Ok(())
    }

    fn add_topic(&mut self, place: Place, id: u16) -> Result<TopicId> {
        let unknown = || self.fault(place, format!("message of unknown channel {id}"));
        let channel = self.index.channels.get(&id).ok_or_else(unknown)?;
        let none = Schema::default();
        let schema = self.index.schemas.get(&channel.schema_id).unwrap_or(&none);
        let topic = self.writer.add_topic(&channel_topic(channel, schema).topic)?;
        self.topics.insert(id, topic);
        Ok(topic)
    }

    fn fault(&self, place: Place, reason: String) -> crate::BagError {
        self.index.source.corrupt(place.offset, reason)
    }
}
