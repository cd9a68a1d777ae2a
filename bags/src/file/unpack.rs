//! Decompresses chunks, and messages that were compressed one by one, and checks them.

use std::io::Read;

use mcap::records::ChunkHeader;

use super::source::Source;
use super::storage::Storage;
use crate::error::Result;

/// The first bytes of a Zstandard frame. No CDR begins so.
pub(crate) const ZSTD_MAGIC: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];

/// Unpacks chunk after chunk with one reused context.
#[derive(Default)]
pub(crate) struct Unpacker {
    zstd: Option<zstd::bulk::Decompressor<'static>>,
}

impl Unpacker {
    /// Replaces `out` by the records of the chunk at an offset.
    ///
    /// # Errors
    /// [`crate::BagError::TooLarge`], or [`crate::BagError::Corrupt`] for an unknown compression, damaged data or
    /// a wrong checksum.
    pub(crate) fn unpack(
        &mut self,
        source: &Source,
        offset: u64,
        header: &ChunkHeader,
        packed: &[u8],
        out: &mut Vec<u8>,
    ) -> Result<()> {
        let size = header.uncompressed_size;
        let corrupt = |reason: String| source.corrupt(offset, reason);
        if size > source.limit {
            return Err(match known_size(header, packed) {
                Some(known) if known != size => corrupt(contradiction(known, size)),
                _ => source.too_large(offset, "chunk", size),
            });
        }
        out.clear();
        match header.compression.as_str() {
            "" => out.extend_from_slice(packed),
            "lz4" => {
                let mut decoder = lz4_flex::frame::FrameDecoder::new(packed).take(size + 1);
                decoder.read_to_end(out).map_err(|e| corrupt(format!("lz4: {e}")))?;
            }
            "zstd" => self.zstd(packed, size, out).map_err(corrupt)?,
            other => return Err(corrupt(format!("unknown compression {other:?}"))),
        }
        if out.len() as u64 != size {
            return Err(corrupt(contradiction(out.len() as u64, size)));
        }
        let saved = header.uncompressed_crc;
        if saved != 0 {
            let crc = crc32fast::hash(out);
            if saved != crc {
                return Err(corrupt(format!("chunk checksum is {crc:08x}, its header says {saved:08x}")));
            }
        }
        Ok(())
    }

    /// Replaces `out` by a message that is a Zstandard frame.
    ///
    /// # Errors
    /// [`crate::BagError::TooLarge`] or [`crate::BagError::Corrupt`], naming the offset given.
    pub(crate) fn unpack_message(
        &mut self,
        storage: &Storage,
        offset: u64,
        packed: &[u8],
        out: &mut Vec<u8>,
    ) -> Result<()> {
        out.clear();
        let limit = storage.limit();
        // The frame says how long its content is, or else it is tried within the limit.
        let size = zstd::zstd_safe::get_frame_content_size(packed).ok().flatten().unwrap_or(limit);
        if size > limit {
            return Err(storage.too_large(offset, "message", size));
        }
        self.zstd(packed, size, out).map_err(|reason| storage.corrupt(offset, format!("compressed message: {reason}")))
    }

    fn zstd(&mut self, packed: &[u8], size: u64, out: &mut Vec<u8>) -> Result<(), String> {
        out.try_reserve_exact(size as usize).map_err(|e| format!("{size} bytes: {e}"))?;
        if self.zstd.is_none() {
            self.zstd = Some(zstd::bulk::Decompressor::new().map_err(|e| format!("zstd: {e}"))?);
        }
        match &mut self.zstd {
            Some(zstd) => zstd.decompress_to_buffer(packed, out).map(|_| ()).map_err(|e| format!("zstd: {e}")),
            None => Err("zstd: no context".to_owned()),
        }
    }
}

/// What a chunk unpacks to as far as its content tells it, or the most that it can be.
fn known_size(header: &ChunkHeader, packed: &[u8]) -> Option<u64> {
    let len = packed.len() as u64;
    match header.compression.as_str() {
        "" => Some(len),
        // No block of LZ4 grows by more.
        "lz4" => Some(header.uncompressed_size.min(len.saturating_mul(255))),
        _ => {
            let is_one_frame = zstd::zstd_safe::find_frame_compressed_size(packed).ok() == Some(packed.len());
            zstd::zstd_safe::get_frame_content_size(packed).ok().flatten().filter(|_| is_one_frame)
        }
    }
}

fn contradiction(known: u64, said: u64) -> String {
    format!("chunk unpacks to {known} bytes, its header says {said}")
}
