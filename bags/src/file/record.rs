//! MCAP records as bytes: an opcode, a length, and a body that the `mcap` crate reads and writes.

use std::io::Cursor;

use binrw::{BinRead, BinWrite};
use mcap::records::{AttachmentHeader, MessageHeader, Record, op};
use mcap::{McapError, parse_record};

/// Opcode and length.
pub(crate) const PREFIX_LEN: usize = 9;
/// Channel, sequence and two times of a message record's body.
pub(crate) const MESSAGE_HEADER_LEN: usize = 22;

/// Appends a record.
pub(crate) fn put<T: for<'a> BinWrite<Args<'a> = ()>>(out: &mut Vec<u8>, opcode: u8, fields: &T) {
    put_with(out, opcode, |out| put_fields(out, fields));
}

/// Appends a record whose body is written by `body`.
pub(crate) fn put_with(out: &mut Vec<u8>, opcode: u8, body: impl FnOnce(&mut Vec<u8>)) {
    let start = out.len();
    out.push(opcode);
    out.extend_from_slice(&[0; 8]);
    body(out);
    let len = (out.len() - start - PREFIX_LEN) as u64;
    out[start + 1..start + PREFIX_LEN].copy_from_slice(&len.to_le_bytes());
}

/// Appends a record's fields as the `mcap` crate writes them.
pub(crate) fn put_fields<T: for<'a> BinWrite<Args<'a> = ()>>(out: &mut Vec<u8>, fields: &T) {
    let mut cursor = Cursor::new(out);
    cursor.set_position(cursor.get_ref().len() as u64);
    // Memory takes everything, and no field of a record refuses to be written.
    let written = fields.write_le_args(&mut cursor, ());
    debug_assert!(written.is_ok(), "{written:?}");
}

/// Parses a record's body.
///
/// # Errors
/// What is wrong with it, in words.
pub(crate) fn parse(opcode: u8, body: &[u8]) -> Result<Record<'_>, String> {
    check_lengths(opcode, body).map_err(|reason| format!("{} record: {reason}", name(opcode)))?;
    parse_record(opcode, body).map_err(|error| match error {
        McapError::Parse(error) => match error.root_cause() {
            cause if cause.is_eof() => format!("{} record ends after {} bytes", name(opcode), body.len()),
            cause => format!("{} record: {cause}", name(opcode)),
        },
        error => format!("{} record: {error}", name(opcode)),
    })
}

/// A message record's header and data; field by field, because the parser's general way costs a third of the time in
/// which a bag is read.
#[inline]
pub(crate) fn message(body: &[u8]) -> Result<(MessageHeader, &[u8]), String> {
    fn fields(body: &[u8]) -> Option<(MessageHeader, &[u8])> {
        let (channel_id, rest) = body.split_first_chunk()?;
        let (sequence, rest) = rest.split_first_chunk()?;
        let (log_time, rest) = rest.split_first_chunk()?;
        let (publish_time, data) = rest.split_first_chunk()?;
        let header = MessageHeader {
            channel_id: u16::from_le_bytes(*channel_id),
            sequence: u32::from_le_bytes(*sequence),
            log_time: u64::from_le_bytes(*log_time),
            publish_time: u64::from_le_bytes(*publish_time),
        };
        Some((header, data))
    }
    fields(body).ok_or_else(|| format!("message record of {} bytes", body.len()))
}

/// An attachment's header and the length of its data, and how many bytes of the body they take; `start` need not be
/// the whole body.
pub(crate) fn attachment_header(start: &[u8]) -> Result<(AttachmentHeader, u64, u64), String> {
    let refused = |reason: String| format!("attachment record: {reason}");
    check_lengths(op::ATTACHMENT, start).map_err(refused)?;
    let mut cursor = Cursor::new(start);
    let parsed = AttachmentHeader::read_le(&mut cursor).and_then(|header| Ok((header, u64::read_le(&mut cursor)?)));
    let (header, data_len) = parsed.map_err(|error| refused(error.root_cause().to_string()))?;
    Ok((header, data_len, cursor.position()))
}

/// The error of a record that turned out to be another.
pub(crate) fn misplaced(wanted: u8, found: &Record<'_>) -> String {
    format!("{} record where a {} record should be", name(found.opcode()), name(wanted))
}

/// Part of a record's body, as far as it says how long others are.
enum Part {
    /// So many bytes.
    Bytes(usize),
    /// A text behind its length.
    Text,
    /// Texts behind their length in all.
    Texts,
    /// Anything behind its length.
    Map,
}

/// Checks that what a record holds lies inside of it.
///
/// The parser reserves memory for as many bytes as a length says, up to 4 GiB, before it looks whether
/// they are there, and slices an attachment without looking.
fn check_lengths(opcode: u8, body: &[u8]) -> Result<(), String> {
    use Part::{Bytes, Map, Text, Texts};
    let parts: &[Part] = match opcode {
        op::HEADER => &[Text, Text],
        op::SCHEMA => &[Bytes(2), Text, Text],
        op::CHANNEL => &[Bytes(4), Text, Text, Texts],
        op::CHUNK => &[Bytes(28), Text],
        op::CHUNK_INDEX => &[Bytes(32), Map, Bytes(8), Text],
        op::ATTACHMENT => &[Bytes(16), Text, Text, Bytes(12)],
        op::ATTACHMENT_INDEX => &[Bytes(40), Text, Text],
        op::METADATA => &[Text, Texts],
        op::METADATA_INDEX => &[Bytes(16), Text],
        _ => &[],
    };
    let mut rest = body;
    for part in parts {
        match part {
            Bytes(len) => take(&mut rest, *len).map(|_| ())?,
            Text | Map => take_sized(&mut rest).map(|_| ())?,
            Texts => {
                let mut texts = take_sized(&mut rest)?;
                while !texts.is_empty() {
                    take_sized(&mut texts)?;
                }
            }
        }
    }
    Ok(())
}

fn take<'a>(rest: &mut &'a [u8], len: usize) -> Result<&'a [u8], String> {
    let (taken, behind) =
        rest.split_at_checked(len).ok_or_else(|| format!("{len} bytes expected, {} left", rest.len()))?;
    *rest = behind;
    Ok(taken)
}

fn take_sized<'a>(rest: &mut &'a [u8]) -> Result<&'a [u8], String> {
    let len = take(rest, 4)?.iter().rev().fold(0, |len, byte| len << 8 | usize::from(*byte));
    take(rest, len)
}

/// What the specification calls a record.
fn name(opcode: u8) -> &'static str {
    match opcode {
        op::HEADER => "header",
        op::FOOTER => "footer",
        op::SCHEMA => "schema",
        op::CHANNEL => "channel",
        op::MESSAGE => "message",
        op::CHUNK => "chunk",
        op::MESSAGE_INDEX => "message index",
        op::CHUNK_INDEX => "chunk index",
        op::ATTACHMENT => "attachment",
        op::ATTACHMENT_INDEX => "attachment index",
        op::STATISTICS => "statistics",
        op::METADATA => "metadata",
        op::METADATA_INDEX => "metadata index",
        op::SUMMARY_OFFSET => "summary offset",
        op::DATA_END => "data end",
        _ => "unknown",
    }
}

/// A record's prefix: opcode and body length.
pub(crate) fn parse_prefix(prefix: &[u8; PREFIX_LEN]) -> (u8, u64) {
    let [opcode, length @ ..] = *prefix;
    (opcode, u64::from_le_bytes(length))
}

/// The records in a slice: `(offset, opcode, body)` each, ending at the first fault.
///
/// The readers of the `mcap` crate copy each record, and do not say where it lay.
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
        put_with(&mut data, 0x81, |out| out.extend_from_slice(b"abc"));
        put_with(&mut data, 0x82, |_| ());
        let whole = data.len();
        data.extend_from_slice(&[0x83, 200, 0, 0, 0, 0, 0, 0, 0, 1]);
        let found: Vec<_> = Records::new(&data).collect();
        assert_eq!(found[0], Ok((0, 0x81, &b"abc"[..])));
        assert_eq!(found[1], Ok((12, 0x82, &b""[..])));
        assert!(matches!(&found[2], Err((at, _)) if *at == whole));
        assert_eq!(found.len(), 3);
    }

    #[test]
    fn bytes_are_the_specification_s() {
        let channel = mcap::records::Channel {
            id: 1,
            schema_id: 2,
            topic: "/t".into(),
            message_encoding: "cdr".into(),
            metadata: [("k".to_owned(), "v".to_owned())].into(),
        };
        let mut record = Vec::new();
        put(&mut record, op::CHANNEL, &channel);
        let expected = b"\x04\x1f\0\0\0\0\0\0\0\x01\0\x02\0\x02\0\0\0/t\x03\0\0\0cdr\x0a\0\0\0\x01\0\0\0k\x01\0\0\0v";
        assert_eq!(record, expected);
        let body = &record[PREFIX_LEN..];
        assert!(matches!(parse(op::CHANNEL, body), Ok(Record::Channel(found)) if found == channel));
        for len in 0..body.len() {
            assert!(parse(op::CHANNEL, &body[..len]).is_err(), "cut to {len}");
        }
        let mut index = Vec::new();
        put_fields(&mut index, &mcap::records::MetadataIndex { offset: 3, length: 4, name: "n".into() });
        assert_eq!(index, b"\x03\0\0\0\0\0\0\0\x04\0\0\0\0\0\0\0\x01\0\0\0n");
        let schema = b"\x01\0\x01\0\0\0a\x01\0\0\0e\x02\0\0\0xy";
        let Ok(Record::Schema { header, data }) = parse(op::SCHEMA, schema) else { panic!("no schema") };
        assert_eq!((header.id, &header.name[..], &header.encoding[..], &data[..]), (1, "a", "e", &b"xy"[..]));
        assert!(parse(op::CHUNK, &[0xff; 60]).is_err());
    }

    #[test]
    fn lengths_beyond_the_record_are_errors_that_say_so() {
        let reason = |opcode, body: &[u8]| parse(opcode, body).unwrap_err();
        assert_eq!(reason(op::HEADER, b"\xff\xff\xff\xffx"), "header record: 4294967295 bytes expected, 1 left");
        assert_eq!(reason(op::STATISTICS, &[0; 9]), "statistics record ends after 9 bytes");
        for opcode in 1..=0x10 {
            for len in 0..80 {
                // All lengths are at their greatest, or none is there at all.
                let _ = parse(opcode, &[0xff; 80][..len]);
                let _ = parse(opcode, &[0; 80][..len]);
            }
        }
    }
}
