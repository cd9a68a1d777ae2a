//! Chunks: messages gathered in memory with their index, and their compressed form.

use std::io::Write;
use std::str::FromStr;
use std::time::Instant;

use mcap::records::{MessageHeader, op};

use super::record;
use crate::error::BagError;

/// How chunks are compressed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Compression {
    /// Not at all.
    None,
    /// LZ4 frames.
    Lz4,
    /// Zstandard.
    #[default]
    Zstd,
}

impl Compression {
    /// The name in MCAP's chunk records.
    #[must_use]
    pub fn mcap_name(self) -> &'static str {
        match self {
            Self::None => "",
            Self::Lz4 => "lz4",
            Self::Zstd => "zstd",
        }
    }
}

impl FromStr for Compression {
    type Err = BagError;

    fn from_str(text: &str) -> Result<Self, BagError> {
        match text {
            "none" => Ok(Self::None),
            "lz4" => Ok(Self::Lz4),
            "zstd" => Ok(Self::Zstd),
            other => {
                Err(BagError::Option { option: "--compression", reason: format!("{other} is none of zstd, lz4, none") })
            }
        }
    }
}

/// Messages on their way into a file.
#[derive(Debug, Default)]
pub(crate) struct Chunk {
    /// Message records, one after the other.
    pub data: Vec<u8>,
    /// By channel id: log time [ns] and offset in `data` of each message.
    pub index: Vec<Vec<(u64, u64)>>,
    /// Messages in all.
    pub messages: u64,
    /// Earliest log time [ns].
    pub start: u64,
    /// Latest log time [ns].
    pub end: u64,
    /// When the first message came.
    pub opened: Option<Instant>,
}

impl Chunk {
    pub(crate) fn is_empty(&self) -> bool {
        self.messages == 0
    }

    /// Adds one message.
    pub(crate) fn push(&mut self, header: &MessageHeader, payload: &[&[u8]]) {
        if self.is_empty() {
            self.opened = Some(Instant::now());
            (self.start, self.end) = (header.log_time, header.log_time);
        }
        self.start = self.start.min(header.log_time);
        self.end = self.end.max(header.log_time);
        self.messages += 1;
        let channel = usize::from(header.channel_id);
        if self.index.len() <= channel {
            self.index.resize_with(channel + 1, Vec::new);
        }
        self.index[channel].push((header.log_time, self.data.len() as u64));
        self.append(header, payload);
    }

    fn append(&mut self, header: &MessageHeader, payload: &[&[u8]]) {
        let mut prefix = [0; record::PREFIX_LEN + record::MESSAGE_HEADER_LEN];
        let payload_len: usize = payload.iter().map(|part| part.len()).sum();
        let body_len = (record::MESSAGE_HEADER_LEN + payload_len) as u64;
        prefix[0] = op::MESSAGE;
        prefix[1..9].copy_from_slice(&body_len.to_le_bytes());
        prefix[9..11].copy_from_slice(&header.channel_id.to_le_bytes());
        prefix[11..15].copy_from_slice(&header.sequence.to_le_bytes());
        prefix[15..23].copy_from_slice(&header.log_time.to_le_bytes());
        prefix[23..31].copy_from_slice(&header.publish_time.to_le_bytes());
        self.data.extend_from_slice(&prefix);
        payload.iter().for_each(|part| self.data.extend_from_slice(part));
    }

    /// Empties the chunk and keeps its memory.
    pub(crate) fn clear(&mut self) {
        self.data.clear();
        self.index.iter_mut().for_each(Vec::clear);
        self.messages = 0;
        self.opened = None;
    }

    /// Messages of each channel that has any: `(channel, count)`.
    pub(crate) fn counts(&self) -> impl Iterator<Item = (u16, u64)> + '_ {
        let filled = self.index.iter().enumerate().filter(|(_, entries)| !entries.is_empty());
        filled.map(|(channel, entries)| (channel as u16, entries.len() as u64))
    }
}

/// Compresses chunk after chunk into one reused buffer.
pub(crate) struct Compressor {
    kind: Compression,
    zstd: Option<zstd::bulk::Compressor<'static>>,
    buffer: Vec<u8>,
}

impl Compressor {
    /// `level` is zstd's, and is ignored by the others.
    pub(crate) fn new(kind: Compression, level: i32) -> std::io::Result<Self> {
        let zstd = match kind {
            Compression::Zstd => Some(zstd::bulk::Compressor::new(level)?),
            Compression::None | Compression::Lz4 => None,
        };
        Ok(Self { kind, zstd, buffer: Vec::new() })
    }

    pub(crate) fn kind(&self) -> Compression {
        self.kind
    }

    /// The compressed form of `data`; `data` itself for [`Compression::None`].
    pub(crate) fn compress<'a>(&'a mut self, data: &'a [u8]) -> std::io::Result<&'a [u8]> {
        self.buffer.clear();
        match (self.kind, &mut self.zstd) {
            (Compression::Zstd, Some(zstd)) => {
                self.buffer.reserve(zstd::zstd_safe::compress_bound(data.len()));
                zstd.compress_to_buffer(data, &mut self.buffer)?;
                Ok(&self.buffer)
            }
            (Compression::Lz4, _) => {
                let mut encoder = lz4_flex::frame::FrameEncoder::new(&mut self.buffer);
                encoder.write_all(data)?;
                encoder.finish().map_err(std::io::Error::other)?;
                Ok(&self.buffer)
            }
            (Compression::Zstd | Compression::None, _) => Ok(data),
        }
    }
}
