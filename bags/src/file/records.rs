//! The records of MCAP that bags use: their fields as bytes, both ways.

use std::{borrow::Cow, collections::BTreeMap};

/// First and last bytes of an MCAP file.
pub(crate) const MAGIC: &[u8] = b"\x89MCAP0\r\n";

/// Opcodes, as MCAP's specification numbers them.
pub(crate) mod op {
    pub(crate) const HEADER: u8 = 0x01;
    pub(crate) const FOOTER: u8 = 0x02;
    pub(crate) const SCHEMA: u8 = 0x03;
    pub(crate) const CHANNEL: u8 = 0x04;
    pub(crate) const MESSAGE: u8 = 0x05;
    pub(crate) const CHUNK: u8 = 0x06;
    pub(crate) const MESSAGE_INDEX: u8 = 0x07;
    pub(crate) const CHUNK_INDEX: u8 = 0x08;
    pub(crate) const ATTACHMENT: u8 = 0x09;
    pub(crate) const STATISTICS: u8 = 0x0b;
    pub(crate) const METADATA: u8 = 0x0c;
    pub(crate) const METADATA_INDEX: u8 = 0x0d;
    pub(crate) const SUMMARY_OFFSET: u8 = 0x0e;
    pub(crate) const DATA_END: u8 = 0x0f;
}

/// A value with a place in a record: little-endian, texts and maps behind their length in bytes.
trait Value: Sized {
    fn put(&self, out: &mut Vec<u8>);
    fn take(fields: &mut Fields<'_>) -> Result<Self, String>;
}

/// A record's body while it is parsed.
struct Fields<'a> {
    rest: &'a [u8],
}

impl<'a> Fields<'a> {
    fn bytes(&mut self, len: usize) -> Result<&'a [u8], String> {
        let Some((taken, rest)) = self.rest.split_at_checked(len) else {
            return Err(format!("{len} bytes expected, {} left", self.rest.len()));
        };
        self.rest = rest;
        Ok(taken)
    }

    /// Bytes behind their length.
    fn sized(&mut self) -> Result<&'a [u8], String> {
        let len = u32::take(self)?;
        self.bytes(len as usize)
    }
}

macro_rules! integer {
    ($($kind:ty),*) => {$(
        impl Value for $kind {
            fn put(&self, out: &mut Vec<u8>) {
                out.extend_from_slice(&self.to_le_bytes());
            }

            fn take(fields: &mut Fields<'_>) -> Result<Self, String> {
                let mut bytes = [0; size_of::<Self>()];
                bytes.copy_from_slice(fields.bytes(size_of::<Self>())?);
                Ok(Self::from_le_bytes(bytes))
            }
        }
    )*};
}
integer!(u8, u16, u32, u64);

impl Value for String {
    fn put(&self, out: &mut Vec<u8>) {
        (self.len() as u32).put(out);
        out.extend_from_slice(self.as_bytes());
    }

    fn take(fields: &mut Fields<'_>) -> Result<Self, String> {
        let bytes = fields.sized()?;
        Self::from_utf8(bytes.to_vec()).map_err(|_| "a text is not UTF-8".to_owned())
    }
}

impl<K: Value + Ord, V: Value> Value for BTreeMap<K, V> {
    fn put(&self, out: &mut Vec<u8>) {
        let start = out.len();
        0u32.put(out);
        for (key, value) in self {
            key.put(out);
            value.put(out);
        }
        let len = (out.len() - start - 4) as u32;
        out[start..start + 4].copy_from_slice(&len.to_le_bytes());
    }

    fn take(fields: &mut Fields<'_>) -> Result<Self, String> {
        let mut inner = Fields { rest: fields.sized()? };
        let mut map = Self::new();
        while !inner.rest.is_empty() {
            let key = K::take(&mut inner)?;
            map.insert(key, V::take(&mut inner)?);
        }
        Ok(map)
    }
}

/// A record type of this crate.
pub(crate) trait Body: Sized {
    /// The opcode of its records.
    const OPCODE: u8;
    /// Appends its fields.
    fn put(&self, out: &mut Vec<u8>);
    /// Parses its fields; later versions of the format may append others, which are ignored.
    fn parse(body: &[u8]) -> Result<Self, String>;
}

/// Defines a record as a struct with its fields in order.
macro_rules! record {
    ($(#[$doc:meta])* $name:ident = $opcode:expr; $($field:ident: $kind:ty,)*) => {
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq, Eq, Default)]
        pub(crate) struct $name {
            $(pub $field: $kind,)*
        }

        impl Body for $name {
            const OPCODE: u8 = $opcode;

            fn put(&self, out: &mut Vec<u8>) {
                $(Value::put(&self.$field, out);)*
            }

            fn parse(body: &[u8]) -> Result<Self, String> {
                let mut fields = Fields { rest: body };
                Ok(Self { $($field: Value::take(&mut fields)
                    .map_err(|e| format!("{}.{}: {e}", stringify!($name), stringify!($field)))?,)* })
            }
        }
    };
}

record! {
    /// The first record of a file.
    Header = op::HEADER;
    profile: String,
    library: String,
}
record! {
    /// The last record of a file.
    Footer = op::FOOTER;
    summary_start: u64,
    summary_offset_start: u64,
    summary_crc: u32,
}
record! {
    /// A topic.
    Channel = op::CHANNEL;
    id: u16,
    schema_id: u16,
    topic: String,
    message_encoding: String,
    metadata: BTreeMap<String, String>,
}
record! {
    /// What stands before a message's bytes.
    MessageHeader = op::MESSAGE;
    channel_id: u16,
    sequence: u32,
    log_time: u64,
    publish_time: u64,
}
record! {
    /// Where a chunk is, and what it spans.
    ChunkIndex = op::CHUNK_INDEX;
    message_start_time: u64,
    message_end_time: u64,
    chunk_start_offset: u64,
    chunk_length: u64,
    message_index_offsets: BTreeMap<u16, u64>,
    message_index_length: u64,
    compression: String,
    compressed_size: u64,
    uncompressed_size: u64,
}
record! {
    /// Counts over a whole file.
    Statistics = op::STATISTICS;
    message_count: u64,
    schema_count: u16,
    channel_count: u32,
    attachment_count: u32,
    metadata_count: u32,
    chunk_count: u32,
    message_start_time: u64,
    message_end_time: u64,
    channel_message_counts: BTreeMap<u16, u64>,
}
record! {
    /// Pairs of texts under a name.
    Metadata = op::METADATA;
    name: String,
    metadata: BTreeMap<String, String>,
}
record! {
    /// Where a metadata record is.
    MetadataIndex = op::METADATA_INDEX;
    offset: u64,
    length: u64,
    name: String,
}
record! {
    /// Where the summary's records of one kind are.
    SummaryOffset = op::SUMMARY_OFFSET;
    group_opcode: u8,
    group_start: u64,
    group_length: u64,
}
record! {
    /// The end of the data section.
    DataEnd = op::DATA_END;
    data_section_crc: u32,
}

/// A schema; its text is the last field and may be long.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Schema {
    pub id: u16,
    pub name: String,
    pub encoding: String,
    pub data: Vec<u8>,
}

impl Body for Schema {
    const OPCODE: u8 = op::SCHEMA;

    fn put(&self, out: &mut Vec<u8>) {
        self.id.put(out);
        self.name.put(out);
        self.encoding.put(out);
        (self.data.len() as u32).put(out);
        out.extend_from_slice(&self.data);
    }

    fn parse(body: &[u8]) -> Result<Self, String> {
        let mut fields = Fields { rest: body };
        let mut parse = || {
            Ok::<_, String>(Self {
                id: Value::take(&mut fields)?,
                name: Value::take(&mut fields)?,
                encoding: Value::take(&mut fields)?,
                data: fields.sized()?.to_vec(),
            })
        };
        parse().map_err(|e| format!("Schema: {e}"))
    }
}

/// A chunk: what it says of its records, and the records as stored.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Chunk<'a> {
    pub message_start_time: u64,
    pub message_end_time: u64,
    pub uncompressed_size: u64,
    pub uncompressed_crc: u32,
    pub compression: Cow<'a, str>,
    pub records: &'a [u8],
}

impl<'a> Chunk<'a> {
    /// Appends its fields.
    pub(crate) fn put(&self, out: &mut Vec<u8>) {
        self.message_start_time.put(out);
        self.message_end_time.put(out);
        self.uncompressed_size.put(out);
        self.uncompressed_crc.put(out);
        (self.compression.len() as u32).put(out);
        out.extend_from_slice(self.compression.as_bytes());
        (self.records.len() as u64).put(out);
        out.extend_from_slice(self.records);
    }

    /// Parses its fields.
    pub(crate) fn parse(body: &'a [u8]) -> Result<Self, String> {
        let mut fields = Fields { rest: body };
        let mut parse = || {
            Ok::<_, String>(Self {
                message_start_time: Value::take(&mut fields)?,
                message_end_time: Value::take(&mut fields)?,
                uncompressed_size: Value::take(&mut fields)?,
                uncompressed_crc: Value::take(&mut fields)?,
                compression: String::from_utf8_lossy(fields.sized()?),
                records: {
                    let len = u64::take(&mut fields)?;
                    fields.bytes(usize::try_from(len).unwrap_or(usize::MAX))?
                },
            })
        };
        parse().map_err(|e| format!("Chunk: {e}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check<T: Body + PartialEq + std::fmt::Debug>(value: &T, expected: &[u8]) {
        let mut bytes = Vec::new();
        value.put(&mut bytes);
        assert_eq!(bytes, expected);
        assert_eq!(T::parse(&bytes).unwrap(), *value);
        for len in 0..bytes.len() {
            assert!(T::parse(&bytes[..len]).is_err(), "cut to {len}");
        }
    }

    #[test]
    fn bytes_are_the_specification_s() {
        let metadata = [("k".to_owned(), "v".to_owned())].into();
        check(
            &Channel { id: 1, schema_id: 2, topic: "/t".into(), message_encoding: "cdr".into(), metadata },
            b"\x01\0\x02\0\x02\0\0\0/t\x03\0\0\0cdr\x0a\0\0\0\x01\0\0\0k\x01\0\0\0v",
        );
        check(
            &MetadataIndex { offset: 3, length: 4, name: "n".into() },
            b"\x03\0\0\0\0\0\0\0\x04\0\0\0\0\0\0\0\x01\0\0\0n",
        );
        check(
            &Schema { id: 1, name: "a".into(), encoding: "e".into(), data: b"xy".to_vec() },
            b"\x01\0\x01\0\0\0a\x01\0\0\0e\x02\0\0\0xy",
        );
    }

    #[test]
    fn a_length_beyond_the_record_is_an_error_that_names_the_field() {
        let error = Header::parse(b"\xff\xff\xff\xffx").unwrap_err();
        assert_eq!(error, "Header.profile: 4294967295 bytes expected, 1 left");
        assert!(Chunk::parse(&[0xff; 60]).is_err());
    }
}
