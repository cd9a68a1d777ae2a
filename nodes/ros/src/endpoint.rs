//! Writers and readers of CDR bytes: what recorder and player use, and what typed topics are made of.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, Weak};
use std::time::{Duration, Instant};

use ros2_client::Gid;
use rustdds::dds::{ReadError, WriteError};
use rustdds::no_key::DeserializedCacheChange;
use rustdds::{SampleIdentity, Timestamp, WriteOptionsBuilder};

use crate::cdr::Cdr;
use crate::error::RosError;
use crate::notices::Trouble;
use crate::qos::{Profile, SEND_TIMEOUT};
use crate::roster::{Direction, Roster};
use crate::rtps::Prefix;
use crate::signal::{Signal, lock};
use crate::slot::{Bell, ReaderSlot, WriterSlot};

/// What comes with a sample.
#[derive(Clone, Debug, PartialEq)]
pub struct SampleInfo {
    /// When the writer sent it [ns since 1970], if it says so.
    pub source_time_ns: Option<u64>,
    /// When it came in [ns since 1970].
    pub received_time_ns: u64,
    /// The writer.
    pub writer: Gid,
    /// Number of the sample among those of its writer, from 1.
    pub sequence_number: i64,
    pub(crate) related: Option<SampleIdentity>,
}

/// A message of CDR bytes with what came with it.
#[derive(Clone, Debug, PartialEq)]
pub struct RawSample {
    /// The message.
    pub cdr: Cdr,
    /// What came with it.
    pub info: SampleInfo,
}

/// Writes CDR bytes to a topic.
pub struct RawPublisher {
    slot: Arc<WriterSlot>,
    topic: String,
    roster: Arc<Roster>,
}

impl RawPublisher {
    pub(crate) fn new(slot: Arc<WriterSlot>, topic: String, roster: Arc<Roster>) -> Self {
        Self { slot, topic, roster }
    }

    /// Sends a message of little-endian CDR bytes, encapsulation header included.
    ///
    /// A reader that does not acknowledge thousands of samples is waited for: by a node of a mission until it is clear
    /// that it lags, from then on it is not waited for any more; by any other node for [`crate::qos::SEND_TIMEOUT`].
    ///
    /// # Errors
    /// If the bytes are encoded in another way, or readers were waited for in vain.
    pub fn publish(&self, cdr: Cdr) -> Result<(), RosError> {
        self.send(cdr, None).map(|_| ())
    }

    pub(crate) fn send(&self, cdr: Cdr, related: Option<SampleIdentity>) -> Result<SampleIdentity, RosError> {
        let failed = |reason: String| RosError::Send { topic: self.topic.clone(), reason };
        if cdr.little_endian().is_none() {
            return Err(failed("only little-endian CDR can be sent".to_owned()));
        }
        let options = WriteOptionsBuilder::new().source_timestamp(Timestamp::now());
        let options = options.related_sample_identity_opt(related).build();
        let (start, mut cdr) = (Instant::now(), cdr);
        loop {
            // Each attempt waits for `qos::BLOCKING`.
            match self.slot.write(cdr, options.clone()) {
                Ok(identity) => return Ok(identity),
                Err(WriteError::WouldBlock { data }) if start.elapsed() < SEND_TIMEOUT => {
                    self.roster.let_go_readers(self.gid(), &self.topic);
                    cdr = data;
                }
                Err(error) => return Err(failed(error.to_string())),
            }
        }
    }

    /// Waits until every reliable reader has all samples, and tells whether that is so.
    #[must_use]
    pub fn flush(&self, timeout: Duration) -> bool {
        self.slot.flush(timeout)
    }

    /// Whether a reader of that process hears this writer.
    pub(crate) fn is_heard_by(&self, process: Prefix) -> bool {
        self.roster.is_matched_with(self.gid(), process)
    }

    /// Readers that this writer sends to.
    #[must_use]
    pub fn matched(&self) -> usize {
        self.roster.matched(self.gid()).len()
    }

    /// Fully qualified name of the topic.
    #[must_use]
    pub fn topic(&self) -> &str {
        &self.topic
    }

    /// The writer's identity; another one after RustDDS has been started anew.
    #[must_use]
    pub fn gid(&self) -> Gid {
        self.slot.gid()
    }
}

impl Drop for RawPublisher {
    fn drop(&mut self) {
        self.slot.take_leave();
        self.roster.withdraw(Direction::Write, self.gid());
    }
}

/// Reads CDR bytes from a topic.
pub struct RawSubscription {
    slot: Arc<ReaderSlot>,
    topic: String,
    roster: Arc<Roster>,
    bell: Arc<Bell>,
    arrivals: Arc<Mutex<Arrivals>>,
}

impl RawSubscription {
    pub(crate) fn new(slot: Arc<ReaderSlot>, topic: String, roster: Arc<Roster>, signal: &Signal) -> Self {
        let bell = slot.hang(signal);
        Self { slot, topic, roster, bell, arrivals: Arc::default() }
    }

    /// The next sample, if there is one.
    ///
    /// Once it has returned nothing, the next sample to come raises the node's [`Signal`]. Samples of an unknown
    /// encoding are passed over and counted (`Node::notices`).
    ///
    /// # Errors
    /// When DDS fails.
    pub fn take(&self) -> Result<Option<RawSample>, RosError> {
        // A node that reads many topics asks them all whenever one has news: this makes it cheap.
        if self.bell.is_quiet() {
            return Ok(None);
        }
        if let Some(sample) = self.try_take()? {
            return Ok(Some(sample));
        }
        self.bell.wait();
        self.slot.set_waker(&self.bell);
        // A sample may have come before the waker was set: look again.
        let sample = self.try_take()?;
        if sample.is_some() {
            self.bell.expect();
        }
        Ok(sample)
    }

    fn try_take(&self) -> Result<Option<RawSample>, RosError> {
        loop {
            match self.slot.take() {
                Ok(change) => {
                    return Ok(change.map(|change| {
                        let sample = raw_sample(change);
                        lock(&self.arrivals).note(&sample.info);
                        sample
                    }));
                }
                // The reader has gone on to the next sample.
                Err(ReadError::Deserialization { reason }) => self.note_unreadable(|| reason),
                Err(error) => {
                    return Err(RosError::Receive { topic: self.topic.clone(), reason: error.to_string() });
                }
            }
        }
    }

    /// Counts a sample that is no message.
    pub(crate) fn note_unreadable(&self, reason: impl FnOnce() -> String) {
        self.roster.notices.note(Trouble::Unreadable, &self.topic, reason);
    }

    /// What this process knows of the others.
    pub(crate) fn roster(&self) -> &Roster {
        &self.roster
    }

    /// From now on this subscription raises that signal and no longer the node's.
    pub fn set_signal(&mut self, signal: &Signal) {
        self.bell = self.slot.hang(signal);
        signal.raise();
    }

    /// Samples that were sent but never taken: too many came before they were taken.
    #[must_use]
    pub fn lost(&self) -> u64 {
        lock(&self.arrivals).lost
    }

    /// What comes here, to look at from elsewhere.
    pub(crate) fn watched(&self, profile: Profile) -> Watched {
        Watched { topic: self.topic.clone(), profile, arrivals: Arc::downgrade(&self.arrivals) }
    }

    /// Writers that this reader receives from.
    #[must_use]
    pub fn matched(&self) -> usize {
        self.roster.matched(self.gid()).len()
    }

    /// Fully qualified name of the topic.
    #[must_use]
    pub fn topic(&self) -> &str {
        &self.topic
    }

    /// The reader's identity; another one after RustDDS has been started anew.
    #[must_use]
    pub fn gid(&self) -> Gid {
        self.slot.gid()
    }
}

impl Drop for RawSubscription {
    fn drop(&mut self) {
        self.roster.withdraw(Direction::Read, self.gid());
    }
}

/// What has come on a topic.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Input {
    /// Fully qualified name of the topic.
    pub topic: String,
    /// How often something is expected.
    pub profile: Profile,
    /// Messages that were taken.
    pub received: u64,
    /// Messages that were sent but never taken.
    pub lost: u64,
    /// How long ago the last one was taken; nothing before the first.
    pub age: Option<Duration>,
}

/// A subscription as it is looked at from elsewhere.
pub(crate) struct Watched {
    topic: String,
    profile: Profile,
    arrivals: Weak<Mutex<Arrivals>>,
}

impl Watched {
    /// What has come; nothing once the subscription is gone.
    pub(crate) fn look(&self) -> Option<Input> {
        let arrivals = self.arrivals.upgrade()?;
        let Arrivals { received, lost, at, .. } = &*lock(&arrivals);
        let age = at.map(|at| at.elapsed());
        Some(Input { topic: self.topic.clone(), profile: self.profile, received: *received, lost: *lost, age })
    }
}

/// Counts samples, and gaps in the numbers of each writer's.
#[derive(Default)]
struct Arrivals {
    last: BTreeMap<Gid, i64>,
    received: u64,
    lost: u64,
    /// When the last one was taken.
    at: Option<Instant>,
}

impl Arrivals {
    fn note(&mut self, info: &SampleInfo) {
        self.received += 1;
        self.at = Some(Instant::now());
        if let Some(last) = self.last.insert(info.writer, info.sequence_number) {
            self.lost += u64::try_from(info.sequence_number - last - 1).unwrap_or(0);
        }
    }
}

fn raw_sample(change: DeserializedCacheChange<Cdr>) -> RawSample {
    let info = SampleInfo {
        source_time_ns: change.source_timestamp().map(nanoseconds),
        received_time_ns: nanoseconds(change.receive_instant),
        writer: change.writer_guid().into(),
        sequence_number: change.sequence_number.into(),
        related: change.related_sample_identity(),
    };
    RawSample { cdr: change.into_value(), info }
}

/// Nanoseconds since 1970 of a time that DDS counts in 2^-32 s.
fn nanoseconds(time: Timestamp) -> u64 {
    let ticks = time.to_ticks();
    let (seconds, fraction) = (ticks >> 32, ticks & 0xffff_ffff);
    seconds * 1_000_000_000 + ((fraction * 1_000_000_000 + (1 << 31)) >> 32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_exact_to_the_nanosecond() {
        assert_eq!(nanoseconds(Timestamp::from_ticks(1 << 32)), 1_000_000_000);
        assert_eq!(nanoseconds(Timestamp::from_ticks((5 << 32) + (1 << 31))), 5_500_000_000);
        // 2^-32 s is 0.23 ns: every nanosecond has a tick of its own.
        let one_ns = ((1_u64 << 32) / 1_000_000_000) + 1;
        assert_eq!(nanoseconds(Timestamp::from_ticks(one_ns)), 1);
    }

    #[test]
    fn gaps_are_counted_per_writer() {
        let info = |writer: u8, sequence_number| SampleInfo {
            source_time_ns: None,
            received_time_ns: 0,
            writer: [writer; 16].into(),
            sequence_number,
            related: None,
        };
        let mut arrivals = Arrivals::default();
        for (writer, number) in [(1, 10), (2, 1), (1, 11), (2, 4), (1, 13)] {
            arrivals.note(&info(writer, number));
        }
        assert_eq!((arrivals.received, arrivals.lost), (5, 3));
    }
}
