//! Keeps datagrams from RustDDS that would end it or fill the memory: a filter of the kernel on its sockets.
//!
//! The reports in `docs/upstream` say what RustDDS does with them. A node of a mission asks the kernel to drop them
//! before they arrive, and counts what was dropped. Where the kernel does not allow that, nothing changes.

use std::collections::{BTreeMap, BTreeSet};
use std::io;

use rustix::process::{PidfdFlags, PidfdGetfdFlags, getpid, pidfd_getfd, pidfd_open};
use socket2::{SockFilter, SockRef};

use crate::bpf::{Label, Program, Size};

/// Ports of a domain, by the rules of RTPS (9.6.1.1).
const PORTS: std::ops::Range<u32> = 0..250;
const FIRST_PORT: u32 = 7400;

/// Where a submessage begins at the earliest: behind the headers of UDP and RTPS.
const FIRST_SUBMESSAGE: u32 = 8 + 20;
const MAGIC: u32 = u32::from_be_bytes(*b"RTPS");

const PAD: u32 = 0x01;
const HEARTBEAT: u32 = 0x07;
const GAP: u32 = 0x08;
const INFO_TS: u32 = 0x09;
const NACK_FRAG: u32 = 0x12;
const DATA_FRAG: u32 = 0x16;

/// Ranges of sample numbers may span so many times 65536 of them, and hardly more: RustDDS goes through each.
const LONGEST_RANGE: u32 = 3;

/// How far a filter goes.
struct Reach {
    /// How many submessages are gone over before the first one that is looked into, and before each of the others.
    stages: &'static [usize],
    /// How many are gone over behind the last one that is looked into; what comes behind these passes.
    rest: usize,
}

/// The first of these that the kernel takes: it gives a socket 128 kB for its filter (`optmem_max`), before Linux 6.8 20 kB.
const REACHES: [Reach; 2] =
    [Reach { stages: &[24, 12, 12, 12, 12, 12, 12, 12, 12], rest: 24 }, Reach { stages: &[24, 12, 8], rest: 8 }];
/// A branch reaches over so many of them.
const GROUP: usize = 8;

/// Places of the filter's memory: where the submessage begins, and a number at hand.
const AT: u32 = 0;
const HAND: u32 = 1;

/// Has the kernel drop such datagrams on all sockets of RTPS that this process has in the domain.
///
/// # Errors
/// If the kernel does not allow it.
pub(crate) fn put_up(domain: u16) -> io::Result<()> {
    let filters: Vec<_> = REACHES.iter().filter_map(filter).collect();
    let process = pidfd_open(getpid(), PidfdFlags::empty())?;
    for socket in sockets(domain)? {
        let socket = pidfd_getfd(&process, socket.descriptor, PidfdGetfdFlags::empty())?;
        let socket = SockRef::from(&socket);
        // In a process of several nodes it may have one, and there is no room for two.
        _ = socket.detach_filter();
        let mut outcome = Err(io::ErrorKind::Unsupported.into());
        for filter in &filters {
            outcome = socket.attach_filter(filter);
            if outcome.is_ok() {
                break;
            }
        }
        outcome?;
    }
    Ok(())
}

/// Datagrams that were dropped on these sockets so far.
pub(crate) fn dropped(domain: u16) -> u64 {
    sockets(domain).map_or(0, |sockets| sockets.iter().map(|socket| socket.dropped).sum())
}

struct Socket {
    descriptor: i32,
    dropped: u64,
}

/// The sockets of RTPS that this process has in the domain.
fn sockets(domain: u16) -> io::Result<Vec<Socket>> {
    let table = std::fs::read_to_string("/proc/self/net/udp")?;
    let first = FIRST_PORT + 250 * u32::from(domain);
    let lines = table.lines().filter_map(|line| {
        let words: Vec<&str> = line.split_whitespace().collect();
        let port = u32::from_str_radix(words.get(1)?.split_once(':')?.1, 16).ok()?;
        let ours = PORTS.contains(&port.checked_sub(first)?);
        ours.then(|| Some((format!("socket:[{}]", words.get(9)?), words.get(12)?.parse().ok()?))).flatten()
    });
    let dropped: BTreeMap<String, u64> = lines.collect();
    let mut seen = BTreeSet::new();
    let mut found = Vec::new();
    for entry in std::fs::read_dir("/proc/self/fd")?.flatten() {
        // One that was closed meanwhile is none.
        let Ok(link) = std::fs::read_link(entry.path()) else { continue };
        let link = link.to_string_lossy().into_owned();
        let Some(&dropped) = dropped.get(&link) else { continue };
        if let Some(descriptor) = entry.file_name().to_str().and_then(|name| name.parse().ok())
            && seen.insert(link)
        {
            found.push(Socket { descriptor, dropped });
        }
    }
    Ok(found)
}

fn filter(reach: &Reach) -> Option<Vec<SockFilter>> {
    program(reach).finish()
}

/// The filter: it goes from submessage to submessage, and looks into those by which RustDDS can be hurt.
fn program(reach: &Reach) -> Program {
    const LOOKED_INTO: [u32; 4] = [HEARTBEAT, GAP, NACK_FRAG, DATA_FRAG];
    // Nobody sends these behind so many others.
    const REFUSED: [u32; 2] = [NACK_FRAG, DATA_FRAG];
    let mut program = Program::default();
    let rtps = program.label();
    program.load(Size::Word, 8);
    program.branch_equal(MAGIC, rtps, Label::NEXT);
    program.drop_it();
    program.place(rtps);
    program.set(FIRST_SUBMESSAGE);
    program.keep(AT);
    for length in reach.stages {
        let look = program.label();
        for first in (0..*length).step_by(GROUP) {
            go_over(&mut program, GROUP.min(length - first), &LOOKED_INTO, look);
        }
        program.accept();
        program.place(look);
        look_into(&mut program);
        go_over(&mut program, 1, &[], look);
    }
    let refuse = program.label();
    for _ in (0..reach.rest).step_by(GROUP) {
        go_over(&mut program, GROUP, &REFUSED, refuse);
    }
    program.accept();
    program.place(refuse);
    program.drop_it();
    program
}

/// Goes over some submessages; one of some kinds is somebody else's business.
fn go_over(program: &mut Program, count: usize, kinds: &[u32], to: Label) {
    let [over, empty, refuse, found, next] = program.labels();
    for _ in 0..count {
        let big = program.label();
        program.index(AT);
        program.load_length();
        program.branch_greater_than_index(Label::NEXT, over);
        // Kind, flags and length at once: the kernel makes much of each access to the packet.
        program.load_at(Size::Word, 0);
        program.keep(HAND);
        program.shift_right(24);
        kinds.iter().for_each(|kind| program.branch_equal(*kind, found, Label::NEXT));
        program.load_kept(HAND);
        program.branch_bits(1 << 16, Label::NEXT, big);
        program.turn_over();
        program.place(big);
        program.mask(0xffff);
        program.branch_equal(0, empty, Label::NEXT);
        program.add_index();
        program.add(4);
        program.keep(AT);
    }
    program.jump(next);
    program.place(empty);
    // Without a length a submessage goes on to the end, except for these two.
    program.load_at(Size::Byte, 0);
    program.branch_equal(PAD, refuse, Label::NEXT);
    program.branch_equal(INFO_TS, refuse, Label::NEXT);
    program.place(over);
    program.accept();
    program.place(refuse);
    program.drop_it();
    program.place(found);
    if !kinds.is_empty() {
        program.jump(to);
    }
    program.place(next);
}

/// A number of two bytes at a place of the submessage, the lower one first.
fn little_half(program: &mut Program, at: u32) {
    program.load_at(Size::Half, at);
    program.turn_over();
}

/// Drops the datagram if the submessage would do harm.
fn look_into(program: &mut Program) {
    let [nack, range, fragment, refuse, harmless, big, judge, large, little] = program.labels();
    let [start_of_gap, nack_little] = program.labels();
    program.index(AT);
    program.load_at(Size::Byte, 0);
    program.branch_equal(NACK_FRAG, nack, Label::NEXT);
    program.branch_equal(DATA_FRAG, fragment, Label::NEXT);
    program.branch_equal(GAP, start_of_gap, range);
    // Nothing before a number: a gap from the first sample on costs nothing, however long it is.
    program.place(start_of_gap);
    program.load_at(Size::Word, 12);
    program.branch_equal(0, Label::NEXT, range);
    program.load_at(Size::Word, 16);
    program.branch_equal(1, harmless, Label::NEXT);
    program.branch_equal(1_u32.swap_bytes(), harmless, Label::NEXT);
    program.place(range);
    // Both numbers with the same upper half: others come after 2^32 samples.
    program.load_at(Size::Word, 20);
    program.keep(HAND);
    program.load_at(Size::Word, 12);
    program.index(HAND);
    program.branch_equal_to_index(Label::NEXT, refuse);
    program.index(AT);
    program.load_at(Size::Byte, 1);
    program.branch_bits(1, Label::NEXT, big);
    little_half(program, 18);
    program.keep(HAND + 1);
    little_half(program, 26);
    program.index(HAND + 1);
    program.subtract_index();
    program.jump(judge);
    program.place(big);
    program.load_at(Size::Half, 16);
    program.keep(HAND + 1);
    program.load_at(Size::Half, 24);
    program.index(HAND + 1);
    program.subtract_index();
    program.place(judge);
    // A range that ends before it begins is an empty one.
    program.branch_greater(i32::MAX as u32, harmless, Label::NEXT);
    program.branch_greater(LONGEST_RANGE, refuse, harmless);
    program.place(nack);
    // Fragments count from 1, and RustDDS keeps a bit for each up to the one that is asked for: no sample has 65536.
    program.load_at(Size::Word, 20);
    program.branch_equal(0, refuse, Label::NEXT);
    program.load_at(Size::Byte, 1);
    program.branch_bits(1, nack_little, Label::NEXT);
    program.load_at(Size::Half, 20);
    program.branch_equal(0, harmless, refuse);
    program.place(nack_little);
    program.load_at(Size::Half, 22);
    program.branch_equal(0, harmless, refuse);
    program.place(fragment);
    program.load_at(Size::Word, 24);
    program.branch_equal(0, refuse, Label::NEXT);
    program.load_at(Size::Half, 30);
    program.branch_equal(0, refuse, Label::NEXT);
    // No sample of a mission has 16 MiB.
    program.load_at(Size::Byte, 1);
    program.branch_bits(1, little, Label::NEXT);
    program.load_at(Size::Byte, 32);
    program.jump(large);
    program.place(little);
    program.load_at(Size::Byte, 35);
    program.place(large);
    program.branch_equal(0, harmless, refuse);
    program.place(refuse);
    program.drop_it();
    program.place(harmless);
}

#[cfg(test)]
mod tests {
    use std::net::UdpSocket;
    use std::time::Duration;

    use super::*;

    /// Sends a datagram through the filter; whether it comes out.
    fn passes(reach: &Reach, datagrams: &[Vec<u8>]) -> Vec<bool> {
        let receiver = UdpSocket::bind("127.0.0.1:0").unwrap();
        receiver.set_read_timeout(Some(Duration::from_millis(50))).unwrap();
        SockRef::from(&receiver).attach_filter(&filter(reach).unwrap()).unwrap();
        let sender = UdpSocket::bind("127.0.0.1:0").unwrap();
        let mut buffer = [0; 65536];
        let passes = |datagram: &Vec<u8>| {
            sender.send_to(datagram, receiver.local_addr().unwrap()).unwrap();
            receiver.recv(&mut buffer).is_ok_and(|length| buffer[..length] == datagram[..])
        };
        datagrams.iter().map(passes).collect()
    }

    fn submessage(kind: u32, little: bool, body: &[u8]) -> Vec<u8> {
        let length = body.len() as u16;
        let length = if little { length.to_le_bytes() } else { length.to_be_bytes() };
        [&[kind as u8, u8::from(little)][..], &length, body].concat()
    }

    fn datagram(submessages: &[Vec<u8>]) -> Vec<u8> {
        [&b"RTPS\x02\x03\x01\x12abcdefghijkl"[..], &submessages.concat()].concat()
    }

    /// Two sample numbers behind two identities, then a count.
    fn range(kind: u32, little: bool, first: i64, last: i64) -> Vec<u8> {
        let words = [(first >> 32) as u32, first as u32, (last >> 32) as u32, last as u32, 1];
        let word = |word: u32| if little { word.to_le_bytes() } else { word.to_be_bytes() };
        submessage(kind, little, &[&[0; 8][..], &words.map(word).concat()].concat())
    }

    fn fragment(little: bool, number: u32, size: u16, sample: u32) -> Vec<u8> {
        let word = |word: u32| if little { word.to_le_bytes() } else { word.to_be_bytes() };
        let half = |half: u16| if little { half.to_le_bytes() } else { half.to_be_bytes() };
        let body = [&[0; 20][..], &word(number), &half(1), &half(size), &word(sample), &[7; 8]].concat();
        submessage(DATA_FRAG, little, &body)
    }

    const LONG: i64 = 1 << 40;

    #[test]
    fn what_would_do_harm_is_dropped() {
        let data = submessage(0x15, true, &[0; 40]);
        let mut harmful = Vec::new();
        for little in [true, false] {
            let fragment_0 = submessage(NACK_FRAG, little, &[0; 28]);
            harmful.extend([
                fragment_0.clone(),
                [data.clone(), fragment_0].concat(),
                range(HEARTBEAT, little, 1, LONG),
                range(HEARTBEAT, little, 1, 1 << 20),
                range(HEARTBEAT, little, -1, LONG),
                range(GAP, little, 7, LONG),
                range(GAP, little, 7, 1 << 31),
                fragment(little, 1, 1000, u32::MAX),
                fragment(little, 1, 0, 1000),
                fragment(little, 0, 1000, 1000),
            ]);
        }
        let mut harmful: Vec<Vec<u8>> = harmful.into_iter().map(|submessage| datagram(&[submessage])).collect();
        // Behind another one, behind one without a length, and behind many others.
        harmful.push(datagram(&[range(HEARTBEAT, true, 1, 9), range(HEARTBEAT, false, 1, LONG)]));
        harmful.push(datagram(&[vec![PAD as u8, 1, 0, 0], range(HEARTBEAT, true, 1, LONG)]));
        harmful.push(datagram(&[vec![data.clone(); 20], vec![range(GAP, false, 7, LONG)]].concat()));
        harmful.push(b"RTPX\x02\x03\x01\x12abcdefghijkl".to_vec());
        // Behind more than can be looked into, in the smaller filter.
        let nack = submessage(NACK_FRAG, true, &[0; 28]);
        let fragment = fragment(true, 1, 1000, u32::MAX);
        let behind = |count: usize, last: &[u8]| {
            datagram(&[vec![range(HEARTBEAT, true, 1, 9); count], vec![last.to_vec()]].concat())
        };
        harmful.extend([behind(8, &nack), behind(8, &fragment)]);
        for reach in &REACHES {
            assert_eq!(passes(reach, &harmful), vec![false; harmful.len()]);
        }
        // And in the larger one, which also goes further from one to the next.
        let apart = std::iter::repeat_n([vec![range(HEARTBEAT, true, 1, 9)], vec![data; 11]].concat(), 8);
        let apart = apart.flatten().collect::<Vec<_>>();
        let behind = [
            datagram(&[apart, vec![range(GAP, true, 7, LONG)]].concat()),
            behind(8, &range(HEARTBEAT, true, 1, LONG)),
            behind(30, &nack),
            behind(30, &fragment),
        ];
        assert_eq!(passes(&REACHES[0], &behind), [false; 4]);
    }

    /// What the kernel makes of the filters fits into what it gives a socket, the smaller one before Linux 6.8 too.
    #[test]
    fn the_filters_fit_into_the_kernels_memory() {
        let [large, small] = REACHES.each_ref().map(|reach| program(reach).kernel_bytes());
        assert!(large < 120_000 && small < 20_000, "{large} and {small}");
    }

    #[test]
    fn what_is_used_passes() {
        let mut used = vec![datagram(&[])];
        for little in [true, false] {
            let data = submessage(0x15, little, &[0; 40]);
            let nack =
                [&[0; 16][..], &if little { 1_u32.to_le_bytes() } else { 1_u32.to_be_bytes() }, &[0; 12]].concat();
            used.extend([
                datagram(std::slice::from_ref(&data)),
                datagram(&[data.clone(), range(HEARTBEAT, little, 1, 65_000)]),
                datagram(&[range(HEARTBEAT, little, 70_000, 200_000)]),
                // Nothing is there, and nothing was.
                datagram(&[range(HEARTBEAT, little, 1, 0)]),
                datagram(&[range(HEARTBEAT, little, 65_537, 65_535)]),
                datagram(&[range(GAP, little, 1, LONG), range(GAP, little, 9, 12)]),
                datagram(&[fragment(little, 1, 1300, 4_000_000), range(HEARTBEAT, little, 1, 1)]),
                datagram(&[submessage(NACK_FRAG, little, &nack)]),
                // More than is gone over.
                datagram(&[vec![data.clone(); 90], vec![range(HEARTBEAT, little, 1, 80); 8]].concat()),
                // The last one may have no length.
                datagram(&[data, vec![0x15, u8::from(little), 0, 0, 1, 2, 3]]),
            ]);
        }
        for reach in &REACHES {
            assert_eq!(passes(reach, &used), vec![true; used.len()]);
        }
    }

    #[test]
    fn what_ros_2_sends_to_strangers_and_hurts_rustdds_is_dropped() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/rtps");
        let read = |name: &str| {
            let digits = std::fs::read_to_string(format!("{folder}/{name}.hex")).unwrap();
            let pairs = digits.trim().as_bytes().chunks(2);
            pairs.map(|pair| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap()).collect::<Vec<u8>>()
        };
        let harmful = ["03_nackfrag_base0_56B", "04_heartbeat_long_range_52B", "06_datafrag_4GiB_57B_any_prefix"];
        let others = ["01_garbage_cdr_any_topic_48B", "11_state_tick_2p62_216B", "12_sedp_stalled_reader_164B"];
        for reach in &REACHES {
            assert_eq!(passes(reach, &harmful.map(read)), [false; 3]);
            assert_eq!(passes(reach, &others.map(read)), [true; 3]);
        }
    }
}
