//! Brings CDR of every byte order and version into the one that is sent by DDS here: little-endian, version 1.

use super::Schema;
use super::decode::{HEADER, numbers};
use crate::error::Result;

/// Whether a message is little-endian CDR of version 1, by its encapsulation header.
pub(crate) fn is_sendable(data: &[u8]) -> bool {
    matches!(data, [0, 1, ..])
}

/// A message as little-endian CDR of version 1; one that is so already, unchanged.
///
/// # Errors
/// [`crate::BagError::Cdr`] when its bytes do not fit its type, or its encapsulation is not plain CDR.
pub fn to_little_endian(schema: &Schema, data: &[u8]) -> Result<Vec<u8>> {
    if is_sendable(data) {
        return Ok(data.to_vec());
    }
    let is_big = matches!(data, [0, 0 | 6, ..]);
    let mut turned = Vec::with_capacity(data.len() + data.len() / 2);
    turned.extend_from_slice(&[0, 1, 0, 0]);
    let mut taken = HEADER;
    for number in numbers(schema, data)? {
        turned.extend_from_slice(&data[taken..number.padding]);
        // Version 2 aligns numbers of eight bytes to four, version 1 to eight.
        let position = turned.len() - HEADER;
        turned.resize(HEADER + position.next_multiple_of(number.size), 0);
        taken = number.at + number.size;
        let start = turned.len();
        turned.extend_from_slice(&data[number.at..taken]);
        if is_big {
            turned[start..].reverse();
        }
    }
    turned.extend_from_slice(&data[taken.min(data.len())..]);
    Ok(turned)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn json(schema: &Schema, data: &[u8]) -> String {
        let mut text = Vec::new();
        super::super::to_json(schema, data, &mut text).unwrap();
        String::from_utf8(text).unwrap()
    }

    #[test]
    fn a_message_turned_over_reads_the_same() {
        let schema = Schema::parse("a/msg/B", "uint8 a\nfloat64 b\nint16[] c\nstring d\nwstring e\n").unwrap();
        let mut big = vec![0, 0, 0, 0, 7, 0, 0, 0, 0, 0, 0, 0];
        big.extend(1.5f64.to_be_bytes());
        big.extend([0, 0, 0, 2, 0, 1, 0xff, 0xfe, 0, 0, 0, 3, b'h', b'i', 0, 0, 0, 0, 0, 1, 0x20, 0xac]);
        let little = to_little_endian(&schema, &big).unwrap();
        assert_eq!(little.len(), big.len());
        assert_eq!(json(&schema, &big), json(&schema, &little));
        assert_eq!(json(&schema, &little), r#"{"a":7,"b":1.5,"c":[1,-2],"d":"hi","e":"€"}"#);
        assert_eq!(little[..4], [0, 1, 0, 0]);
        assert_eq!(to_little_endian(&schema, &little).unwrap(), little);
        assert!(to_little_endian(&schema, &big[..20]).is_err());
        assert!(to_little_endian(&schema, &[0, 3, 0, 0, 7]).is_err(), "not plain CDR");
    }

    #[test]
    fn version_2_is_aligned_anew() {
        let schema = Schema::parse("a/msg/B", "uint8 a\nfloat64 b\nuint8 c\nuint64[] d\n").unwrap();
        for (kind, one) in [(6, [0, 0, 0, 1]), (7, [1, 0, 0, 0])] {
            let is_big = kind == 6;
            let bytes = |x: f64| if is_big { x.to_be_bytes() } else { x.to_le_bytes() };
            let number = if is_big { 9u64.to_be_bytes() } else { 9u64.to_le_bytes() };
            let mut data = vec![0, kind, 0, 0, 7, 0, 0, 0];
            data.extend(bytes(2.5));
            data.extend([8, 0, 0, 0]);
            data.extend(one);
            data.extend(number);
            let turned = to_little_endian(&schema, &data).unwrap();
            assert_eq!(turned[..2], [0, 1]);
            assert_eq!(json(&schema, &turned), r#"{"a":7,"b":2.5,"c":8,"d":[9]}"#);
            assert_eq!(json(&schema, &turned), json(&schema, &data));
        }
    }
}
