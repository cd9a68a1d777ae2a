//! Responses of a service that wait until their client can hear them.
//!
//! A client may see a server before the server sees the client's reader: a response that goes out at once goes to
//! nobody. Each waits until the server's writer is matched with a reader of the client's process, but not for ever.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, Weak};
use std::time::{Duration, Instant};

use rustdds::SampleIdentity;

use crate::cdr::Cdr;
use crate::endpoint::RawPublisher;
use crate::error::RosError;
use crate::rtps::Prefix;
use crate::signal::lock;

/// How long a response waits for its client's reader; then it is sent all the same.
const WAIT: Duration = Duration::from_secs(2);

/// Responses that may wait; the oldest one does not wait longer when there are more.
const ROOM: usize = 1024;

/// The writer of a service's responses.
pub(crate) struct Replies {
    writer: RawPublisher,
    held: Mutex<VecDeque<Reply>>,
}

/// A response to a client in `process`.
pub(crate) struct Reply {
    pub(crate) process: Prefix,
    pub(crate) cdr: Cdr,
    pub(crate) related: Option<SampleIdentity>,
    pub(crate) until: Instant,
}

impl Reply {
    pub(crate) fn new(process: Prefix, cdr: Cdr, related: Option<SampleIdentity>) -> Self {
        Self { process, cdr, related, until: Instant::now() + WAIT }
    }
}

impl Replies {
    pub(crate) fn new(writer: RawPublisher) -> Self {
        Self { writer, held: Mutex::default() }
    }

    /// Sends a response, now or as soon as its client hears it.
    pub(crate) fn send(&self, reply: Reply) -> Result<(), RosError> {
        let mut held = lock(&self.held);
        if self.writer.is_heard_by(reply.process) {
            drop(held);
            return self.write(reply);
        }
        held.push_back(reply);
        let overdue = if held.len() > ROOM { held.pop_front() } else { None };
        drop(held);
        overdue.map_or(Ok(()), |reply| self.write(reply))
    }

    /// Sends the responses that need not wait any longer.
    pub(crate) fn release(&self, now: Instant) {
        let mut held = lock(&self.held);
        if held.is_empty() {
            return;
        }
        let (ready, waiting) =
            held.drain(..).partition(|reply| now >= reply.until || self.writer.is_heard_by(reply.process));
        *held = waiting;
        drop(held);
        for reply in ready {
            if let Err(error) = self.write(reply) {
                tracing::warn!("{error}");
            }
        }
    }

    fn write(&self, reply: Reply) -> Result<(), RosError> {
        self.writer.send(reply.cdr, reply.related).map(|_| ())
    }
}

/// The responses of all servers of a node.
#[derive(Clone, Default)]
pub(crate) struct AllReplies(Arc<Mutex<Vec<Weak<Replies>>>>);

impl AllReplies {
    /// From now on these responses are released when their clients are there.
    pub(crate) fn add(&self, replies: &Arc<Replies>) {
        let mut all = lock(&self.0);
        all.retain(|replies| replies.strong_count() > 0);
        all.push(Arc::downgrade(replies));
    }

    /// Sends the responses that need not wait any longer.
    pub(crate) fn release(&self) {
        let all: Vec<Arc<Replies>> = lock(&self.0).iter().filter_map(Weak::upgrade).collect();
        let now = Instant::now();
        all.iter().for_each(|replies| replies.release(now));
    }
}
