//! Where the bytes of a bag's file come from.

use std::path::Path;
use std::sync::Arc;

use super::source::Source;
use super::sqlite::Sqlite;
use crate::error::BagError;

/// Where the bytes of a file come from.
#[derive(Debug, Clone)]
pub(crate) enum Storage {
    /// An MCAP file.
    Mcap(Arc<Source>),
    /// A SQLite file of rosbag2.
    Sqlite(Arc<Sqlite>),
}

impl Storage {
    pub(crate) fn path(&self) -> &Path {
        match self {
            Self::Mcap(source) => &source.path,
            Self::Sqlite(sqlite) => sqlite.path(),
        }
    }

    /// Length of the file [bytes].
    pub(crate) fn len(&self) -> u64 {
        match self {
            Self::Mcap(source) => source.len,
            Self::Sqlite(sqlite) => sqlite.len(),
        }
    }

    /// Largest record that is read [bytes].
    pub(crate) fn limit(&self) -> u64 {
        match self {
            Self::Mcap(source) => source.limit,
            Self::Sqlite(sqlite) => sqlite.limit(),
        }
    }

    /// The error of something larger than what is read.
    pub(crate) fn too_large(&self, offset: u64, what: &'static str, bytes: u64) -> BagError {
        BagError::TooLarge { path: self.path().to_owned(), offset, what, bytes, limit: self.limit() }
    }

    /// An error at an offset of this file.
    pub(crate) fn corrupt(&self, offset: u64, reason: impl Into<String>) -> BagError {
        BagError::Corrupt { path: self.path().to_owned(), offset, reason: reason.into() }
    }
}
