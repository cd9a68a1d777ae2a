//! Walks the records of an MCAP file from its start, without its index.

use std::{
    fs::File,
    os::unix::fs::FileExt,
    path::{Path, PathBuf},
};

use super::{
    record::{self, PREFIX_LEN},
    records::{MAGIC, op},
    unpack::MAX_CHUNK_BYTES,
};
use crate::error::{BagError, Result};

/// An MCAP file opened for reading.
#[derive(Debug)]
pub(crate) struct Source {
    pub path: PathBuf,
    pub len: u64,
    file: File,
}

impl Source {
    /// Opens a file and checks its magic.
    pub(crate) fn open(path: &Path) -> Result<Self> {
        let file = File::open(path).map_err(BagError::io("open", path))?;
        let len = file.metadata().map_err(BagError::io("read", path))?.len();
        let source = Self { path: path.to_owned(), len, file };
        let mut magic = [0; MAGIC.len()];
        if len >= magic.len() as u64 {
            source.read_at(0, &mut magic)?;
        }
        if magic != *MAGIC {
            return Err(source.corrupt(0, "no MCAP file: it does not start with MCAP's magic"));
        }
        Ok(source)
    }

    /// Fills `out` from an offset.
    pub(crate) fn read_at(&self, offset: u64, out: &mut [u8]) -> Result<()> {
        let end = offset.checked_add(out.len() as u64);
        if end.is_none_or(|end| end > self.len) {
            let reason = format!("{} bytes wanted, the file ends at {}", out.len(), self.len);
            return Err(self.corrupt(offset, reason));
        }
        self.file.read_exact_at(out, offset).map_err(BagError::io("read", &self.path))
    }

    /// Replaces `out` by `len` bytes from an offset.
    pub(crate) fn read_vec(&self, offset: u64, len: u64, out: &mut Vec<u8>) -> Result<()> {
        if offset.checked_add(len).is_none_or(|end| end > self.len) || len > MAX_CHUNK_BYTES + 1024 {
            let reason = format!("{len} bytes wanted, the file ends at {}", self.len);
            return Err(self.corrupt(offset, reason));
        }
        out.resize(len as usize, 0);
        self.read_at(offset, out)
    }

    /// Adds the bytes from `start` to `end` to a checksum.
    pub(crate) fn update_crc(&self, start: u64, end: u64, crc: &mut crc32fast::Hasher) -> Result<()> {
        let mut piece = Vec::new();
        let mut offset = start;
        while offset < end {
            let len = (end - offset).min(1 << 20);
            self.read_vec(offset, len, &mut piece)?;
            crc.update(&piece);
            offset += len;
        }
        Ok(())
    }

    /// An error at an offset of this file.
    pub(crate) fn corrupt(&self, offset: u64, reason: impl Into<String>) -> BagError {
        BagError::Corrupt { path: self.path.clone(), offset, reason: reason.into() }
    }
}

/// A record's place in a file.
#[derive(Debug, Clone, Copy)]
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
        self.offset + PREFIX_LEN as u64 + self.body_len
    }

    /// Reads the body.
    pub(crate) fn read_body(self, source: &Source, out: &mut Vec<u8>) -> Result<()> {
        source.read_vec(self.offset + PREFIX_LEN as u64, self.body_len, out)
    }
}

/// The places of a file's records up to and including its footer.
pub(crate) struct Places<'a> {
    source: &'a Source,
    offset: u64,
    ended: bool,
}

impl<'a> Places<'a> {
    /// Starts behind the magic.
    pub(crate) fn new(source: &'a Source) -> Self {
        Self { source, offset: MAGIC.len() as u64, ended: false }
    }

    fn place(&self) -> Result<Place> {
        let left = self.source.len - self.offset;
        if left < PREFIX_LEN as u64 {
            let reason = format!("the file ends after {left} bytes of a record's start");
            return Err(self.source.corrupt(self.offset, reason));
        }
        let mut prefix = [0; PREFIX_LEN];
        self.source.read_at(self.offset, &mut prefix)?;
        let (opcode, body_len) = record::parse_prefix(&prefix);
        if opcode == 0 {
            return Err(self.source.corrupt(self.offset, "no record: its opcode is 0"));
        }
        if body_len > left - PREFIX_LEN as u64 {
            let have = left - PREFIX_LEN as u64;
            let reason = format!("record of {body_len} bytes, the file ends after {have}");
            return Err(self.source.corrupt(self.offset, reason));
        }
        Ok(Place { offset: self.offset, opcode, body_len })
    }
}

impl Iterator for Places<'_> {
    type Item = Result<Place>;

    /// Ends after the footer or the first error; a file without footer ends with an error.
    fn next(&mut self) -> Option<Self::Item> {
        if self.ended {
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
