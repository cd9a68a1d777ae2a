//! Messages to CDR bytes and back.

use byteorder::{BigEndian, LittleEndian};
use cdr_encoding::{from_bytes, to_writer};
use serde::Serialize;
use serde::de::DeserializeOwned;
use swath_msgs::RosMessage;

use crate::cdr::{Cdr, header_with_room};
use crate::error::RosError;

/// Writes a message as little-endian CDR, encapsulation header included.
///
/// # Errors
/// [`RosError::Encode`] when the message cannot be written, such as a sequence of more than 2^32 elements.
pub fn encode<M: RosMessage>(message: &M) -> Result<Cdr, RosError> {
    encode_as(M::TYPE_NAME, message)
}

/// Reads a message from CDR bytes, encapsulation header included.
///
/// # Errors
/// [`RosError::Decode`] when the bytes are no such message.
pub fn decode<M: RosMessage>(cdr: &Cdr) -> Result<M, RosError> {
    decode_as(M::TYPE_NAME, cdr)
}

pub(crate) fn encode_as<T: Serialize>(type_name: &'static str, value: &T) -> Result<Cdr, RosError> {
    // The payload is aligned from its own start, so it is written by itself after the header.
    let mut bytes = header_with_room(2 * size_of::<T>());
    to_writer::<T, LittleEndian, _>(&mut bytes, value)
        .map_err(|error| RosError::Encode { type_name, reason: error.to_string() })?;
    Ok(Cdr::from_bytes(bytes))
}

pub(crate) fn decode_as<T: DeserializeOwned>(type_name: &'static str, cdr: &Cdr) -> Result<T, RosError> {
    let failed = |reason: String| RosError::Decode { type_name, length: cdr.as_bytes().len(), reason };
    let read = if let Some(payload) = cdr.little_endian() {
        from_bytes::<T, LittleEndian>(payload)
    } else if let Some(payload) = cdr.big_endian() {
        from_bytes::<T, BigEndian>(payload)
    } else {
        return Err(failed("it is not encoded as plain CDR".to_owned()));
    };
    read.map(|(value, _)| value).map_err(|error| failed(error.to_string()))
}

#[cfg(test)]
mod tests {
    use swath_msgs::std_msgs::Header;

    use super::*;

    #[test]
    fn both_byte_orders_are_read() {
        let header = Header { frame_id: "N".to_owned(), ..Default::default() };
        let cdr = encode(&header).unwrap();
        assert_eq!(cdr.as_bytes()[..4], [0, 1, 0, 0]);
        assert_eq!(decode::<Header>(&cdr).unwrap(), header);
        let big = [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2, b'N', 0];
        assert_eq!(decode::<Header>(&Cdr::from_bytes(big.to_vec())).unwrap(), header);
    }

    #[test]
    fn what_is_no_message_is_refused() {
        for bytes in [vec![], vec![0, 1], vec![0, 1, 0, 0, 1], vec![0, 7, 0, 0, 0, 0, 0, 0]] {
            assert!(decode::<Header>(&Cdr::from_bytes(bytes)).is_err());
        }
    }
}
