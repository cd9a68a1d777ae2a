//! A message as bytes, and how RustDDS reads and writes it.

use std::convert::Infallible;

use rustdds::RepresentationIdentifier;
use rustdds::bytes::Bytes;
use rustdds::no_key::{Decode, DefaultDecoder, DeserializerAdapter, SerializerAdapter};

/// A message as it travels: four bytes that name the encoding, then the encoded message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cdr {
    bytes: Bytes,
}

/// Bytes of the encapsulation header.
pub const HEADER_LENGTH: usize = 4;

const LITTLE_ENDIAN: [u8; HEADER_LENGTH] = [0, 1, 0, 0];
const BIG_ENDIAN: [u8; HEADER_LENGTH] = [0, 0, 0, 0];

impl Cdr {
    /// The bytes, header included, as bags store them.
    pub fn as_bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Takes bytes, header included.
    pub fn from_bytes(bytes: impl Into<Bytes>) -> Self {
        Self { bytes: bytes.into() }
    }

    /// The bytes after the header, if they are little-endian plain CDR.
    pub(crate) fn little_endian(&self) -> Option<&[u8]> {
        self.bytes.strip_prefix(&LITTLE_ENDIAN[..2]).and_then(|rest| rest.get(2..))
    }

    /// The bytes after the header, if they are big-endian plain CDR.
    pub(crate) fn big_endian(&self) -> Option<&[u8]> {
        self.bytes.strip_prefix(&BIG_ENDIAN[..2]).and_then(|rest| rest.get(2..))
    }
}

/// Starts a little-endian message with room for a payload of the given length.
pub(crate) fn header_with_room(payload: usize) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(HEADER_LENGTH + payload);
    bytes.extend_from_slice(&LITTLE_ENDIAN);
    bytes
}

/// The link between RustDDS and [`Cdr`].
pub(crate) struct Adapter;

impl DeserializerAdapter<Cdr> for Adapter {
    type Error = Infallible;
    type Decoded = Cdr;

    fn supported_encodings() -> &'static [RepresentationIdentifier] {
        &[
            RepresentationIdentifier::CDR_LE,
            RepresentationIdentifier::CDR_BE,
            RepresentationIdentifier::XCDR2_LE,
            RepresentationIdentifier::XCDR2_BE,
            RepresentationIdentifier::D_CDR2_LE,
            RepresentationIdentifier::D_CDR2_BE,
        ]
    }

    fn transform_decoded(decoded: Cdr) -> Cdr {
        decoded
    }
}

#[derive(Clone)]
pub(crate) struct Copier;

impl Decode<'_, Cdr> for Copier {
    type Error = Infallible;

    fn decode_bytes(self, payload: &[u8], encoding: RepresentationIdentifier) -> Result<Cdr, Infallible> {
        let [first, second] = encoding.to_bytes();
        let mut bytes = Vec::with_capacity(HEADER_LENGTH + payload.len());
        bytes.extend_from_slice(&[first, second, 0, 0]);
        bytes.extend_from_slice(payload);
        Ok(Cdr { bytes: bytes.into() })
    }
}

impl DefaultDecoder<Cdr> for Adapter {
    type Decoder = Copier;
    const DECODER: Copier = Copier;
}

impl SerializerAdapter<Cdr> for Adapter {
    type Error = Infallible;

    fn output_encoding() -> RepresentationIdentifier {
        RepresentationIdentifier::CDR_LE
    }

    fn to_bytes(cdr: &Cdr) -> Result<Bytes, Infallible> {
        Ok(cdr.bytes.slice(HEADER_LENGTH.min(cdr.bytes.len())..))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_plain_cdr_has_a_byte_order() {
        let cdr = |bytes: &'static [u8]| Cdr::from_bytes(bytes);
        assert_eq!(cdr(&[0, 1, 0, 0, 7]).little_endian(), Some(&[7][..]));
        assert_eq!(cdr(&[0, 0, 0, 0, 7]).big_endian(), Some(&[7][..]));
        assert_eq!(cdr(&[0, 7, 0, 0, 7]).little_endian(), None);
        assert_eq!(cdr(&[0, 1]).little_endian(), None);
    }
}
