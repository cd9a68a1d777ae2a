//! Frames as they are on the air: numbered items in classes, what was received of the other direction, and a check sum.

use serde::{Deserialize, Serialize};
use swath_sim::time::Tick;
use thiserror::Error;

/// Classes of items, the most urgent first.
pub const CLASSES: usize = 3;

/// Length of the check sum [bytes].
const SUM: usize = 4;

/// What is carried from one end to the other.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Item {
    /// What the two ends understand.
    pub bytes: Vec<u8>,
    /// Data that goes with it and that nobody here looks into, such as part of an image [bit].
    pub data_bits: u64,
}

impl Item {
    /// Size on the air, without the frame around it [bit].
    #[must_use]
    pub fn bits(&self) -> u64 {
        self.bytes.len() as u64 * 8 + self.data_bits
    }
}

/// Items of a class with consecutive numbers.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Part {
    /// The class.
    pub class: u8,
    /// Number of the first item.
    pub first: u64,
    /// The items.
    pub items: Vec<Item>,
}

/// What has been received of a class.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Received {
    /// All items with smaller numbers.
    pub next: u64,
    /// Items above it, as pairs: how many are missing, how many are there.
    pub beyond: Vec<(u64, u64)>,
}

/// A frame.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Frame {
    /// Clock of the sender.
    pub sent: Tick,
    /// What the sender has received, by class.
    pub received: [Received; CLASSES],
    /// What it sends.
    pub parts: Vec<Part>,
}

/// Why bytes are no frame.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum FrameError {
    /// The check sum differs.
    #[error("a frame of {length} bytes is damaged: its check sum differs")]
    Damaged {
        /// Its length.
        length: usize,
    },
    /// The check sum is right, but it is no frame.
    #[error("{length} bytes with a right check sum are no frame")]
    Foreign {
        /// Their length.
        length: usize,
    },
}

impl Frame {
    /// The bytes of a frame.
    #[must_use]
    pub fn encode(&self) -> Vec<u8> {
        // Only a writer that is full could fail, and a vector is not.
        let mut bytes = postcard::to_allocvec(self).unwrap_or_default();
        bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
        bytes
    }

    /// The frame of bytes.
    ///
    /// # Errors
    /// When they are damaged, or no frame.
    pub fn decode(bytes: &[u8]) -> Result<Self, FrameError> {
        let length = bytes.len();
        let (content, sum) = bytes.split_last_chunk::<SUM>().ok_or(FrameError::Damaged { length })?;
        if crc32fast::hash(content) != u32::from_le_bytes(*sum) {
            return Err(FrameError::Damaged { length });
        }
        match postcard::take_from_bytes::<Self>(content) {
            Ok((frame, [])) if frame.parts.iter().all(|part| usize::from(part.class) < CLASSES) => Ok(frame),
            _ => Err(FrameError::Foreign { length }),
        }
    }

    /// Data beside the bytes [bit].
    #[must_use]
    pub fn data_bits(&self) -> u64 {
        self.parts.iter().flat_map(|part| &part.items).fold(0, |sum, item| item.data_bits.saturating_add(sum))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn frame() -> impl Strategy<Value = Frame> {
        let item = (prop::collection::vec(any::<u8>(), 0..40), any::<u32>())
            .prop_map(|(bytes, data)| Item { bytes, data_bits: u64::from(data) });
        let part = (0..CLASSES as u8, any::<u64>(), prop::collection::vec(item, 0..5))
            .prop_map(|(class, first, items)| Part { class, first, items });
        let received = (any::<u64>(), prop::collection::vec(any::<(u64, u64)>(), 0..5))
            .prop_map(|(next, beyond)| Received { next, beyond });
        (any::<u64>(), [received.clone(), received.clone(), received], prop::collection::vec(part, 0..4))
            .prop_map(|(sent, received, parts)| Frame { sent: Tick(sent), received, parts })
    }

    proptest! {
        #[test]
        fn frames_survive_the_air_and_damage_is_seen(frame in frame(), at in any::<prop::sample::Index>(), bit in 0..8u8) {
            let bytes = frame.encode();
            prop_assert_eq!(Frame::decode(&bytes), Ok(frame));
            let mut damaged = bytes.clone();
            *at.get_mut(&mut damaged) ^= 1u8 << bit;
            prop_assert_eq!(Frame::decode(&damaged), Err(FrameError::Damaged { length: bytes.len() }));
            let cut = &bytes[..at.index(bytes.len())];
            prop_assert!(Frame::decode(cut).is_err());
        }

        #[test]
        fn no_bytes_are_a_panic(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            let mut summed = bytes.clone();
            summed.extend(crc32fast::hash(&bytes).to_le_bytes());
            _ = Frame::decode(&summed);
            _ = Frame::decode(&bytes);
        }
    }
}
