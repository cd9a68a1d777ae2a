//! Messages dropped by order before their reader takes them, drawn from a seed.

use std::sync::{Mutex, PoisonError};

use ros2_client::Gid;

use crate::endpoint::RawSample;

/// A share of the messages of a time is dropped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dropping {
    /// First simulated time of messages that may be dropped [ns], by their stamp.
    pub from_ns: u64,
    /// First simulated time of messages that may not any more [ns].
    pub until_ns: u64,
    /// Which share, 0 to 1.
    pub share: f64,
}

/// What a node drops of the messages that come again when they are not answered.
///
/// Which message is dropped follows from the seed, the topic, the reader and the number of the sample: one that is sent
/// again is drawn again.
#[derive(Debug, Default)]
pub(crate) struct Drops(Mutex<(u64, Vec<Dropping>)>);

impl Drops {
    pub(crate) fn set(&self, seed: u64, drops: Vec<Dropping>) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = (seed, drops);
    }

    /// Whether a sample is dropped on its way to a reader.
    pub(crate) fn takes(&self, topic: &str, reader: Gid, sample: &RawSample) -> bool {
        let guard = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let (seed, drops) = &*guard;
        if drops.is_empty() {
            return false;
        }
        let Some(stamp_ns) = stamp_ns(sample.cdr.as_bytes()) else { return false };
        let mut shares = drops.iter().filter(|it| (it.from_ns..it.until_ns).contains(&stamp_ns));
        let Some(drop) = shares.next() else { return false };
        let named = topic.bytes().fold(*seed, |hash, byte| mixed(hash ^ u64::from(byte)));
        // The last bytes tell readers of one process apart; the first ones differ from run to run.
        let reader = reader.as_bytes().iter().rev().take(4).fold(named, |hash, &byte| mixed(hash ^ u64::from(byte)));
        let drawn = mixed(reader ^ sample.info.sequence_number.cast_unsigned());
        ((drawn >> 11) as f64) < drop.share * (1u64 << 53) as f64
    }
}

/// The stamp of a message that begins with a header [ns].
fn stamp_ns(bytes: &[u8]) -> Option<u64> {
    let word = |at: usize| bytes.get(at..at + 4)?.try_into().ok().map(u32::from_le_bytes);
    Some(u64::from(word(4)?) * 1_000_000_000 + u64::from(word(8)?))
}

/// The finaliser of SplitMix64: each bit of the result hangs on each bit of the number.
fn mixed(number: u64) -> u64 {
    let number = number.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let number = (number ^ (number >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let number = (number ^ (number >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    number ^ (number >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cdr::Cdr;
    use crate::endpoint::SampleInfo;

    fn sample(second: u32, sequence_number: i64) -> RawSample {
        let bytes = [[0, 1, 0, 0], second.to_le_bytes(), [0; 4]].concat();
        let writer = Gid::from(rustdds::GUID::GUID_UNKNOWN);
        let info = SampleInfo { source_time_ns: None, received_time_ns: 0, writer, sequence_number, related: None };
        RawSample { cdr: Cdr::from_bytes(bytes), info }
    }

    fn dropped(drops: &Drops, topic: &str, second: u32) -> Vec<bool> {
        let reader = Gid::from(rustdds::GUID::GUID_UNKNOWN);
        (1..=10_000).map(|number| drops.takes(topic, reader, &sample(second, number))).collect()
    }

    #[test]
    fn a_share_is_dropped_while_it_is_ordered_and_the_seed_says_which() {
        let drops = Drops::default();
        assert!(!dropped(&drops, "/x", 5).contains(&true));
        let order = Dropping { from_ns: 4_000_000_000, until_ns: 6_000_000_000, share: 0.2 };
        drops.set(7, vec![order]);
        let first = dropped(&drops, "/x", 5);
        let count = first.iter().filter(|it| **it).count();
        assert!((1900..2100).contains(&count), "{count} of 10000");
        assert_eq!(first, dropped(&drops, "/x", 5));
        assert_ne!(first, dropped(&drops, "/y", 5));
        assert!(!dropped(&drops, "/x", 3).contains(&true) && !dropped(&drops, "/x", 6).contains(&true));
        drops.set(8, vec![order]);
        assert_ne!(first, dropped(&drops, "/x", 5));
        assert!(!Drops::default().takes("/x", Gid::from(rustdds::GUID::GUID_UNKNOWN), &sample(5, 1)));
        let short = RawSample { cdr: Cdr::from_bytes(vec![0, 1, 0, 0, 9]), ..sample(5, 1) };
        assert!(!drops.takes("/x", Gid::from(rustdds::GUID::GUID_UNKNOWN), &short));
    }
}
