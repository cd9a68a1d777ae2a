//! Typed writers and readers.

use std::collections::VecDeque;
use std::marker::PhantomData;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use ros2_client::Gid;
use swath_msgs::RosMessage;

use crate::drops::Drops;
use crate::endpoint::{RawPublisher, RawSample, RawSubscription, SampleInfo};
use crate::error::RosError;
use crate::graph::OPERATOR;
use crate::members::Standing;
use crate::message::{decode, encode};
use crate::signal::{Signal, lock};

/// Writes messages to a topic.
pub struct Publisher<M> {
    raw: RawPublisher,
    message: PhantomData<fn(M)>,
}

impl<M: RosMessage> Publisher<M> {
    pub(crate) fn new(raw: RawPublisher) -> Self {
        Self { raw, message: PhantomData }
    }

    /// Sends a message.
    ///
    /// # Errors
    /// If it cannot be encoded, or as [`RawPublisher::publish`].
    pub fn publish(&self, message: &M) -> Result<(), RosError> {
        self.raw.publish(encode(message)?)
    }

    /// Waits until every reliable reader has all messages, and tells whether that is so.
    #[must_use]
    pub fn flush(&self, timeout: Duration) -> bool {
        self.raw.flush(timeout)
    }

    /// Readers that this writer sends to.
    #[must_use]
    pub fn matched(&self) -> usize {
        self.raw.matched()
    }

    /// Fully qualified name of the topic.
    #[must_use]
    pub fn topic(&self) -> &str {
        self.raw.topic()
    }

    /// The writer's identity.
    #[must_use]
    pub fn gid(&self) -> Gid {
        self.raw.gid()
    }
}

/// A message with what came with it.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample<M> {
    /// The message.
    pub message: M,
    /// What came with it.
    pub info: SampleInfo,
}

/// Reads messages from a topic.
///
/// In a node of a mission, only messages of the writers that the table names count, if they belong to the mission.
/// Those of others are passed over and counted (`Node::notices`), and so are bytes that are no message of the type.
pub struct Subscription<M> {
    raw: RawSubscription,
    /// Names of the nodes whose messages count; everybody's do if there are none.
    writers: &'static [&'static str],
    /// A writer that counts, up to a revision of what is known of the others.
    counts: Mutex<Option<(Gid, u64)>>,
    /// Messages of writers that are not known yet.
    parked: Mutex<VecDeque<RawSample>>,
    /// What is dropped by order.
    drops: Option<Arc<Drops>>,
    message: PhantomData<fn() -> M>,
}

/// A late reader is sent so many of the samples that a writer holds; the next ones after the next heartbeat.
const ROUND: usize = 256;

/// How long the samples of a round may be apart, and how long the next round may take to begin.
const PAUSES: [Duration; 2] = [Duration::from_millis(150), Duration::from_millis(1200)];

/// Messages of unknown writers that are kept.
const PARKED: usize = 64;

impl<M: RosMessage> Subscription<M> {
    pub(crate) fn new(raw: RawSubscription, writers: &'static [&'static str], drops: Option<Arc<Drops>>) -> Self {
        let writers = if writers.contains(&OPERATOR) { &[] } else { writers };
        Self { raw, writers, counts: Mutex::default(), parked: Mutex::default(), drops, message: PhantomData }
    }

    /// The next message, if there is one.
    ///
    /// Once it has returned nothing, the next message to come raises the node's [`Signal`].
    ///
    /// # Errors
    /// If DDS fails; never because of what others send.
    pub fn take(&self) -> Result<Option<M>, RosError> {
        Ok(self.take_sample()?.map(|sample| sample.message))
    }

    /// As [`Self::take`], with what came with the message.
    ///
    /// # Errors
    /// As [`Self::take`].
    pub fn take_sample(&self) -> Result<Option<Sample<M>>, RosError> {
        while let Some(sample) = self.take_counted()? {
            match decode(&sample.cdr) {
                Ok(message) => return Ok(Some(Sample { message, info: sample.info })),
                Err(error) => self.raw.note_unreadable(|| error.to_string()),
            }
        }
        Ok(None)
    }

    /// The next sample of a writer that counts.
    fn take_counted(&self) -> Result<Option<RawSample>, RosError> {
        if let Some(sample) = self.take_parked() {
            return Ok(Some(sample));
        }
        while let Some(sample) = self.raw.take()? {
            if self.drops.as_ref().is_some_and(|drops| drops.takes(self.raw.topic(), self.raw.gid(), &sample)) {
                continue;
            }
            match self.standing(sample.info.writer) {
                Standing::Counts => return Ok(Some(sample)),
                Standing::Stranger => self.note_stranger(&sample),
                Standing::Unknown => self.park(sample),
            }
        }
        Ok(None)
    }

    /// A sample whose writer has become known since it came.
    fn take_parked(&self) -> Option<RawSample> {
        let mut parked = lock(&self.parked);
        let mut index = 0;
        while let Some(sample) = parked.get(index) {
            match self.standing(sample.info.writer) {
                Standing::Counts => return parked.remove(index),
                Standing::Unknown => index += 1,
                Standing::Stranger => {
                    self.note_stranger(sample);
                    parked.remove(index);
                }
            }
        }
        None
    }

    fn park(&self, sample: RawSample) {
        let mut parked = lock(&self.parked);
        if parked.len() == PARKED {
            self.note_stranger(&sample);
        } else {
            parked.push_back(sample);
        }
    }

    fn standing(&self, writer: Gid) -> Standing {
        if self.writers.is_empty() {
            return Standing::Counts;
        }
        let roster = self.raw.roster();
        if *lock(&self.counts) == Some((writer, roster.revision())) {
            return Standing::Counts;
        }
        let (standing, revision) = roster.standing(writer, self.writers);
        if standing == Standing::Counts {
            *lock(&self.counts) = Some((writer, revision));
        }
        standing
    }

    fn note_stranger(&self, sample: &RawSample) {
        self.raw.roster().note_stranger(sample.info.writer, self.raw.topic());
    }

    /// Waits for the next message, and returns nothing when the time is over.
    ///
    /// It waits for the signal of this subscription, and so sees any news that raise it.
    ///
    /// # Errors
    /// When DDS fails.
    pub fn wait(&self, signal: &Signal, timeout: Duration) -> Result<Option<M>, RosError> {
        let deadline = Instant::now() + timeout;
        loop {
            if let Some(message) = self.take()? {
                return Ok(Some(message));
            }
            let remaining = deadline.saturating_duration_since(Instant::now());
            if remaining.is_zero() {
                return Ok(None);
            }
            signal.wait(remaining);
        }
    }

    /// The newest message of a latched topic, for those who want to know how things stand; nothing when none comes in
    /// that time.
    ///
    /// A reader that comes late is sent what the writer still holds, the oldest first: the newest one is there when no
    /// more comes for a while.
    ///
    /// # Errors
    /// As [`Self::take`].
    pub fn newest(&self, signal: &Signal, timeout: Duration) -> Result<Option<M>, RosError> {
        let (mut newest, mut taken, mut pause) = (None, 0, timeout);
        while let Some(newer) = self.wait(signal, pause)? {
            newest = Some(newer);
            taken += 1;
            pause = PAUSES[usize::from(taken >= ROUND)];
        }
        Ok(newest)
    }

    /// From now on this subscription raises that signal and no longer the node's.
    pub fn set_signal(&mut self, signal: &Signal) {
        self.raw.set_signal(signal);
    }

    /// Messages that were sent but never taken: too many came before they were taken.
    pub fn lost(&self) -> u64 {
        self.raw.lost()
    }

    /// Writers that this reader receives from.
    pub fn matched(&self) -> usize {
        self.raw.matched()
    }

    /// Fully qualified name of the topic.
    pub fn topic(&self) -> &str {
        self.raw.topic()
    }

    /// The reader's identity.
    pub fn gid(&self) -> Gid {
        self.raw.gid()
    }
}
