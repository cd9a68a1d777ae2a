//! Typed writers and readers.

use std::marker::PhantomData;
use std::time::Duration;

use swath_msgs::RosMessage;

use crate::endpoint::{Gid, RawPublisher, RawSubscription, SampleInfo};
use crate::error::RosError;
use crate::message::{decode, encode};
use crate::signal::Signal;

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
    /// If it cannot be encoded, or a reader has been lagging for [`crate::qos::SEND_TIMEOUT`].
    pub fn publish(&self, message: &M) -> Result<(), RosError> {
        self.raw.publish(encode(message)?)
    }

    /// Waits until every reliable reader has all messages, and tells whether that is so.
    pub fn flush(&self, timeout: Duration) -> bool {
        self.raw.flush(timeout)
    }

    /// Readers that this writer sends to.
    pub fn matched(&self) -> usize {
        self.raw.matched()
    }

    /// Fully qualified name of the topic.
    pub fn topic(&self) -> &str {
        self.raw.topic()
    }

    /// The writer's identity.
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
pub struct Subscription<M> {
    raw: RawSubscription,
    message: PhantomData<fn() -> M>,
}

impl<M: RosMessage> Subscription<M> {
    pub(crate) fn new(raw: RawSubscription) -> Self {
        Self { raw, message: PhantomData }
    }

    /// The next message, if there is one.
    ///
    /// Once it has returned nothing, the next message to come raises the node's [`Signal`].
    ///
    /// # Errors
    /// If the bytes that came are no such message; the next call goes on with the next sample.
    pub fn take(&self) -> Result<Option<M>, RosError> {
        Ok(self.take_sample()?.map(|sample| sample.message))
    }

    /// As [`Self::take`], with what came with the message.
    pub fn take_sample(&self) -> Result<Option<Sample<M>>, RosError> {
        let Some(sample) = self.raw.take()? else {
            return Ok(None);
        };
        Ok(Some(Sample { message: decode(&sample.cdr)?, info: sample.info }))
    }

    /// Waits for the next message, and returns nothing when the time is over.
    ///
    /// It waits for the signal of this subscription, and so sees any news that raise it.
    pub fn wait(&self, signal: &Signal, timeout: Duration) -> Result<Option<M>, RosError> {
        let deadline = std::time::Instant::now() + timeout;
        loop {
            if let Some(message) = self.take()? {
                return Ok(Some(message));
            }
            let remaining = deadline.saturating_duration_since(std::time::Instant::now());
            if remaining.is_zero() {
                return Ok(None);
            }
            signal.wait(remaining);
        }
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
