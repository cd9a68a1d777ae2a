//! What an index tells of a file's parts: schemas, attachments, and where messages lie that are read in one go.

use std::sync::Arc;

use mcap::records::AttachmentHeader;

use super::walk::Place;

/// A run of rows in order of time: timestamp [ns] and row id of the first and the last.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Rows {
    pub first: (i64, i64),
    pub last: (i64, i64),
}

/// What a run of messages is stored as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// A chunk.
    Chunk,
    /// Message records outside chunks, one behind the other.
    Loose,
    /// Rows of a table.
    Rows(Rows),
}

/// Where messages lie that are read in one go.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct ChunkRef {
    /// Offset of the chunk's record, or of the run; for rows, their number.
    pub offset: u64,
    /// Length, prefix included.
    pub len: u64,
    /// Earliest log time [ns].
    pub start: u64,
    /// Latest log time [ns].
    pub end: u64,
    /// How it is stored.
    pub kind: Kind,
    /// Channels that have messages here; `None` when the index does not tell.
    pub channels: Option<Vec<u16>>,
}

/// A schema as the file holds it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Schema {
    pub name: String,
    pub encoding: String,
    pub data: Arc<[u8]>,
}

/// An attachment's header, and where its record is.
#[derive(Debug, Clone)]
pub(crate) struct AttachmentRef {
    pub header: AttachmentHeader,
    /// Length of its data [bytes].
    pub data_len: u64,
    /// Offset in the file of the end of its data, where its checksum is.
    pub data_end: u64,
    pub place: Place,
}
