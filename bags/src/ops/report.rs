//! What validation finds.

use serde::Serialize;

/// Faults of one kind that are written out before the rest is only counted.
pub(super) const SHOWN: u64 = 5;

/// What validation found.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct Report {
    /// What makes the bag wrong.
    pub faults: Vec<String>,
    /// What is odd and allowed.
    pub warnings: Vec<String>,
    /// Messages checked.
    pub messages: u64,
    /// Findings by topic.
    pub topics: Vec<TopicReport>,
}

/// What validation found on one topic.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct TopicReport {
    /// Its name.
    pub topic: String,
    /// Its messages.
    pub messages: u64,
    /// Sequence numbers that are missing.
    pub missing: u64,
    /// Messages recorded after a later one.
    pub out_of_order: u64,
    /// Longest time between two messages [ns].
    pub longest_gap_ns: u64,
}
