//! TensorBoard event files: scalars as protocol buffers in length-prefixed, checksummed records.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use crate::error::{Result, TrainingError};

/// Writes one event file.
pub struct EventWriter {
    file: BufWriter<File>,
}

impl EventWriter {
    /// Begins a new event file in a folder; files of earlier parts of a run stay beside it.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn create(folder: &Path) -> Result<Self> {
        let seconds = wall_time();
        let name = format!("events.out.tfevents.{:020.6}.swath-train", seconds);
        let path = folder.join(name);
        let file = File::create(&path).map_err(TrainingError::file("write", &path))?;
        let mut writer = Self { file: BufWriter::new(file) };
        let mut event = Message::default();
        event.double(1, seconds);
        event.bytes(3, b"brain.Event:2");
        writer.record(&event.0, folder)?;
        Ok(writer)
    }

    /// Writes scalars of one step, and flushes them; those that are not finite are left out.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn scalars(&mut self, step: u64, scalars: &[(&str, f64)], folder: &Path) -> Result<()> {
        let mut summary = Message::default();
        for (tag, value) in scalars.iter().filter(|(_, value)| value.is_finite()) {
            let mut scalar = Message::default();
            scalar.bytes(1, tag.as_bytes());
            scalar.float(2, *value as f32);
            summary.bytes(1, &scalar.0);
        }
        let mut event = Message::default();
        event.double(1, wall_time());
        event.integer(2, step);
        event.bytes(5, &summary.0);
        self.record(&event.0, folder)?;
        self.file.flush().map_err(TrainingError::file("write", folder))
    }

    fn record(&mut self, data: &[u8], folder: &Path) -> Result<()> {
        let record = framed(data);
        let written = self.file.write_all(&record);
        written.map_err(TrainingError::file("write", folder))
    }
}

/// A record: length, its checksum, data, its checksum.
fn framed(data: &[u8]) -> Vec<u8> {
    let length = (data.len() as u64).to_le_bytes();
    let mut record = length.to_vec();
    record.extend(masked_crc(&length).to_le_bytes());
    record.extend(data);
    record.extend(masked_crc(data).to_le_bytes());
    record
}

/// The CRC-32C that the format asks for, rotated and offset.
fn masked_crc(data: &[u8]) -> u32 {
    crc32c::crc32c(data).rotate_right(15).wrapping_add(0xa282_ead8)
}

fn wall_time() -> f64 {
    let elapsed = SystemTime::now().duration_since(UNIX_EPOCH);
    elapsed.map_or(0.0, |elapsed| elapsed.as_secs_f64())
}

/// A protocol buffer message under construction.
#[derive(Default)]
struct Message(Vec<u8>);

impl Message {
    fn key(&mut self, field: u8, wire: u8) {
        self.0.push(field << 3 | wire);
    }

    fn varint(&mut self, mut value: u64) {
        while value >= 0x80 {
            self.0.push(value as u8 | 0x80);
            value >>= 7;
        }
        self.0.push(value as u8);
    }

    fn integer(&mut self, field: u8, value: u64) {
        self.key(field, 0);
        self.varint(value);
    }

    fn double(&mut self, field: u8, value: f64) {
        self.key(field, 1);
        self.0.extend(value.to_le_bytes());
    }

    fn bytes(&mut self, field: u8, value: &[u8]) {
        self.key(field, 2);
        self.varint(value.len() as u64);
        self.0.extend(value);
    }

    fn float(&mut self, field: u8, value: f32) {
        self.key(field, 5);
        self.0.extend(value.to_le_bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checksum_is_the_published_one() {
        // CRC-32C of "123456789" is e3069283; of 32 zeros 8a9136aa (RFC 3720, B.4).
        assert_eq!(crc32c::crc32c(b"123456789"), 0xe306_9283);
        let unmasked = masked_crc(&[0; 32]).wrapping_sub(0xa282_ead8);
        assert_eq!(unmasked.rotate_left(15), 0x8a91_36aa);
    }

    #[test]
    fn a_message_has_the_bytes_of_the_encoding_guide() {
        let mut message = Message::default();
        message.integer(1, 150);
        message.bytes(2, b"testing");
        assert_eq!(message.0, b"\x08\x96\x01\x12\x07testing");
    }
}
