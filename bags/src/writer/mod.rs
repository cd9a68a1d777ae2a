//! Writes bags: messages are gathered in memory here, and compressed and stored by a thread.

mod disk;
mod options;
mod queue;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::JoinHandle;

use mcap::records::{MessageHeader, Metadata};
pub use options::{BagOptions, BagSummary};
pub use queue::TopicId;
use queue::{Job, QUEUE_CHUNKS, Shared, State, TopicState};

use crate::error::{BagError, Result};
use crate::file::attachment::Attachment;
use crate::file::chunk::Compressor;
use crate::file::writer::TopicIds;
use crate::losses::{Losses, RESUMED, RESUMED_FILE};
use crate::reader::Message;
use crate::topic::Topic;

/// A bag being written: `<dir>/<dir's name>_0.mcap` and on, and `<dir>/metadata.yaml`.
///
/// All methods take `&self`, so several threads may write. A message is copied and indexed in the
/// calling thread; a thread of the writer's own compresses and stores whole chunks. When the disk
/// cannot keep up, [`write`](Self::write) waits: nothing is dropped.
pub struct BagWriter {
    dir: PathBuf,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<Result<BagSummary>>>,
}

impl BagWriter {
    /// Makes the directory `dir` and starts the bag's first file.
    ///
    /// # Errors
    /// [`BagError::Exists`] when `dir` is there already and the bag is not to be resumed, [`BagError::Io`] when it cannot
    /// be made.
    pub fn create(dir: &Path, options: BagOptions) -> Result<Self> {
        Self::create_on(dir, options, Box::new(disk::open_file))
    }

    /// [`create`](Self::create) on another kind of disk.
    fn create_on(dir: &Path, options: BagOptions, open: disk::OpenDisk) -> Result<Self> {
        if let Some(parent) = dir.parent() {
            fs::create_dir_all(parent).map_err(BagError::io("create", parent))?;
        }
        let resumes = options.resume && dir.is_dir();
        if !resumes {
            fs::create_dir(dir).map_err(|e| match e.kind() {
                std::io::ErrorKind::AlreadyExists => BagError::Exists { path: dir.to_owned() },
                _ => BagError::io("create", dir)(e),
            })?;
        }
        let name = disk::bag_name(dir);
        let first = (0..).find(|&number| !dir.join(disk::file_name(&name, number)).exists()).unwrap_or(0);
        let compressor = Compressor::new(options.compression, options.zstd_level)
            .map_err(|e| BagError::Option { option: "--compression", reason: e.to_string() })?;
        let shared = Arc::new(Shared {
            options,
            state: Mutex::new(State::default()),
            work: Condvar::new(),
            room: Condvar::new(),
        });
        let storage = disk::Storage::create(dir, first, compressor, shared.options.clone(), open)?;
        let for_thread = Arc::clone(&shared);
        let thread = std::thread::Builder::new()
            .name("bag-disk".to_owned())
            .spawn(move || storage.run(&for_thread))
            .map_err(BagError::io("start the thread of", dir))?;
        let writer = Self { dir: dir.to_owned(), shared, thread: Some(thread) };
        if first > 0 {
            writer.add_metadata(RESUMED, BTreeMap::from([(RESUMED_FILE.to_owned(), disk::file_name(&name, first))]));
        }
        Ok(writer)
    }

    /// The bag directory.
    #[must_use]
    pub fn dir(&self) -> &Path {
        &self.dir
    }

    /// Adds a topic; the same one again gives the same id.
    ///
    /// # Errors
    /// [`BagError::Topic`] at 65 535 topics.
    pub fn add_topic(&self, topic: &Topic) -> Result<TopicId> {
        let topic = Arc::new(topic.in_words());
        let mut state = self.shared.lock();
        if let Some(id) = state.ids.get(&topic.key()) {
            return Ok(*id);
        }
        let channel = u16::try_from(state.topics.len()).ok().filter(|id| *id < u16::MAX);
        let channel = channel.ok_or_else(|| BagError::Topic {
            topic: topic.name.clone(),
            reason: format!("a bag holds at most {} topics", u16::MAX),
        })?;
        // There are no more schemas than topics.
        let next = state.schemas.len() as u16 + 1;
        let schema = topic
            .definition
            .clone()
            .map_or(0, |definition| *state.schemas.entry((topic.type_name.clone(), definition)).or_insert(next));
        let ids = TopicIds { channel, schema, new_schema: schema == next };
        state.queue.push_back(Job::Topic(Arc::clone(&topic), ids));
        state.ids.insert(topic.key(), TopicId(channel));
        state.topics.push(TopicState { topic, sequence: 0, lost: 0 });
        drop(state);
        self.shared.work.notify_one();
        Ok(TopicId(channel))
    }

    /// Copies an attachment of another bag, byte for byte, into the file that is being written.
    pub fn add_attachment(&self, attachment: &Attachment) {
        self.shared.lock().queue.push_back(Job::Attachment(Box::new(attachment.clone())));
        self.shared.work.notify_one();
    }

    /// Adds a metadata record, which every file of the bag will hold.
    pub fn add_metadata(&self, name: &str, metadata: BTreeMap<String, String>) {
        let record = Metadata { name: name.to_owned(), metadata };
        self.shared.lock().queue.push_back(Job::Metadata(record));
        self.shared.work.notify_one();
    }

    /// Adds one message: its times [ns] and its CDR bytes, encapsulation header included.
    ///
    /// Blocks while the disk is behind.
    ///
    /// # Errors
    /// [`BagError::WriterStopped`] once storing has failed; [`close`](Self::close) tells why.
    pub fn write(&self, topic: TopicId, log_time: u64, publish_time: u64, cdr: &[u8]) -> Result<()> {
        self.write_parts(topic, log_time, publish_time, &[cdr])
    }

    /// Like [`write`](Self::write) for a message that lies in several pieces.
    ///
    /// # Errors
    /// As [`write`](Self::write).
    pub fn write_parts(&self, topic: TopicId, log_time: u64, publish_time: u64, parts: &[&[u8]]) -> Result<()> {
        self.push(topic, None, log_time, publish_time, parts)
    }

    /// Adds a message of another bag with the sequence number that it has there.
    ///
    /// # Errors
    /// As [`write`](Self::write).
    pub fn copy(&self, topic: TopicId, message: &Message<'_>) -> Result<()> {
        let Message { sequence, log_time, publish_time, data, .. } = *message;
        self.push(topic, Some(sequence), log_time, publish_time, &[data])
    }

    fn push(
        &self,
        topic: TopicId,
        sequence: Option<u32>,
        log_time: u64,
        publish_time: u64,
        parts: &[&[u8]],
    ) -> Result<()> {
        let options = &self.shared.options;
        let mut state = self.shared.lock();
        if state.stopped {
            return Err(BagError::WriterStopped);
        }
        if self.file_spans_too_long(&mut state, log_time) {
            state.seal(options.snapshot_bytes);
            state.queue.push_back(Job::Split);
        }
        let known = &mut state.topics[usize::from(topic.0)];
        let sequence = sequence.unwrap_or(known.sequence);
        known.sequence = sequence.wrapping_add(1);
        let channel_id = topic.0;
        let header = MessageHeader { channel_id, sequence, log_time, publish_time };
        state.front.push(&header, parts);
        state.written += 1;
        if state.front.data.len() < options.chunk_bytes {
            return Ok(());
        }
        state.seal(options.snapshot_bytes);
        self.shared.work.notify_one();
        while state.queued_chunks > QUEUE_CHUNKS && !state.stopped {
            state = self.shared.room.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        Ok(())
    }

    fn file_spans_too_long(&self, state: &mut State, log_time: u64) -> bool {
        let Some(limit) = self.shared.options.max_file_duration else {
            return false;
        };
        let start = *state.file_start.get_or_insert(log_time);
        let too_long = u128::from(log_time.saturating_sub(start)) >= limit.as_nanos();
        if too_long {
            state.file_start = Some(log_time);
        }
        too_long
    }

    /// Counts messages of a topic that were lost before they reached the writer; their sequence
    /// numbers stay free.
    pub fn count_lost(&self, topic: TopicId, messages: u64) {
        let mut state = self.shared.lock();
        let known = &mut state.topics[usize::from(topic.0)];
        known.lost += messages;
        known.sequence = known.sequence.wrapping_add(messages as u32);
    }

    /// Counts messages that the recording of a copied bag had lost.
    pub fn carry_lost(&self, lost: &Losses) {
        self.shared.lock().carried.add(lost);
    }

    /// Starts a new file with the next message.
    pub fn split(&self) {
        let mut state = self.shared.lock();
        state.seal(self.shared.options.snapshot_bytes);
        state.queue.push_back(Job::Split);
        state.file_start = None;
        drop(state);
        self.shared.work.notify_one();
    }

    /// Stores what snapshot mode has kept in memory; returns the number of messages.
    pub fn snapshot(&self) -> u64 {
        let mut state = self.shared.lock();
        state.seal(self.shared.options.snapshot_bytes);
        let ring = std::mem::take(&mut state.ring);
        state.ring_bytes = 0;
        state.queued_chunks += ring.len();
        let messages = ring.iter().map(|chunk| chunk.messages).sum();
        state.queue.extend(ring.into_iter().map(Job::Chunk));
        drop(state);
        self.shared.work.notify_one();
        messages
    }

    /// A count of the messages written, which other threads may watch.
    #[must_use]
    pub fn counter(&self) -> Counter {
        Counter { shared: Arc::clone(&self.shared) }
    }

    /// Messages counted as lost so far.
    #[must_use]
    pub fn lost(&self) -> u64 {
        let state = self.shared.lock();
        state.carried.total() + state.topics.iter().map(|t| t.lost).sum::<u64>()
    }

    /// Whether storing has failed, so that further messages are refused.
    #[must_use]
    pub fn has_stopped(&self) -> bool {
        self.shared.lock().stopped
    }

    /// Stores what is left, closes the last file and writes `metadata.yaml`.
    ///
    /// # Errors
    /// What stopped the writer: [`BagError::DiskFull`] (the bag is readable up to there) or
    /// [`BagError::Io`].
    pub fn close(mut self) -> Result<BagSummary> {
        self.end().unwrap_or(Err(BagError::WriterStopped))
    }

    fn end(&mut self) -> Option<Result<BagSummary>> {
        let thread = self.thread.take()?;
        let mut state = self.shared.lock();
        if self.shared.options.snapshot_bytes.is_none() {
            state.seal(None);
        }
        state.closing = true;
        drop(state);
        self.shared.work.notify_one();
        // The thread has no code that panics; if it did, there would be no result to report.
        Some(thread.join().unwrap_or(Err(BagError::WriterStopped)))
    }
}

/// Tells how many messages were handed to a [`BagWriter`].
#[derive(Clone)]
pub struct Counter {
    shared: Arc<Shared>,
}

impl Counter {
    /// Messages so far, those lost included.
    #[must_use]
    pub fn messages(&self) -> u64 {
        self.shared.lock().written
    }
}

impl Drop for BagWriter {
    fn drop(&mut self) {
        if let Some(Err(error)) = self.end() {
            tracing::error!("bag {}: {}", self.dir.display(), crate::error::chain(&error));
        }
    }
}
