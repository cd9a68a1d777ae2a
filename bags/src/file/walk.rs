//! Walks the records of an MCAP file by their prefixes, without reading what is passed over.
//!
//! The linear reader of the `mcap` crate reads every record whole, an attachment of gigabytes too.

use mcap::MAGIC;
use mcap::records::op;

use super::record::{self, PREFIX_LEN};
use super::source::Source;
use crate::error::Result;

/// Bytes that are read at a time; small records lie close to each other.
const WINDOW: u64 = 16 << 10;

/// A record's place in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Place {
    /// Offset of the record.
    pub offset: u64,
    /// Its opcode.
    pub opcode: u8,
    /// Length of its body.
    pub body_len: u64,
}

impl Place {
    /// Offset of the next record.
    pub(crate) fn end(self) -> u64 {
        self.body() + self.body_len
    }

    /// Offset of the body.
    pub(crate) fn body(self) -> u64 {
        self.offset + PREFIX_LEN as u64
    }
}

/// The places of a file's records, one after the other.
pub(crate) struct Walk<'a> {
    source: &'a Source,
    offset: u64,
    end: u64,
    ended: bool,
    /// Bytes read ahead, from `window_at` on.
    window: Vec<u8>,
    window_at: u64,
}

impl<'a> Walk<'a> {
    /// All records up to and including the footer.
    pub(crate) fn whole(source: &'a Source) -> Self {
        Self::between(source, MAGIC.len() as u64, source.len)
    }

    /// The records from one offset to another.
    pub(crate) fn between(source: &'a Source, offset: u64, end: u64) -> Self {
        Self { source, offset, end, ended: false, window: Vec::new(), window_at: 0 }
    }

    /// Where the walk has come to.
    pub(crate) fn offset(&self) -> u64 {
        self.offset
    }

    /// The body of a record that has just been come by.
    pub(crate) fn read_body(&self, place: Place, out: &mut Vec<u8>) -> Result<()> {
        let start = place.body().checked_sub(self.window_at).and_then(|start| usize::try_from(start).ok());
        let inside = start.and_then(|start| self.window.get(start..)?.get(..usize::try_from(place.body_len).ok()?));
        match inside {
            Some(body) => {
                out.clear();
                out.extend_from_slice(body);
                Ok(())
            }
            None => self.source.read_vec(place.body(), place.body_len, out),
        }
    }

    /// The next record's prefix; `None` when the file ends before it does.
    fn prefix(&mut self) -> Result<Option<[u8; PREFIX_LEN]>> {
        let ahead = self.offset.checked_sub(self.window_at).and_then(|at| usize::try_from(at).ok());
        if let Some(prefix) = ahead.and_then(|at| self.window.get(at..)?.first_chunk()) {
            return Ok(Some(*prefix));
        }
        let len = WINDOW.min(self.source.len.saturating_sub(self.offset));
        self.window.resize(len as usize, 0);
        self.source.read_at(self.offset, &mut self.window)?;
        self.window_at = self.offset;
        Ok(self.window.first_chunk().copied())
    }

    fn place(&mut self) -> Result<Place> {
        let left = self.source.len.saturating_sub(self.offset);
        let Some(prefix) = self.prefix()? else {
            let reason = format!("the file ends after {left} bytes of a record's start");
            return Err(self.source.corrupt(self.offset, reason));
        };
        let (opcode, body_len) = record::parse_prefix(&prefix);
        if opcode == 0 {
            return Err(self.source.corrupt(self.offset, "no record: its opcode is 0"));
        }
        let have = left - PREFIX_LEN as u64;
        if body_len > have {
            let reason = format!("record of {body_len} bytes, the file ends after {have}");
            return Err(self.source.corrupt(self.offset, reason));
        }
        Ok(Place { offset: self.offset, opcode, body_len })
    }
}

impl Iterator for Walk<'_> {
    type Item = Result<Place>;

    /// Ends after the footer, the first error, or where it was told to; a file without footer ends with an error.
    fn next(&mut self) -> Option<Self::Item> {
        if self.ended || (self.offset >= self.end && self.end < self.source.len) {
            return None;
        }
        let place = self.place();
        match &place {
            Ok(place) => {
                self.offset = place.end();
                self.ended = place.opcode == op::FOOTER;
            }
            Err(_) => self.ended = true,
        }
        Some(place)
    }
}
