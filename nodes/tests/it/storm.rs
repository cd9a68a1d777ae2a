//! Datagrams that a mission's nodes sent to a stranger, sent back to them damaged.

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use rand::seq::IndexedRandom as _;
use rand::{Rng as _, RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use crate::stranger::{FILES, Stranger, datagram, ports};

/// How long it listens before it sends.
const LISTEN: Duration = Duration::from_secs(1);
/// What it keeps of what it hears.
const KEPT: usize = 2000;
/// How many datagrams it sends at once, and how long it rests then: fewer than the nodes' sockets have room for.
const AT_ONCE: usize = 8;
const REST: Duration = Duration::from_millis(4);

/// Topics of the mission that it reads, so that their writers talk to it, and writes, so that their readers do.
const READ: [(&str, &str); 8] = [
    ("rt/swath/spacecraft/state", "swath_msgs::msg::dds_::SpacecraftState_"),
    ("rt/swath/guidance/wheel_torque", "swath_msgs::msg::dds_::WheelTorque_"),
    ("rt/swath/requests/upcoming", "swath_msgs::msg::dds_::UpcomingStrips_"),
    ("rt/swath/planner/decision", "swath_msgs::msg::dds_::Decision_"),
    ("rt/swath/planner/task", "swath_msgs::msg::dds_::ImagingTask_"),
    ("rt/swath/requests/events", "swath_msgs::msg::dds_::StripStatus_"),
    ("rt/clock", "rosgraph_msgs::msg::dds_::Clock_"),
    ("rt/rosout", "rcl_interfaces::msg::dds_::Log_"),
];
const WRITTEN: [(&str, &str); 4] = [
    ("rt/swath/requests/request", "swath_msgs::msg::dds_::StripRequest_"),
    ("rt/swath/spacecraft/state", "swath_msgs::msg::dds_::SpacecraftState_"),
    ("rt/swath/guidance/wheel_torque", "swath_msgs::msg::dds_::WheelTorque_"),
    ("rq/swath/requests/submitRequest", "swath_msgs::srv::dds_::SubmitStrips_Request_"),
];

/// Numbers at which programs go wrong.
const EDGES: [u32; 8] = [0, 1, 2, 0xffff, 0x0100_0000, 0x7fff_ffff, 0x8000_0000, 0xffff_ffff];
/// The kinds of submessages.
const KINDS: [u8; 13] = [0x01, 0x06, 0x07, 0x08, 0x09, 0x0c, 0x0d, 0x0e, 0x0f, 0x12, 0x13, 0x15, 0x16];
const DATA: u8 = 0x15;
const DATA_FRAG: u8 = 0x16;
const HEADER: usize = 20;

/// A stranger with what it has heard; no identity of a node is among what it sends.
pub struct Storm {
    stranger: Stranger,
    domain: u16,
    heard: Vec<Vec<u8>>,
    random: ChaCha8Rng,
    number: u32,
}

impl Storm {
    /// Listens to the mission that flies in the domain.
    pub fn gather(domain: u16, seed: u64) -> Self {
        let mut stranger = Stranger::towards(None, domain, 1, 100);
        READ.iter().for_each(|(topic, kind)| stranger.announce_reader(topic, kind));
        WRITTEN.iter().for_each(|(topic, kind)| stranger.announce_writer(topic, kind));
        stranger.ask_for_endpoints();
        let mut heard: BTreeSet<Vec<u8>> = FILES.iter().map(|(file, _)| datagram(file)).collect();
        let until = Instant::now() + LISTEN;
        while Instant::now() < until && heard.len() < KEPT {
            match stranger.take() {
                Some(datagram) => _ = heard.insert(datagram),
                None => std::thread::sleep(REST),
            }
        }
        let heard = heard.iter().filter_map(|datagram| own(datagram, stranger.prefix())).collect();
        Self { stranger, domain, heard, random: ChaCha8Rng::seed_from_u64(seed), number: 0 }
    }

    /// Which kinds of submessages are among what it has heard.
    pub fn kinds(&self) -> BTreeSet<u8> {
        let kinds = self.heard.iter().flat_map(|datagram| submessages(datagram).into_iter().map(|at| datagram[at]));
        kinds.collect()
    }

    /// Sends all that it has heard as it is, then so many damaged ones while the mission flies; how many that were.
    pub fn rage(&mut self, count: u64, mut flies: impl FnMut() -> bool) -> u64 {
        let ports: Vec<u16> = ports(None, self.domain).into_iter().collect();
        for datagram in &self.heard {
            self.send(datagram, &ports);
        }
        let mut sent = 0;
        while sent < count && flies() {
            for _ in 0..AT_ONCE {
                let datagram = self.damaged();
                self.send(&datagram, &ports);
                sent += 1;
            }
            std::thread::sleep(REST);
        }
        sent
    }

    /// To the ports of all nodes where such a datagram belongs.
    fn send(&self, datagram: &[u8], ports: &[u16]) {
        let user = !is_of_discovery(datagram);
        ports.iter().filter(|port| (*port % 2 == 1) == user).for_each(|port| self.stranger.send_to(datagram, *port));
    }

    fn damaged(&mut self) -> Vec<u8> {
        let random = &mut self.random;
        let mut datagram = self.heard.choose(random).cloned().unwrap_or_default();
        if random.random_bool(0.5) {
            // Else it is one that the node has heard already, or of nobody, and is not looked into.
            self.number += 1;
            renew(&mut datagram, self.number, random.random_range(0..WRITTEN.len()) as u8);
        }
        for _ in 0..random.random_range(1..=4) {
            damage(&mut datagram, &self.heard, random);
        }
        datagram
    }
}

/// A datagram as the stranger's own, to whom it may concern.
fn own(datagram: &[u8], stranger: [u8; 12]) -> Option<Vec<u8>> {
    let sender: [u8; 12] = datagram.get(8..HEADER)?.try_into().ok()?;
    let (mut datagram, anybody) = (datagram.to_vec(), [0; 12]);
    // First those to the stranger: they are to all.
    for (from, to) in [(stranger, anybody), (sender, stranger)] {
        for at in 0..datagram.len().saturating_sub(11) {
            if datagram[at..at + 12] == from {
                datagram[at..at + 12].copy_from_slice(&to);
            }
        }
    }
    datagram[8..HEADER].copy_from_slice(&stranger);
    // Its readers begin with a number of its own: no node has such ones.
    for at in submessages(&datagram) {
        let reader = if matches!(datagram[at], DATA | DATA_FRAG) { at + 8 } else { at + 4 };
        if let Some([_, _, 0x10, 4]) = datagram.get(reader..reader + 4) {
            datagram[reader..reader + 4].fill(0);
        }
    }
    Some(datagram)
}

/// Where the submessages begin.
fn submessages(datagram: &[u8]) -> Vec<usize> {
    let (mut at, mut found) = (HEADER, Vec::new());
    while let Some(&[_, flags, low, high]) = datagram.get(at..at + 4) {
        found.push(at);
        let length = if flags & 1 == 1 { u16::from_le_bytes([low, high]) } else { u16::from_be_bytes([low, high]) };
        if length == 0 {
            break;
        }
        at += 4 + usize::from(length);
    }
    found
}

/// Whether the first entities that it names are RTPS's own.
fn is_of_discovery(datagram: &[u8]) -> bool {
    let entities = submessages(datagram).into_iter().filter_map(|at| {
        let first = match datagram[at] {
            DATA | DATA_FRAG => at + 8,
            0x06..=0x08 | 0x12 | 0x13 => at + 4,
            _ => return None,
        };
        datagram.get(first + 7)
    });
    entities.take(1).any(|kind| kind & 0xc0 == 0xc0)
}

/// Gives its samples a number that no reader has heard yet, and one of the stranger's writers, which has nothing else.
fn renew(datagram: &mut Vec<u8>, number: u32, writer: u8) {
    let discovery = is_of_discovery(datagram);
    if !discovery {
        // A heartbeat that asks for no answer, of this sample alone.
        let numbers = [0, number, 0, number, number].map(u32::to_le_bytes).concat();
        let heartbeat = [&[0x07, 3, 28, 0, 0, 0, 0, 0, 0, writer, 0x10, 3][..], &numbers].concat();
        datagram.splice(HEADER..HEADER, heartbeat);
    }
    for at in submessages(datagram) {
        if matches!(datagram[at], DATA | DATA_FRAG)
            && let Some(sample) = datagram.get_mut(at + 12..at + 24)
        {
            if !discovery {
                sample[..4].copy_from_slice(&[0, writer, 0x10, 3]);
            }
            sample[8..].copy_from_slice(&number.to_le_bytes());
        }
    }
}

fn damage(datagram: &mut Vec<u8>, others: &[Vec<u8>], random: &mut ChaCha8Rng) {
    let length = datagram.len();
    if length <= HEADER {
        return;
    }
    let at = random.random_range(0..length);
    let edge = EDGES[random.random_range(0..EDGES.len())];
    let submessage = submessages(datagram).choose(random).copied().unwrap_or(HEADER);
    match random.random_range(0..10) {
        0 => datagram[at] ^= 1 << random.random_range(0..8),
        1 => datagram[at] = random.random(),
        2 => {
            let at = at / 4 * 4;
            let bytes = if random.random() { edge.to_le_bytes() } else { edge.to_be_bytes() };
            datagram.iter_mut().skip(at).zip(bytes).for_each(|(byte, new)| *byte = new);
        }
        3 => datagram.iter_mut().skip(submessage + 2).take(2).for_each(|byte| *byte = random.random()),
        4 => datagram.truncate(at),
        5 => {
            let other = others.choose(random).map_or(&[][..], Vec::as_slice);
            datagram.extend_from_slice(other.get(HEADER..).unwrap_or_default());
        }
        6 => datagram.iter_mut().skip(submessage).take(1).for_each(|byte| *byte = KINDS[at % KINDS.len()]),
        7 => datagram.iter_mut().skip(submessage + 1).take(1).for_each(|byte| *byte ^= 1),
        8 => {
            let mut bytes = [0; 8];
            random.fill_bytes(&mut bytes);
            datagram.splice(at..at, bytes);
        }
        _ => datagram[at..].iter_mut().take(random.random_range(1..16)).for_each(|byte| *byte = random.random()),
    }
    // No datagram is longer.
    datagram.truncate(60_000);
}
