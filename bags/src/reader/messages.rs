//! Messages of a bag in order of log time, with bounded memory.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use mcap::records::op;

use super::Bag;
use super::select::Filter;
use crate::error::Result;
use crate::file::index::FileIndex;
use crate::file::parts::ChunkRef;
use crate::file::record::{self, PREFIX_LEN, Records};
use crate::file::unpack::{Unpacker, ZSTD_MAGIC};

/// Unpacked chunks that are kept at a time [bytes]; beyond it the ones needed last are dropped
/// and read again when their turn comes.
const MEMORY_BYTES: usize = 64 << 20;

/// A message as it lies in the bag.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Message<'a> {
    /// Index into [`Bag::topics`].
    pub topic: usize,
    /// The writer's count on this channel.
    pub sequence: u32,
    /// Time of recording [ns].
    pub log_time: u64,
    /// Time of sending [ns].
    pub publish_time: u64,
    /// The message; CDR with its encapsulation header. One that was compressed by itself is unpacked.
    pub data: &'a [u8],
}

impl Bag {
    /// The messages that a filter lets through, in order of log time, then of recording.
    ///
    /// # Errors
    /// [`BagError::Option`] when the filter names a topic that is not in the bag.
    pub fn messages(&self, filter: &Filter) -> Result<Messages<'_>> {
        Messages::new(self, filter)
    }
}

/// A message in an unpacked chunk.
#[derive(Debug, Clone, Copy)]
struct Entry {
    log_time: u64,
    /// Offset of the record's body in the chunk.
    body: u32,
    /// Length of the record's body.
    len: u32,
    topic: u32,
}

/// A chunk whose messages are being read.
struct Open {
    /// Index into `Messages::chunks`.
    chunk: usize,
    /// Next message to yield.
    next: usize,
    /// Messages in order; empty while `data` is dropped.
    entries: Vec<Entry>,
    /// Unpacked records; empty while dropped.
    data: Vec<u8>,
}

/// A chunk of the bag.
#[derive(Debug, Clone, Copy)]
struct Place {
    file: usize,
    /// Index into the file's chunks.
    chunk: usize,
    /// Earliest log time [ns].
    start: u64,
    /// Its number in order of recording, which decides between messages of one time.
    rank: usize,
}

/// An iterator over messages that lends them one by one.
pub struct Messages<'a> {
    bag: &'a Bag,
    selected: Vec<bool>,
    from: u64,
    until: u64,
    /// Chunks in order of start time.
    chunks: Vec<Place>,
    /// Next chunk to open.
    upcoming: usize,
    /// Open chunks by slot.
    open: Vec<Open>,
    /// Slots of `open` that are free.
    free: Vec<usize>,
    /// Time of each open chunk's next message, the chunk's rank, and its slot.
    heap: BinaryHeap<Reverse<(u64, usize, usize)>>,
    /// Bytes in all `open[..].data`.
    held: usize,
    /// Limit of `held`.
    memory: usize,
    unpacker: Unpacker,
    packed: Vec<u8>,
    /// A message that was compressed by itself.
    plain: Vec<u8>,
}

impl<'a> Messages<'a> {
    pub(super) fn new(bag: &'a Bag, filter: &Filter) -> Result<Self> {
        let selected = filter.selected(&bag.topics)?;
        let mut chunks = Vec::new();
        for (number, file) in bag.files.iter().enumerate() {
            let wanted = |chunk: &ChunkRef| {
                let in_time = chunk.end >= filter.from && chunk.start <= filter.until;
                let is_selected = |id: &u16| bag.channels[number].get(id).is_none_or(|topic| selected[*topic]);
                in_time && chunk.channels.as_ref().is_none_or(|channels| channels.iter().any(is_selected))
            };
            let wanted = file.chunks.iter().enumerate().filter(|(_, chunk)| wanted(chunk));
            chunks.extend(wanted.map(|(chunk, at)| Place { file: number, chunk, start: at.start, rank: 0 }));
        }
        chunks.sort_by_key(|place: &Place| (place.file, bag.files[place.file].chunks[place.chunk].offset));
        chunks.iter_mut().enumerate().for_each(|(rank, place)| place.rank = rank);
        chunks.sort_by_key(|place| (place.start, place.rank));
        Ok(Self {
            bag,
            selected,
            from: filter.from,
            until: filter.until,
            chunks,
            upcoming: 0,
            open: Vec::new(),
            free: Vec::new(),
            heap: BinaryHeap::new(),
            held: 0,
            memory: MEMORY_BYTES,
            unpacker: Unpacker::default(),
            packed: Vec::new(),
            plain: Vec::new(),
        })
    }

    /// The next message; `None` at the end.
    ///
    /// # Errors
    /// [`crate::BagError::Corrupt`] when a chunk is damaged; the messages after it can still be
    /// read by calling again.
    #[expect(clippy::should_implement_trait, reason = "it lends, which `Iterator` cannot")]
    pub fn next(&mut self) -> Result<Option<Message<'_>>> {
        self.open_due_chunks()?;
        let Some(Reverse((_, rank, slot))) = self.heap.peek().copied() else {
            return Ok(None);
        };
        if self.open[slot].entries.is_empty() {
            self.reload(slot)?;
        }
        let open = &mut self.open[slot];
        let entry = open.entries[open.next];
        open.next += 1;
        match open.entries.get(open.next) {
            Some(following) => {
                let time = following.log_time;
                if let Some(mut top) = self.heap.peek_mut() {
                    *top = Reverse((time, rank, slot));
                }
            }
            None => {
                self.heap.pop();
                self.held -= self.open[slot].data.len();
                self.free.push(slot);
            }
        }
        self.message(slot, entry).map(Some)
    }

    fn message(&mut self, slot: usize, entry: Entry) -> Result<Message<'_>> {
        let (file, chunk) = self.chunk(self.open[slot].chunk);
        let body = &self.open[slot].data[entry.body as usize..][..entry.len as usize];
        let (header, mut data) = record::message(body).map_err(|reason| file.storage.corrupt(chunk.offset, reason))?;
        let topic = entry.topic as usize;
        if data.starts_with(&ZSTD_MAGIC) && self.bag.topics[topic].topic.message_encoding == "cdr" {
            self.unpacker.unpack_message(&file.storage, chunk.offset, data, &mut self.plain)?;
            data = &self.plain;
        }
        Ok(Message {
            topic,
            sequence: header.sequence,
            log_time: header.log_time,
            publish_time: header.publish_time,
            data,
        })
    }

    /// A chunk by its number in `chunks`, and its file.
    fn chunk(&self, number: usize) -> (&'a FileIndex, &'a ChunkRef) {
        let Place { file, chunk, .. } = self.chunks[number];
        let file = &self.bag.files[file];
        (file, &file.chunks[chunk])
    }

    /// Opens every chunk that may hold the next message.
    fn open_due_chunks(&mut self) -> Result<()> {
        while let Some(Place { start, rank, .. }) = self.chunks.get(self.upcoming).copied() {
            if self.heap.peek().is_some_and(|Reverse((time, ..))| *time < start) {
                break;
            }
            let chunk = self.upcoming;
            self.upcoming += 1;
            let slot = self.free.pop().unwrap_or_else(|| {
                let empty = Open { chunk, next: 0, entries: Vec::new(), data: Vec::new() };
                self.open.push(empty);
                self.open.len() - 1
            });
            self.open[slot].chunk = chunk;
            self.open[slot].next = 0;
            if let Err(error) = self.fill(slot) {
                self.free.push(slot);
                return Err(error);
            }
            match self.open[slot].entries.first() {
                Some(first) => {
                    self.held += self.open[slot].data.len();
                    self.heap.push(Reverse((first.log_time, rank, slot)));
                    self.drop_far_chunks(slot);
                }
                None => self.free.push(slot),
            }
        }
        Ok(())
    }

    fn reload(&mut self, slot: usize) -> Result<()> {
        if let Err(error) = self.fill(slot) {
            // It was readable before; the file has changed under us. Leave the chunk out.
            self.heap.pop();
            self.free.push(slot);
            return Err(error);
        }
        self.held += self.open[slot].data.len();
        self.drop_far_chunks(slot);
        Ok(())
    }

    /// Reads a slot's chunk and sorts its messages.
    fn fill(&mut self, slot: usize) -> Result<()> {
        let (file, chunk) = self.chunk(self.open[slot].chunk);
        let channels = &self.bag.channels[self.chunks[self.open[slot].chunk].file];
        let Open { entries, data, .. } = &mut self.open[slot];
        entries.clear();
        file.load(chunk, &mut self.unpacker, &mut self.packed, data)?;
        let in_chunk =
            |at: usize, reason: String| file.storage.corrupt(chunk.offset, format!("chunk, byte {at}: {reason}"));
        for item in Records::new(data) {
            let (at, opcode, body) = item.map_err(|(at, reason)| in_chunk(at, reason))?;
            if opcode != op::MESSAGE {
                continue;
            }
            let (header, _) = record::message(body).map_err(|reason| in_chunk(at, reason))?;
            let topic = *channels
                .get(&header.channel_id)
                .ok_or_else(|| in_chunk(at, format!("message of unknown channel {}", header.channel_id)))?;
            let in_time = (self.from..=self.until).contains(&header.log_time);
            if in_time && self.selected[topic] {
                entries.push(Entry {
                    log_time: header.log_time,
                    body: (at + PREFIX_LEN) as u32,
                    len: body.len() as u32,
                    topic: topic as u32,
                });
            }
        }
        // Stable: messages of one time stay in the order of recording.
        entries.sort_by_key(|entry| entry.log_time);
        Ok(())
    }

    /// Frees memory by dropping the chunks whose next message is farthest away.
    fn drop_far_chunks(&mut self, keep: usize) {
        if self.held <= self.memory {
            return;
        }
        let mut slots: Vec<(u64, usize, usize)> = self.heap.iter().map(|Reverse(at)| *at).collect();
        slots.sort_unstable_by(|a, b| b.cmp(a));
        for (_, _, slot) in slots {
            if self.held <= self.memory {
                break;
            }
            if slot != keep {
                let open = &mut self.open[slot];
                self.held -= open.data.len();
                open.entries = Vec::new();
                open.data = Vec::new();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{BagOptions, BagWriter, Topic};

    #[test]
    fn chunks_are_dropped_and_read_again_to_keep_within_memory() {
        let temp = tempfile::tempdir().unwrap();
        let dir = temp.path().join("mixed");
        let options = BagOptions { chunk_bytes: 1000, ..BagOptions::default() };
        let writer = BagWriter::create(&dir, options).unwrap();
        let topic = Topic::new("/x", "a/msg/B", "uint64 n\n", "", vec![]).unwrap();
        let topic = writer.add_topic(&topic).unwrap();
        // 7919 is prime: every chunk spans all of time.
        for n in 0..3000 {
            let time = n * 7919 % 3000;
            writer.write(topic, time, time, &time.to_le_bytes()).unwrap();
        }
        writer.close().unwrap();
        let bag = Bag::open(&dir).unwrap();
        let mut messages = bag.messages(&Filter::default()).unwrap();
        messages.memory = 10_000;
        let mut most = 0;
        for time in 0..3000u64 {
            let message = messages.next().unwrap().unwrap();
            assert_eq!((message.log_time, message.data), (time, &time.to_le_bytes()[..]));
            most = most.max(messages.held);
        }
        assert_eq!(messages.next().unwrap(), None);
        assert!(most > 5000 && most <= 12_000, "{most} bytes held");
        assert_eq!(messages.held, 0);
    }
}
