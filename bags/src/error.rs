//! The one error type of this crate.

use std::io;
use std::path::PathBuf;

use thiserror::Error;

/// Shorthand for results of this crate.
pub type Result<T, E = BagError> = std::result::Result<T, E>;

/// Everything that can go wrong with a bag.
#[derive(Debug, Error)]
pub enum BagError {
    /// The operating system refused an operation on a file or directory.
    #[error("cannot {action} {path}")]
    Io {
        /// What was tried: "open", "write", …
        action: &'static str,
        /// The file or directory.
        path: PathBuf,
        /// The operating system's reason.
        #[source]
        source: io::Error,
    },
    /// A path names neither a bag directory nor an MCAP file.
    #[error("{path} is not a bag: {reason}")]
    NotABag {
        /// The path as given.
        path: PathBuf,
        /// What was looked for and not found.
        reason: String,
    },
    /// The target of a new bag is there already.
    #[error("{path} already exists")]
    Exists {
        /// The bag directory.
        path: PathBuf,
    },
    /// Bytes of a bag file are not what the format says.
    #[error("{path}: offset {offset}: {reason}")]
    Corrupt {
        /// The file.
        path: PathBuf,
        /// Byte offset in the file of the record at fault.
        offset: u64,
        /// What is wrong there.
        reason: String,
    },
    /// Something in a bag file is larger than what is read into memory.
    #[error("{path}: offset {offset}: {what} of {bytes} bytes, the limit is {limit}: raise it with --max-record-size")]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Byte offset in the file of what is too large; in a SQLite file, the row.
        offset: u64,
        /// What it is.
        what: &'static str,
        /// Its size [bytes].
        bytes: u64,
        /// The limit [bytes].
        limit: u64,
    },
    /// A SQLite file cannot be read.
    #[error("cannot read {path}")]
    Sqlite {
        /// The file.
        path: PathBuf,
        /// SQLite's reason.
        #[source]
        source: rusqlite::Error,
    },
    /// `metadata.yaml` cannot be understood.
    #[error("{path}: {reason}")]
    Metadata {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// No room left; the bag was closed after its last whole chunk that fits.
    #[error("no room left for {path}: closed after {kept} messages, {lost} messages lost")]
    DiskFull {
        /// The bag file that could not grow.
        path: PathBuf,
        /// Messages in the bag that was left.
        kept: u64,
        /// Messages that were handed over and are not in the bag.
        lost: u64,
    },
    /// The writer stopped after an earlier failure, which `close` reports.
    #[error("the bag writer has stopped after an earlier failure")]
    WriterStopped,
    /// A topic cannot be added to a bag.
    #[error("topic {topic}: {reason}")]
    Topic {
        /// The topic's name.
        topic: String,
        /// Why it was refused.
        reason: String,
    },
    /// A schema text is not a ROS 2 message definition.
    #[error("schema of {type_name}, line {line}: {reason}")]
    Schema {
        /// The message type.
        type_name: String,
        /// Line of the schema text, from 1.
        line: usize,
        /// What is wrong there.
        reason: String,
    },
    /// A message's bytes are not the CDR of its type.
    #[error("CDR of {type_name}, byte {offset}: {reason}")]
    Cdr {
        /// The message type.
        type_name: String,
        /// Offset in the message, encapsulation header included.
        offset: usize,
        /// What is wrong there.
        reason: String,
    },
    /// A QoS profile list cannot be understood.
    #[error("QoS profiles: {reason}")]
    Qos {
        /// What is wrong.
        reason: String,
    },
    /// ROS or DDS refused something.
    #[error(transparent)]
    Ros(Box<swath_ros::RosError>),
    /// A bag would be played into a mission that flies.
    #[error(
        "{node} flies in domain {domain}, and {topic} is one of its mission's topics (--force plays it all the same)"
    )]
    LiveMission {
        /// The node of the mission.
        node: String,
        /// The DDS domain.
        domain: u16,
        /// A topic that would be played.
        topic: String,
    },
    /// An option or argument is out of its range or contradicts another.
    #[error("{option}: {reason}")]
    Option {
        /// The option's name on the command line.
        option: &'static str,
        /// The value and its limit.
        reason: String,
    },
}

impl BagError {
    /// Wraps an I/O error for `map_err`: `.map_err(BagError::io("open", &path))`.
    pub(crate) fn io(action: &'static str, path: &std::path::Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::Io { action, path, source }
    }

    /// Whether an I/O error means that the file can no longer grow.
    /// Whether there is no room left on the disk.
    #[must_use]
    pub fn is_no_room(&self) -> bool {
        match self {
            Self::DiskFull { .. } => true,
            Self::Io { source, .. } => Self::is_disk_full(source),
            _ => false,
        }
    }

    pub(crate) fn is_disk_full(error: &io::Error) -> bool {
        matches!(error.kind(), io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded | io::ErrorKind::FileTooLarge)
    }
}

impl From<BagError> for io::Error {
    /// For copying, where what is read may fail as what is written.
    fn from(error: BagError) -> Self {
        Self::other(error)
    }
}

/// An error with all its causes, "a: b: c".
pub fn chain(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(inner) = cause {
        text.push_str(": ");
        text.push_str(&inner.to_string());
        cause = inner.source();
    }
    text
}
