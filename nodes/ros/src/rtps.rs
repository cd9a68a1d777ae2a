//! The few RTPS datagrams that a node sends to its own RustDDS, as bytes.
//!
//! Layouts are those of the DDSI-RTPS specification 2.3, sections 8.3 and 9.4 to 9.6, little-endian.

use ros2_client::Gid;

/// What the first twelve bytes of each identity in a process are.
pub(crate) type Prefix = [u8; 12];

/// What all identities in the process of this endpoint have in common.
pub(crate) fn prefix_of(endpoint: Gid) -> Prefix {
    std::array::from_fn(|index| endpoint.as_bytes()[index])
}

/// Identity of an endpoint within its process.
pub(crate) type EntityId = [u8; 4];

pub(crate) const SPDP_WRITER: EntityId = [0, 1, 0, 0xc2];
const SPDP_READER: EntityId = [0, 1, 0, 0xc7];
pub(crate) const READERS_WRITER: EntityId = [0, 0, 4, 0xc2];
const READERS_READER: EntityId = [0, 0, 4, 0xc7];
pub(crate) const WRITERS_WRITER: EntityId = [0, 0, 3, 0xc2];
const WRITERS_READER: EntityId = [0, 0, 3, 0xc7];
const PARTICIPANT: EntityId = [0, 0, 1, 0xc1];

const MAGIC: &[u8; 4] = b"RTPS";
const VERSION: [u8; 2] = [2, 3];
/// RustDDS, as whose participant these datagrams pass.
const VENDOR: [u8; 2] = [1, 0x12];

const ACKNACK: u8 = 0x06;
const HEARTBEAT: u8 = 0x07;
const DATA: u8 = 0x15;
const LITTLE_ENDIAN: u8 = 0x01;
const WITH_INLINE_QOS: u8 = 0x02;
const WITH_DATA: u8 = 0x04;
const WITH_KEY: u8 = 0x08;

/// How a participant announces readers and writers, but hears of none: bits of PID_BUILTIN_ENDPOINT_SET.
const ANNOUNCES_ONLY: u32 = 1 << 2 | 1 << 4;
/// A locator that is none.
const NOWHERE: [u8; 24] = {
    let mut bytes = [0; 24];
    (bytes[0], bytes[1], bytes[2], bytes[3]) = (0xff, 0xff, 0xff, 0xff);
    bytes
};
/// Ten years [s]: it is announced once.
const LEASE_S: u32 = 315_360_000;

/// What one participant says of a reader of another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Claim {
    /// It is there, and waits for what it misses.
    Reliable,
    /// It is there, and does without what it misses.
    BestEffort,
}

/// A reader as discovery describes it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Described {
    pub(crate) gid: Gid,
    pub(crate) topic: String,
    pub(crate) type_name: String,
}

/// A datagram in the making.
pub(crate) struct Datagram {
    bytes: Vec<u8>,
}

impl Datagram {
    /// A datagram from the participant `source`.
    pub(crate) fn from(source: Prefix) -> Self {
        let mut bytes = Vec::with_capacity(512);
        for part in [&MAGIC[..], &VERSION, &VENDOR, &source] {
            bytes.extend_from_slice(part);
        }
        Self { bytes }
    }

    /// The bytes to send.
    pub(crate) fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Announces the participant `source`, which receives at 127.0.0.1 and `port`.
    pub(crate) fn participant(self, source: Prefix, port: u16) -> Self {
        let mut parameters = Parameters::default();
        parameters.put(0x0015, &[VERSION[0], VERSION[1], 0, 0]);
        parameters.put(0x0016, &[VENDOR[0], VENDOR[1], 0, 0]);
        parameters.put(0x0050, &[&source[..], &PARTICIPANT].concat());
        parameters.put(0x0058, &ANNOUNCES_ONLY.to_le_bytes());
        parameters.put(0x0002, &[LEASE_S.to_le_bytes(), [0; 4]].concat());
        parameters.put(0x0032, &local_udp_v4(port));
        self.data(WITH_DATA, SPDP_READER, SPDP_WRITER, 1, &[], &parameters.finish())
    }

    /// Says of a reader what `claim` says; `number` counts what this source says of readers.
    pub(crate) fn reader(self, reader: &Described, claim: Claim, number: u32) -> Self {
        let reliability: u32 = match claim {
            Claim::BestEffort => 1,
            Claim::Reliable => 2,
        };
        let mut parameters = Parameters::default();
        parameters.put(0x005a, reader.gid.as_bytes());
        parameters.put_text(0x0005, &reader.topic);
        parameters.put_text(0x0007, &reader.type_name);
        parameters.put(0x001a, &[&reliability.to_le_bytes()[..], &[0; 8]].concat());
        // No multicast: what is sent to a guest by multicast wakes every other process too.
        parameters.put(0x0030, &NOWHERE);
        self.data(WITH_DATA, READERS_READER, READERS_WRITER, number, &[], &parameters.finish())
    }

    /// Says that a writer is gone; `number` counts what this source says of writers.
    pub(crate) fn writer_gone(self, writer: Gid, number: u32) -> Self {
        let (mut parameters, mut inline) = (Parameters::default(), Parameters::default());
        parameters.put(0x005a, writer.as_bytes());
        // Status info: disposed and unregistered, big-endian by definition.
        inline.put(0x0071, &[0, 0, 0, 3]);
        self.data(WITH_KEY, WRITERS_READER, WRITERS_WRITER, number, &inline.finish(), &parameters.finish())
    }

    /// Says that of what `writer` (one of discovery) says, nothing before `number` is to be waited for, and asks for
    /// an acknowledgement.
    pub(crate) fn heartbeat(self, writer: EntityId, number: u32, last: u32, count: u32) -> Self {
        let reader = if writer == WRITERS_WRITER { WRITERS_READER } else { READERS_READER };
        let mut body = Vec::with_capacity(28);
        body.extend_from_slice(&reader);
        body.extend_from_slice(&writer);
        body.extend_from_slice(&sequence_number(number));
        body.extend_from_slice(&sequence_number(last));
        body.extend_from_slice(&count.to_le_bytes());
        self.submessage(HEARTBEAT, 0, &body)
    }

    fn data(
        self,
        content: u8,
        reader: EntityId,
        writer: EntityId,
        number: u32,
        inline_qos: &[u8],
        payload: &[u8],
    ) -> Self {
        let mut body = vec![0, 0, 16, 0];
        body.extend_from_slice(&reader);
        body.extend_from_slice(&writer);
        body.extend_from_slice(&sequence_number(number));
        body.extend_from_slice(inline_qos);
        // Encapsulation: a parameter list, little-endian.
        body.extend_from_slice(&[0, 3, 0, 0]);
        body.extend_from_slice(payload);
        let inline = if inline_qos.is_empty() { 0 } else { WITH_INLINE_QOS };
        self.submessage(DATA, content | inline, &body)
    }

    fn submessage(mut self, kind: u8, flags: u8, body: &[u8]) -> Self {
        self.bytes.extend_from_slice(&[kind, flags | LITTLE_ENDIAN]);
        self.bytes.extend_from_slice(&(body.len() as u16).to_le_bytes());
        self.bytes.extend_from_slice(body);
        self
    }
}

/// Whether the datagram comes from `source` and acknowledges something.
pub(crate) fn acknowledges(datagram: &[u8], source: &[u8]) -> bool {
    let Some((header, mut rest)) = datagram.split_at_checked(20) else { return false };
    if !header.starts_with(MAGIC) || header[8..] != *source {
        return false;
    }
    while let Some((&[kind, flags, low, high], body)) = rest.split_first_chunk() {
        if kind == ACKNACK {
            return true;
        }
        let length = [low, high];
        let length = if flags & LITTLE_ENDIAN != 0 { u16::from_le_bytes(length) } else { u16::from_be_bytes(length) };
        match body.get(usize::from(length)..) {
            Some(next) if length > 0 => rest = next,
            _ => return false,
        }
    }
    false
}

/// A number from 1: its upper half, then its lower one.
fn sequence_number(number: u32) -> [u8; 8] {
    let mut bytes = [0; 8];
    bytes[4..].copy_from_slice(&number.to_le_bytes());
    bytes
}

/// A locator of UDP over IPv4 on this host.
fn local_udp_v4(port: u16) -> [u8; 24] {
    let mut bytes = [0; 24];
    bytes[0] = 1;
    bytes[4..6].copy_from_slice(&port.to_le_bytes());
    bytes[20..].copy_from_slice(&[127, 0, 0, 1]);
    bytes
}

/// A parameter list.
#[derive(Default)]
struct Parameters {
    bytes: Vec<u8>,
}

impl Parameters {
    /// Adds a parameter; the length of `value` is a multiple of four.
    fn put(&mut self, id: u16, value: &[u8]) {
        self.bytes.extend_from_slice(&id.to_le_bytes());
        self.bytes.extend_from_slice(&(value.len() as u16).to_le_bytes());
        self.bytes.extend_from_slice(value);
    }

    /// Adds a text as CDR writes it, with its final zero, filled up to a multiple of four.
    fn put_text(&mut self, id: u16, text: &str) {
        let length = text.len() as u32 + 1;
        let mut value = length.to_le_bytes().to_vec();
        value.extend_from_slice(text.as_bytes());
        value.resize(4 + (text.len() + 1).next_multiple_of(4), 0);
        self.put(id, &value);
    }

    fn finish(mut self) -> Vec<u8> {
        self.put(0x0001, &[]);
        self.bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SOURCE: Prefix = [1, 0x12, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12];

    /// The example of a reliable reader is byte for byte what a program of others sent, but for the reader's QoS.
    #[test]
    fn a_reader_is_described_as_discovery_describes_it() {
        let gid = Gid::from([1, 0x12, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 0, 0, 0x10, 4]);
        let reader = Described { gid, topic: "rt/a".to_owned(), type_name: "p::msg::dds_::T_".to_owned() };
        let datagram = Datagram::from(SOURCE).reader(&reader, Claim::BestEffort, 3);
        let mut expected = vec![];
        expected.extend_from_slice(b"RTPS\x02\x03\x01\x12");
        expected.extend_from_slice(&SOURCE);
        expected.extend_from_slice(&[0x15, 5, 136, 0, 0, 0, 16, 0]);
        expected.extend_from_slice(&[0, 0, 4, 0xc7, 0, 0, 4, 0xc2, 0, 0, 0, 0, 3, 0, 0, 0, 0, 3, 0, 0]);
        expected.extend_from_slice(&[0x5a, 0, 16, 0]);
        expected.extend_from_slice(gid.as_bytes());
        expected.extend_from_slice(b"\x05\0\x0c\0\x05\0\0\0rt/a\0\0\0\0");
        expected.extend_from_slice(b"\x07\0\x18\0\x11\0\0\0p::msg::dds_::T_\0\0\0\0");
        expected.extend_from_slice(&[0x1a, 0, 12, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
        expected.extend_from_slice(&[0x30, 0, 24, 0]);
        expected.extend_from_slice(&NOWHERE);
        expected.extend_from_slice(&[1, 0, 0, 0]);
        assert_eq!(datagram.bytes(), expected);
    }

    #[test]
    fn acknowledgements_are_recognised_by_their_sender() {
        let info_destination = [&[0x0e, 1, 12, 0][..], &SOURCE].concat();
        let header = Datagram::from(SOURCE).bytes().to_vec();
        let acknack = [&[ACKNACK, 1, 24, 0][..], &[0; 24]].concat();
        let datagram = [&header[..], &info_destination, &acknack].concat();
        assert!(acknowledges(&datagram, &SOURCE));
        assert!(!acknowledges(&datagram, &[9; 12]));
        assert!(!acknowledges(&header, &SOURCE));
        for length in 0..datagram.len() - acknack.len() + 4 {
            assert!(!acknowledges(&datagram[..length], &SOURCE), "{length}");
        }
    }
}
