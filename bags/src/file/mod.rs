//! One file of a bag: its records, its index, its chunks, and writing it. Records are the `mcap` crate's.

pub(crate) mod attachment;
pub(crate) mod chunk;
pub(crate) mod index;
pub(crate) mod parts;
pub(crate) mod record;
pub(crate) mod source;
pub(crate) mod sqlite;
mod sqlite_index;
pub(crate) mod storage;
mod summary;
pub(crate) mod unpack;
pub(crate) mod walk;
pub(crate) mod writer;
