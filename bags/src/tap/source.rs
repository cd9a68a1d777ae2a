//! One topic that is listened to.

use swath_ros::{RawSample, RawSubscription, graph};

use super::stamp::StampPlace;
use crate::error::Result;
use crate::schema::Schema;
use crate::topic::Topic;

/// Messages that are taken from one topic before the others have their turn.
const TURN: usize = 8192;

/// A message on its way to the sink.
pub(super) struct Taken {
    /// Number of its source.
    pub source: usize,
    /// Its bytes, and what DDS knows of them.
    pub sample: RawSample,
}

impl Taken {
    /// When it came in [ns since 1970].
    pub(super) fn received_ns(&self) -> u64 {
        self.sample.info.received_time_ns
    }
}

/// A subscription with what is needed to tell its messages' time.
pub(super) struct Source {
    pub topic: Topic,
    pub is_clock: bool,
    subscription: RawSubscription,
    stamp: StampPlace,
    entry: Option<&'static graph::Entry>,
    lost: u64,
}

impl Source {
    pub(super) fn new(
        topic: Topic,
        is_clock: bool,
        subscription: RawSubscription,
        entry: Option<&'static graph::Entry>,
    ) -> Result<Self> {
        let stamp = match topic.schema().is_empty() {
            true => StampPlace::Nowhere,
            false => StampPlace::of(&Schema::of(&topic)?),
        };
        Ok(Self { topic, is_clock, subscription, stamp, entry, lost: 0 })
    }

    /// Takes what has come; returns whether there may be more, which raises no signal.
    pub(super) fn take_all(&mut self, number: usize, batch: &mut Vec<Taken>) -> Result<bool> {
        for _ in 0..TURN {
            let Some(sample) = self.subscription.take()? else { return Ok(false) };
            batch.push(Taken { source: number, sample });
        }
        Ok(true)
    }

    /// The simulated time in a message's bytes [ns].
    pub(super) fn stamp_of(&self, cdr: &[u8]) -> Option<u64> {
        self.stamp.read(cdr)
    }

    /// Messages lost since the last call.
    pub(super) fn newly_lost(&mut self) -> u64 {
        let lost = self.subscription.lost();
        let new = lost - self.lost;
        self.lost = lost;
        new
    }

    /// Whether anyone writes this topic.
    pub(super) fn is_matched_at_all(&self) -> bool {
        self.subscription.matched() > 0
    }

    /// Whether the expected nodes that write this topic are matched.
    pub(super) fn is_matched(&self, expected: &[String]) -> bool {
        let writers = self.entry.map_or(&[][..], |entry| entry.writers);
        let wanted = writers.iter().filter(|node| expected.iter().any(|e| e == *node)).count();
        self.subscription.matched() >= wanted
    }
}
