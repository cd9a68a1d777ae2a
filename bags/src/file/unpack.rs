//! Decompresses chunks and checks them.

use std::io::Read;

use super::records::Chunk;

/// Largest chunk that is read, packed or unpacked [bytes].
///
/// It bounds the memory that a damaged or hostile file can ask for.
pub(crate) const MAX_CHUNK_BYTES: u64 = 256 << 20;

/// Unpacks chunk after chunk with one reused context.
#[derive(Default)]
pub(crate) struct Unpacker {
    zstd: Option<zstd::bulk::Decompressor<'static>>,
}

impl Unpacker {
    /// Replaces `out` by the records of a chunk.
    ///
    /// # Errors
    /// The reason in words: size, compression, damaged data or checksum.
    pub(crate) fn unpack(&mut self, chunk: &Chunk<'_>, out: &mut Vec<u8>) -> Result<(), String> {
        let (size, packed) = (chunk.uncompressed_size, chunk.records);
        if size > MAX_CHUNK_BYTES {
            return Err(format!("chunk of {size} bytes is larger than {MAX_CHUNK_BYTES}"));
        }
        out.clear();
        match chunk.compression.as_ref() {
            "" => out.extend_from_slice(packed),
            "lz4" => {
                let mut decoder = lz4_flex::frame::FrameDecoder::new(packed).take(size + 1);
                decoder.read_to_end(out).map_err(|e| format!("lz4: {e}"))?;
            }
            "zstd" => {
                out.try_reserve_exact(size as usize).map_err(|e| format!("chunk of {size} bytes: {e}"))?;
                self.zstd()?.decompress_to_buffer(packed, out).map_err(|e| format!("zstd: {e}"))?;
            }
            other => return Err(format!("unknown compression {other:?}")),
        }
        if out.len() as u64 != size {
            return Err(format!("chunk unpacks to {} bytes, its header says {size}", out.len()));
        }
        let crc = crc32fast::hash(out);
        let saved = chunk.uncompressed_crc;
        if saved != 0 && saved != crc {
            return Err(format!("chunk checksum is {crc:08x}, its header says {saved:08x}"));
        }
        Ok(())
    }

    fn zstd(&mut self) -> Result<&mut zstd::bulk::Decompressor<'static>, String> {
        if self.zstd.is_none() {
            self.zstd = Some(zstd::bulk::Decompressor::new().map_err(|e| format!("zstd: {e}"))?);
        }
        self.zstd.as_mut().ok_or_else(|| "zstd: no context".to_owned())
    }
}
