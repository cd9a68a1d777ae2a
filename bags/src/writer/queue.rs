//! What waits between whoever writes a bag and the thread that stores it.

use std::collections::{HashMap, VecDeque};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use mcap::records::Metadata;

use super::options::BagOptions;
use crate::file::attachment::Attachment;
use crate::file::chunk::Chunk;
use crate::file::writer::TopicIds;
use crate::losses::Losses;
use crate::topic::{Definition, Topic, TopicKey};

/// Finished chunks that may wait for the disk before `write` blocks.
pub(super) const QUEUE_CHUNKS: usize = 32;

/// A topic of one [`BagWriter`](crate::BagWriter).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TopicId(pub(super) u16);

/// What the disk thread has to do, in order.
pub(super) enum Job {
    Topic(Arc<Topic>, TopicIds),
    Metadata(Metadata),
    Attachment(Box<Attachment>),
    Chunk(Chunk),
    Split,
}

pub(super) struct TopicState {
    pub topic: Arc<Topic>,
    pub sequence: u32,
    pub lost: u64,
}

#[derive(Default)]
pub(super) struct State {
    pub topics: Vec<TopicState>,
    pub ids: HashMap<TopicKey, TopicId>,
    pub schemas: HashMap<(String, Definition), u16>,
    pub front: Chunk,
    pub spare: Vec<Chunk>,
    pub queue: VecDeque<Job>,
    pub queued_chunks: usize,
    pub ring: VecDeque<Chunk>,
    pub ring_bytes: usize,
    pub file_start: Option<u64>,
    pub carried: Losses,
    pub written: u64,
    pub closing: bool,
    pub stopped: bool,
}

impl State {
    /// Moves the gathered messages on: to the disk, or into the ring in snapshot mode.
    pub(super) fn seal(&mut self, snapshot_bytes: Option<usize>) {
        if self.front.is_empty() {
            return;
        }
        let next = self.spare.pop().unwrap_or_default();
        let full = std::mem::replace(&mut self.front, next);
        let Some(limit) = snapshot_bytes else {
            self.queue.push_back(Job::Chunk(full));
            self.queued_chunks += 1;
            return;
        };
        self.ring_bytes += full.data.len();
        self.ring.push_back(full);
        while self.ring_bytes > limit {
            let Some(mut oldest) = self.ring.pop_front() else {
                break;
            };
            self.ring_bytes -= oldest.data.len();
            oldest.clear();
            self.spare.push(oldest);
        }
    }
}

pub(super) struct Shared {
    pub options: BagOptions,
    pub state: Mutex<State>,
    /// Signals the disk thread: there is a job, or the end has come.
    pub work: Condvar,
    /// Signals blocked writers: the queue has room again.
    pub room: Condvar,
}

impl Shared {
    pub(super) fn lock(&self) -> MutexGuard<'_, State> {
        // No code panics while it holds the lock halfway through a change.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The next job, or a chunk that has become old; `None` when the writer has closed.
    pub(super) fn next_job(&self) -> Option<Job> {
        let interval = self.options.flush_interval;
        let mut state = self.lock();
        loop {
            if let Some(job) = state.queue.pop_front() {
                if matches!(job, Job::Chunk(_)) {
                    state.queued_chunks -= 1;
                    self.room.notify_all();
                }
                return Some(job);
            }
            if state.closing {
                return None;
            }
            if is_old(&state, interval) && self.options.snapshot_bytes.is_none() {
                state.seal(None);
                continue;
            }
            // A chunk grows no older than one and a quarter intervals.
            let waited = self.work.wait_timeout(state, interval / 4);
            state = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Gives a stored chunk's memory back.
    pub(super) fn recycle(&self, mut chunk: Chunk) {
        chunk.clear();
        let mut state = self.lock();
        if state.spare.len() < QUEUE_CHUNKS {
            state.spare.push(chunk);
        }
    }

    /// What the writer was told of losses.
    pub(super) fn lost(&self) -> Losses {
        let state = self.lock();
        let mut losses = state.carried.clone();
        for known in state.topics.iter().filter(|t| t.lost > 0) {
            *losses.by_topic.entry(known.topic.name.clone()).or_insert(0) += known.lost;
        }
        losses
    }

    /// Refuses further messages; returns how many were waiting to be stored.
    pub(super) fn drain(&self) -> u64 {
        let mut state = self.lock();
        state.stopped = true;
        let queued = state.queue.drain(..).map(|job| match job {
            Job::Chunk(chunk) => chunk.messages,
            Job::Topic(..) | Job::Metadata(_) | Job::Attachment(_) | Job::Split => 0,
        });
        let lost = queued.sum::<u64>() + state.front.messages;
        state.front.clear();
        state.queued_chunks = 0;
        self.room.notify_all();
        lost
    }
}

fn is_old(state: &State, interval: Duration) -> bool {
    state.front.opened.is_some_and(|opened| opened.elapsed() >= interval)
}
