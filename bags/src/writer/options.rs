//! How a bag is written, and what has been written.

use std::collections::BTreeMap;
use std::time::Duration;

use crate::file::chunk::Compression;

/// How a bag is written.
#[derive(Debug, Clone)]
pub struct BagOptions {
    /// Compression of chunks.
    pub compression: Compression,
    /// Level of zstd, 1 (fast) to 19 (small).
    pub zstd_level: i32,
    /// A chunk is closed when its messages reach this size [bytes].
    pub chunk_bytes: usize,
    /// A chunk is closed at this age, so that a kill loses no more [wall time].
    pub flush_interval: Duration,
    /// A new file is started when one reaches this size [bytes].
    pub max_file_bytes: Option<u64>,
    /// A new file is started when one spans this log time.
    pub max_file_duration: Option<Duration>,
    /// Snapshot mode: keep this many bytes in memory and store them on [`BagWriter::snapshot`].
    pub snapshot_bytes: Option<usize>,
    /// MCAP profile.
    pub profile: String,
    /// Pairs for `custom_data` in `metadata.yaml`.
    pub custom_data: BTreeMap<String, String>,
    /// ROS distribution named in `metadata.yaml`.
    pub ros_distro: String,
    /// Go on with a bag that is there, in a new file.
    pub resume: bool,
    /// Log times of which nothing can be stored, as if the disk were full: from the first one up to the second [ns].
    pub full: Vec<(u64, u64)>,
}

impl Default for BagOptions {
    fn default() -> Self {
        Self {
            compression: Compression::Zstd,
            zstd_level: 1,
            chunk_bytes: 1 << 20,
            flush_interval: Duration::from_millis(500),
            max_file_bytes: None,
            max_file_duration: None,
            snapshot_bytes: None,
            profile: "ros2".to_owned(),
            custom_data: BTreeMap::new(),
            ros_distro: "jazzy".to_owned(),
            resume: false,
            full: Vec::new(),
        }
    }
}

/// What a closed bag holds.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct BagSummary {
    /// Messages in all files.
    pub messages: u64,
    /// Messages that were to be in the bag and are not.
    pub lost: u64,
    /// Messages by topic name.
    pub counts: BTreeMap<String, u64>,
    /// Number of files.
    pub files: usize,
    /// Size of all files [bytes].
    pub bytes: u64,
    /// Earliest log time [ns].
    pub start: u64,
    /// Latest log time [ns].
    pub end: u64,
}
