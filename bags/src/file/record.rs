//! MCAP records as bytes: an opcode, a length, a body.

use std::{borrow::Cow, io::Cursor};

use binrw::BinWrite;
use mcap::records::{self, Record};

use crate::error::chain;

/// Opcode and length.
pub(crate) const PREFIX_LEN: usize = 9;
/// Footer record and end magic.
pub(crate) const FOOTER_LEN: u64 = (PREFIX_LEN + 20 + mcap::MAGIC.len()) as u64;
/// Channel, sequence and two times of a message record's body.
pub(crate) const MESSAGE_HEADER_LEN: usize = 22;

/// Appends a record whose body is written by `body`.
pub(crate) fn put(out: &mut Vec<u8>, opcode: u8, body: impl FnOnce(&mut Vec<u8>)) {
    let start = out.len();
    out.push(opcode);
    out.extend_from_slice(&[0; 8]);
    body(out);
    let len = (out.len() - start - PREFIX_LEN) as u64;
    out[start + 1..start + PREFIX_LEN].copy_from_slice(&len.to_le_bytes());
}

/// Appends a record made from one of `mcap`'s structs.
pub(crate) fn put_struct<T>(out: &mut Vec<u8>, opcode: u8, value: &T)
where
    T: for<'a> BinWrite<Args<'a> = ()>,
{
    put(out, opcode, |out| out.extend_from_slice(&to_bytes(value)));
}

/// The little-endian bytes of one of `mcap`'s structs.
fn to_bytes<T>(value: &T) -> Vec<u8>
where
    T: for<'a> BinWrite<Args<'a> = ()>,
{
    let mut body = Cursor::new(Vec::new());
    match value.write_le(&mut body) {
        Ok(()) => body.into_inner(),
        // A `Vec` takes every byte, and these structs have no failing conversions.
        Err(error) => unreachable!("serialising into memory failed: {error}"),
    }
}

/// Appends a length-prefixed string.
pub(crate) fn put_string(out: &mut Vec<u8>, text: &str) {
    out.extend_from_slice(&(text.len() as u32).to_le_bytes());
    out.extend_from_slice(text.as_bytes());
}

/// Appends a schema record.
pub(crate) fn put_schema(out: &mut Vec<u8>, id: u16, name: &str, encoding: &str, data: &[u8]) {
    put(out, records::op::SCHEMA, |out| {
        out.extend_from_slice(&id.to_le_bytes());
        put_string(out, name);
        put_string(out, encoding);
        out.extend_from_slice(&(data.len() as u32).to_le_bytes());
        out.extend_from_slice(data);
    });
}

/// Parses a record's body.
///
/// # Errors
/// The reason in words; attachments are not parsed, they come back as unknown records.
pub(crate) fn parse(opcode: u8, body: &[u8]) -> Result<Record<'_>, String> {
    if opcode == records::op::ATTACHMENT {
        return Ok(Record::Unknown { opcode, data: Cow::Borrowed(body) });
    }
    mcap::parse_record(opcode, body).map_err(|e| format!("record with opcode {opcode:#04x}: {}", chain(&e)))
}

/// A record's prefix: opcode and body length.
pub(crate) fn parse_prefix(prefix: &[u8; PREFIX_LEN]) -> (u8, u64) {
    let [opcode, length @ ..] = *prefix;
    (opcode, u64::from_le_bytes(length))
}

/// The records in a slice: `(offset, opcode, body)` each, ending at the first fault.
pub(crate) struct Records<'a> {
    data: &'a [u8],
    offset: usize,
}

impl<'a> Records<'a> {
    pub(crate) fn new(data: &'a [u8]) -> Self {
        Self { data, offset: 0 }
    }
}

impl<'a> Iterator for Records<'a> {
    type Item = Result<(usize, u8, &'a [u8]), (usize, String)>;

    fn next(&mut self) -> Option<Self::Item> {
        let start = self.offset;
        let rest = &self.data[start..];
        if rest.is_empty() {
            return None;
        }
        let Some((prefix, body)) = rest.split_first_chunk::<PREFIX_LEN>() else {
            self.offset = self.data.len();
            return Some(Err((start, format!("{} bytes left where a record starts", rest.len()))));
        };
        let (opcode, len) = parse_prefix(prefix);
        match usize::try_from(len).ok().and_then(|len| body.get(..len)) {
            Some(body) => {
                self.offset = start + PREFIX_LEN + body.len();
                Some(Ok((start, opcode, body)))
            }
            None => {
                self.offset = self.data.len();
                let reason = format!("record of {len} bytes where {} are left", body.len());
                Some(Err((start, reason)))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_end_at_the_first_fault() {
        let mut data = Vec::new();
        put(&mut data, 0x81, |out| out.extend_from_slice(b"abc"));
        put(&mut data, 0x82, |_| ());
        let whole = data.len();
        data.extend_from_slice(&[0x83, 200, 0, 0, 0, 0, 0, 0, 0, 1]);
        let found: Vec<_> = Records::new(&data).collect();
        assert_eq!(found[0], Ok((0, 0x81, &b"abc"[..])));
        assert_eq!(found[1], Ok((12, 0x82, &b""[..])));
        assert!(matches!(&found[2], Err((at, _)) if *at == whole));
        assert_eq!(found.len(), 3);
    }
}
