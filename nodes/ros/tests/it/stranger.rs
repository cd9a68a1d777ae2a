//! A program of others on the wire: a socket that sends hand-made RTPS datagrams to the nodes of one process.

use std::collections::BTreeSet;
use std::net::{Ipv4Addr, UdpSocket};
use std::time::Duration;

/// A participant that announces what the test wants, and acknowledges nothing.
pub struct Stranger {
    socket: UdpSocket,
    /// The only process that hears of it; without one, all in the domain do.
    process: Option<u32>,
    domain: u16,
    prefix: [u8; 12],
    announced_readers: u32,
    announced_writers: u32,
}

const LITTLE_ENDIAN_WITH_DATA: u8 = 5;
/// How many participants are announced at once, and how long there is rest then: fewer than sockets have room for.
const CROWD_AT_ONCE: u16 = 8;
const CROWD_REST: Duration = Duration::from_millis(4);

impl Stranger {
    /// A participant that all nodes of this process in the domain hear of.
    pub fn new(domain: u16, number: u8) -> Self {
        Self::towards(Some(std::process::id()), domain, number, 100)
    }

    /// A participant that the nodes of another process in the domain hear of, or all nodes, for so many seconds.
    pub fn towards(process: Option<u32>, domain: u16, number: u8, lease_s: u32) -> Self {
        let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
        socket.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        let prefix = [1, 0x12, 0x7a, 0x7a, 0x7a, 0x7a, 0x7a, 0x7a, 0x7a, 0x7a, 0x7a, number];
        let stranger = Self { socket, process, domain, prefix, announced_readers: 0, announced_writers: 0 };
        stranger.announce(lease_s);
        std::thread::sleep(Duration::from_millis(300));
        stranger
    }

    /// Announces so many participants to all nodes in the domain, for so many seconds.
    pub fn announce_crowd(&mut self, count: u16, lease_s: u32) {
        let own = self.prefix;
        for number in 0..count {
            self.prefix[8..10].copy_from_slice(&number.to_be_bytes());
            self.announce(lease_s);
            if number % CROWD_AT_ONCE == 0 {
                std::thread::sleep(CROWD_REST);
            }
        }
        self.prefix = own;
    }

    fn announce(&self, lease_s: u32) {
        let port = self.socket.local_addr().unwrap().port();
        let mut parameters = Vec::new();
        put(&mut parameters, 0x15, &[2, 3, 0, 0]);
        put(&mut parameters, 0x16, &[1, 0x12, 0, 0]);
        put(&mut parameters, 0x50, &self.gid([0, 0, 1, 0xc1]));
        put(&mut parameters, 0x58, &0x3f_u32.to_le_bytes());
        put(&mut parameters, 0x02, &[lease_s.to_le_bytes(), [0; 4]].concat());
        // Where it wants discovery and data.
        let mut locator = [0; 24];
        (locator[0], locator[20], locator[23]) = (1, 127, 1);
        locator[4..6].copy_from_slice(&port.to_le_bytes());
        put(&mut parameters, 0x32, &locator);
        put(&mut parameters, 0x31, &locator);
        self.discovery([0, 1, 0, 0xc7], [0, 1, 0, 0xc2], 1, parameters);
    }

    fn gid(&self, entity: [u8; 4]) -> [u8; 16] {
        [&self.prefix[..], &entity].concat().try_into().unwrap()
    }

    /// Announces a reliable reader.
    pub fn announce_reader(&mut self, dds_topic: &str, dds_type: &str) {
        let number = self.announced_readers as u8;
        self.announced_readers += 1;
        let parameters = self.endpoint([0, number, 0x10, 4], dds_topic, dds_type);
        self.discovery([0, 0, 4, 0xc7], [0, 0, 4, 0xc2], self.announced_readers, parameters);
    }

    /// Announces a reliable writer.
    pub fn announce_writer(&mut self, dds_topic: &str, dds_type: &str) {
        let number = self.announced_writers as u8;
        self.announced_writers += 1;
        let mut parameters = self.endpoint([0, number, 0x10, 3], dds_topic, dds_type);
        // Kept for readers that come later, which suits every reader.
        put(&mut parameters, 0x1d, &[1, 0, 0, 0]);
        self.discovery([0, 0, 3, 0xc7], [0, 0, 3, 0xc2], self.announced_writers, parameters);
    }

    fn endpoint(&self, entity: [u8; 4], topic: &str, type_name: &str) -> Vec<u8> {
        let mut parameters = Vec::new();
        put(&mut parameters, 0x5a, &self.gid(entity));
        put_text(&mut parameters, 0x05, topic);
        put_text(&mut parameters, 0x07, type_name);
        put(&mut parameters, 0x1a, &[2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
        parameters
    }

    fn discovery(&self, reader: [u8; 4], writer: [u8; 4], number: u32, mut parameters: Vec<u8>) {
        put(&mut parameters, 1, &[]);
        let payload = [&[0, 3, 0, 0][..], &parameters].concat();
        self.send(&self.data(reader, writer, number, &payload), false);
    }

    /// Asks all nodes for what they have said of their readers and writers.
    pub fn ask_for_endpoints(&self) {
        for (reader, writer) in [([0, 0, 3, 0xc7], [0, 0, 3, 0xc2]), ([0, 0, 4, 0xc7], [0, 0, 4, 0xc2])] {
            // The first 32 samples, as a bit each, and a count.
            let wanted = [0_u32, 1, 32, u32::MAX, 1].map(u32::to_le_bytes).concat();
            let body = [&reader[..], &writer, &wanted].concat();
            let length = (body.len() as u16).to_le_bytes();
            let header = [&b"RTPS\x02\x03\x01\x12"[..], &self.prefix, &[0x06, 1], &length].concat();
            self.send(&[header, body].concat(), false);
        }
    }

    /// Sends a sample of its first writer, encapsulation header included.
    pub fn write(&self, number: u32, payload: &[u8]) {
        self.send(&self.data([0; 4], [0, 0, 0x10, 3], number, payload), true);
    }

    fn data(&self, reader: [u8; 4], writer: [u8; 4], number: u32, payload: &[u8]) -> Vec<u8> {
        let number = [[0; 4], number.to_le_bytes()].concat();
        let body = [&[0, 0, 16, 0][..], &reader, &writer, &number, payload].concat();
        let length = (body.len() as u16).to_le_bytes();
        [&b"RTPS\x02\x03\x01\x12"[..], &self.prefix, &[0x15, LITTLE_ENDIAN_WITH_DATA], &length, &body].concat()
    }

    /// Sends a datagram to every node of the process in the domain, to its user port or its discovery port.
    pub fn send(&self, datagram: &[u8], user: bool) {
        for port in ports(self.process, self.domain).into_iter().filter(|port| (port % 2 == 1) == user) {
            self.send_to(datagram, port);
        }
    }

    /// Sends a datagram to a port of this host; that nobody listens there any more is no matter.
    pub fn send_to(&self, datagram: &[u8], port: u16) {
        let _ = self.socket.send_to(datagram, (Ipv4Addr::LOCALHOST, port));
    }

    /// What all its identities begin with.
    pub fn prefix(&self) -> [u8; 12] {
        self.prefix
    }

    /// The next datagram that has come, if there is one.
    pub fn take(&self) -> Option<Vec<u8>> {
        let mut buffer = vec![0; 65536];
        self.socket.set_nonblocking(true).unwrap();
        let length = self.socket.recv(&mut buffer);
        self.socket.set_nonblocking(false).unwrap();
        buffer.truncate(length.ok()?);
        Some(buffer)
    }

    /// Sends a datagram of the folder `rtps` as its own.
    pub fn send_file(&self, name: &str, user: bool) {
        let mut datagram = datagram(name);
        datagram[8..20].copy_from_slice(&self.prefix);
        self.send(&datagram, user);
    }

    /// Waits for a datagram that contains these bytes.
    pub fn receive(&self, wanted: &[u8]) {
        let mut buffer = [0; 65536];
        loop {
            let length = self.socket.recv(&mut buffer).unwrap();
            if buffer[..length].windows(wanted.len()).any(|window| window == wanted) {
                return;
            }
        }
    }
}

/// The files of the folder `rtps` beside these tests.
pub const FILES: [(&str, &str); 7] = [
    ("01_garbage_cdr_any_topic_48B", include_str!("../rtps/01_garbage_cdr_any_topic_48B.hex")),
    ("02_unknown_encoding_service_or_topic_48B", include_str!("../rtps/02_unknown_encoding_service_or_topic_48B.hex")),
    ("03_nackfrag_base0_56B", include_str!("../rtps/03_nackfrag_base0_56B.hex")),
    ("04_heartbeat_long_range_52B", include_str!("../rtps/04_heartbeat_long_range_52B.hex")),
    ("06_datafrag_4GiB_57B_any_prefix", include_str!("../rtps/06_datafrag_4GiB_57B_any_prefix.hex")),
    ("11_state_tick_2p62_216B", include_str!("../rtps/11_state_tick_2p62_216B.hex")),
    ("12_sedp_stalled_reader_164B", include_str!("../rtps/12_sedp_stalled_reader_164B.hex")),
];

/// The datagram of a file that begins so.
pub fn datagram(name: &str) -> Vec<u8> {
    let (_, digits) = FILES.iter().find(|(file, _)| file.starts_with(name)).unwrap();
    let digits = digits.trim().as_bytes();
    digits.chunks(2).map(|pair| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap()).collect()
}

fn put(parameters: &mut Vec<u8>, id: u16, value: &[u8]) {
    parameters.extend_from_slice(&id.to_le_bytes());
    parameters.extend_from_slice(&(value.len() as u16).to_le_bytes());
    parameters.extend_from_slice(value);
}

fn put_text(parameters: &mut Vec<u8>, id: u16, text: &str) {
    let mut value = (text.len() as u32 + 1).to_le_bytes().to_vec();
    value.extend_from_slice(text.as_bytes());
    value.resize(4 + (text.len() + 1).next_multiple_of(4), 0);
    put(parameters, id, &value);
}

/// The unicast ports of RTPS in the domain that sockets of the process, or of any, are bound to.
pub fn ports(process: Option<u32>, domain: u16) -> BTreeSet<u16> {
    let inodes = process.map(sockets);
    let first = 7410 + 250 * domain;
    let table = std::fs::read_to_string("/proc/self/net/udp").unwrap();
    table
        .lines()
        .map(|line| line.split_whitespace().collect::<Vec<_>>())
        .filter(|words| words.get(9).is_some_and(|inode| inodes.as_ref().is_none_or(|inodes| inodes.contains(*inode))))
        .filter_map(|words| u16::from_str_radix(words[1].split_once(':')?.1, 16).ok())
        .filter(|port| (first..first + 240).contains(port))
        .collect()
}

/// The inodes of the sockets of a process.
fn sockets(process: u32) -> BTreeSet<String> {
    let fds = std::fs::read_dir(format!("/proc/{process}/fd")).unwrap().flatten();
    let links = fds.filter_map(|fd| std::fs::read_link(fd.path()).ok()?.into_os_string().into_string().ok());
    links.filter_map(|link| Some(link.strip_prefix("socket:[")?.strip_suffix(']')?.to_owned())).collect()
}
