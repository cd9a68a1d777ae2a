//! Turns big-endian CDR over: what is sent by DDS here is little-endian.

use super::{Schema, decode::numbers};
use crate::error::Result;

/// Whether a message is big-endian, by its encapsulation header.
pub(crate) fn is_big_endian(data: &[u8]) -> bool {
    matches!(data, [0, 0 | 6, ..])
}

/// A big-endian message as little-endian; one that is so already, unchanged.
///
/// # Errors
/// [`crate::BagError::Cdr`] when its bytes do not fit its type.
pub fn to_little_endian(schema: &Schema, data: &[u8]) -> Result<Vec<u8>> {
    let mut turned = data.to_vec();
    if is_big_endian(data) {
        for (at, size) in numbers(schema, data)? {
            turned[at..at + size].reverse();
        }
        turned[1] |= 1;
    }
    Ok(turned)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_turned_over_reads_the_same() {
        let schema = Schema::parse("a/msg/B", "uint8 a\nfloat64 b\nint16[] c\nstring d\nwstring e\n").unwrap();
        let mut big = vec![0, 0, 0, 0, 7, 0, 0, 0, 0, 0, 0, 0];
        big.extend(1.5f64.to_be_bytes());
        big.extend([0, 0, 0, 2, 0, 1, 0xff, 0xfe, 0, 0, 0, 3, b'h', b'i', 0, 0, 0, 0, 0, 1, 0x20, 0xac]);
        let little = to_little_endian(&schema, &big).unwrap();
        let mut text = [Vec::new(), Vec::new()];
        for (text, data) in text.iter_mut().zip([&big, &little]) {
            super::super::to_json(&schema, data, text).unwrap();
        }
        assert_eq!(text[0], text[1]);
        assert_eq!(text[0], r#"{"a":7,"b":1.5,"c":[1,-2],"d":"hi","e":"€"}"#.as_bytes());
        assert_eq!(little[..4], [0, 1, 0, 0]);
        assert_eq!(to_little_endian(&schema, &little).unwrap(), little);
        assert!(to_little_endian(&schema, &big[..20]).is_err());
    }
}
