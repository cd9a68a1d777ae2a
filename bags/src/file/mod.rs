//! One MCAP file: records, chunks, writing with an index, and finding the index again.

pub(crate) mod chunk;
pub(crate) mod index;
pub(crate) mod record;
pub(crate) mod records;
pub(crate) mod scan;
pub(crate) mod unpack;
pub(crate) mod writer;
