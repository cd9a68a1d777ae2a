//! A file opened for reading: its bytes within checked bounds, and errors that name the offset.

use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::{fmt, io};

use crate::error::{BagError, Result};

/// Largest record, and largest chunk once unpacked, that is read unless the caller raises it [bytes].
///
/// It bounds the memory that a damaged or hostile file can ask for.
pub const MAX_RECORD_BYTES: u64 = 256 << 20;

/// Extensions of files that are compressed as a whole.
const PACKED: [&str; 2] = ["zstd", "zst"];

/// How files are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReadOptions {
    /// Largest record, and largest chunk once unpacked, that is read into memory [bytes]; at most 4 GiB count.
    pub max_record_bytes: u64,
}

impl Default for ReadOptions {
    fn default() -> Self {
        Self { max_record_bytes: MAX_RECORD_BYTES }
    }
}

impl ReadOptions {
    /// The limit within what places in a chunk are counted by.
    pub(crate) fn limit(self) -> u64 {
        self.max_record_bytes.min(u64::from(u32::MAX))
    }
}

/// An opened file.
pub(crate) struct Source {
    pub path: PathBuf,
    /// Length [bytes].
    pub len: u64,
    /// Largest record that is read [bytes].
    pub limit: u64,
    data: Data,
}

enum Data {
    File(File),
    Memory(Arc<[u8]>),
}

impl fmt::Debug for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({} bytes)", self.path.display(), self.len)
    }
}

impl Source {
    /// Opens a file; one that is compressed as a whole is unpacked into a temporary file first.
    ///
    /// With `faults`, what can be unpacked of a damaged one is taken, and the damage told there.
    pub(crate) fn open(path: &Path, options: ReadOptions, faults: Option<&mut Vec<String>>) -> Result<Self> {
        let file = if is_packed(path) {
            let mut to = tempfile::tempfile().map_err(BagError::io("make a temporary file to unpack", path))?;
            unpack_into(path, &mut to, faults)?;
            to
        } else {
            File::open(path).map_err(BagError::io("open", path))?
        };
        let len = file.metadata().map_err(BagError::io("read", path))?.len();
        Ok(Self { path: path.to_owned(), len, limit: options.limit(), data: Data::File(file) })
    }

    /// Bytes in memory, under a name for errors.
    pub(crate) fn in_memory(name: &Path, bytes: Arc<[u8]>, options: ReadOptions) -> Self {
        let len = bytes.len() as u64;
        Self { path: name.to_owned(), len, limit: options.limit(), data: Data::Memory(bytes) }
    }

    /// Fills `out` from an offset.
    pub(crate) fn read_at(&self, offset: u64, out: &mut [u8]) -> Result<()> {
        let end = offset.checked_add(out.len() as u64).filter(|end| *end <= self.len);
        let Some(end) = end else {
            let reason = format!("{} bytes wanted, the file ends at {}", out.len(), self.len);
            return Err(self.corrupt(offset, reason));
        };
        match &self.data {
            Data::File(file) => file.read_exact_at(out, offset).map_err(BagError::io("read", &self.path)),
            Data::Memory(bytes) => {
                out.copy_from_slice(&bytes[offset as usize..end as usize]);
                Ok(())
            }
        }
    }

    /// Replaces `out` by `len` bytes from an offset.
    pub(crate) fn read_vec(&self, offset: u64, len: u64, out: &mut Vec<u8>) -> Result<()> {
        if offset.checked_add(len).is_none_or(|end| end > self.len) {
            let reason = format!("{len} bytes wanted, the file ends at {}", self.len);
            return Err(self.corrupt(offset, reason));
        }
        // A chunk's record has its header beside what counts.
        if len > self.limit.saturating_add(1024) {
            return Err(self.too_large(offset, "record", len));
        }
        out.resize(len as usize, 0);
        self.read_at(offset, out)
    }

    /// Hands the bytes from `start` to `end` to `each`, a piece at a time.
    pub(crate) fn for_each_piece<E: From<BagError>>(
        &self,
        start: u64,
        end: u64,
        mut each: impl FnMut(&[u8]) -> Result<(), E>,
    ) -> Result<(), E> {
        let mut piece = Vec::new();
        let mut offset = start;
        while offset < end {
            piece.resize((end - offset).min(1 << 20) as usize, 0);
            self.read_at(offset, &mut piece)?;
            each(&piece)?;
            offset += piece.len() as u64;
        }
        Ok(())
    }

    /// An error at an offset of this file.
    pub(crate) fn corrupt(&self, offset: u64, reason: impl Into<String>) -> BagError {
        BagError::Corrupt { path: self.path.clone(), offset, reason: reason.into() }
    }

    /// The error of something larger than what is read.
    pub(crate) fn too_large(&self, offset: u64, what: &'static str, bytes: u64) -> BagError {
        BagError::TooLarge { path: self.path.clone(), offset, what, bytes, limit: self.limit }
    }
}

/// Whether a file is compressed as a whole, by its name.
pub(crate) fn is_packed(path: &Path) -> bool {
    path.extension().is_some_and(|extension| PACKED.iter().any(|packed| extension == *packed))
}

/// The name of a file without the ending that says it is compressed as a whole.
pub(crate) fn unpacked_name(path: &Path) -> PathBuf {
    if is_packed(path) { path.with_extension("") } else { path.to_owned() }
}

/// Unpacks a file into another.
pub(crate) fn unpack_into(path: &Path, to: &mut File, faults: Option<&mut Vec<String>>) -> Result<()> {
    let from = File::open(path).map_err(BagError::io("open", path))?;
    let mut decoder = zstd::stream::read::Decoder::new(from).map_err(BagError::io("unpack", path))?;
    let Err(error) = io::copy(&mut decoder, to) else { return Ok(()) };
    if BagError::is_disk_full(&error) {
        return Err(BagError::io("unpack", path)(error));
    }
    let len = to.metadata().map_err(BagError::io("unpack", path))?.len();
    let reason = format!("after {len} unpacked bytes: {error}");
    let damage = BagError::Corrupt { path: path.to_owned(), offset: 0, reason };
    match faults {
        Some(faults) => {
            faults.push(damage.to_string());
            Ok(())
        }
        None => Err(damage),
    }
}
