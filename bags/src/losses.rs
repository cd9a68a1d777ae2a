//! Messages that a recording has lost, and the record that tells of them.

use std::collections::BTreeMap;

/// The metadata record that tells how a recording went.
pub const RECORDING: &str = "swath_recording";

/// The metadata record that tells in which file a recording goes on that was interrupted.
pub(crate) const RESUMED: &str = "swath_resumed";
/// Its entry that names the file.
pub(crate) const RESUMED_FILE: &str = "file";

/// Messages that were to be in a bag and are not.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Losses {
    /// Lost on the way to the writer, by topic.
    pub by_topic: BTreeMap<String, u64>,
    /// Lost because they could not be stored.
    pub unsaved: u64,
}

impl Losses {
    const TOTAL: &str = "lost_messages";
    const UNSAVED: &str = "lost_messages unsaved";

    /// All lost messages.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.by_topic.values().sum::<u64>() + self.unsaved
    }

    pub(crate) fn add(&mut self, other: &Self) {
        self.unsaved += other.unsaved;
        for (topic, n) in &other.by_topic {
            *self.by_topic.entry(topic.clone()).or_insert(0) += n;
        }
    }

    /// As the pairs of a [`RECORDING`] record.
    pub(crate) fn to_metadata(&self) -> BTreeMap<String, String> {
        let by_topic = self.by_topic.iter();
        let by_topic = by_topic.map(|(topic, n)| (format!("{} {topic}", Self::TOTAL), n.to_string()));
        let total = (Self::TOTAL.to_owned(), self.total().to_string());
        by_topic.chain([total, (Self::UNSAVED.to_owned(), self.unsaved.to_string())]).collect()
    }

    /// From the pairs of a [`RECORDING`] record.
    #[must_use]
    pub fn from_metadata(metadata: &BTreeMap<String, String>) -> Self {
        let mut losses = Self::default();
        for (key, value) in metadata {
            let n = value.parse().unwrap_or(0);
            if key == Self::UNSAVED {
                losses.unsaved = n;
            } else if let Some(topic) = key.strip_prefix("lost_messages /") {
                losses.by_topic.insert(format!("/{topic}"), n);
            }
        }
        losses
    }
}
