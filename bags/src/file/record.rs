//! MCAP records as bytes: an opcode, a length, a body.

use super::records::{Body, MAGIC};

/// Opcode and length.
pub(crate) const PREFIX_LEN: usize = 9;
/// Footer record and end magic.
pub(crate) const FOOTER_LEN: u64 = (PREFIX_LEN + 20 + MAGIC.len()) as u64;
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

/// Appends a record.
pub(crate) fn put_body<T: Body>(out: &mut Vec<u8>, body: &T) {
    put(out, T::OPCODE, |out| body.put(out));
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
