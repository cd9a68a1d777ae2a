//! Tells this process's RustDDS, in datagrams of discovery, what its interface has no words for, and asks whether it
//! still hears and speaks.
//!
//! A minder is a participant that nobody but this process's RustDDS knows: it has one socket on the loopback
//! interface. RustDDS takes what a participant says of another one's endpoints, so the minder can say that a reader
//! does without what it misses, and RustDDS's writers wait for it no longer.

use std::io::ErrorKind;
use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::sync::Mutex;

use rustdds::{DomainParticipant, RTPSEntity as _};

use crate::endpoint::Gid;
use crate::error::RosError;
use crate::rtps::{Claim, Datagram, Described, Prefix, READERS_WRITER, WRITERS_WRITER, acknowledges};
use crate::signal::lock;

/// The topic of a reader that the minder announces to see whether discovery is at work; nobody writes it.
pub(crate) const PROBE: &str = "swath_probe";

/// The largest datagram that RustDDS sends to a minder is some hundred bytes.
const RECEIVE_BUFFER: usize = 2048;

/// The participant that only this process's RustDDS knows.
pub(crate) struct Minder {
    socket: UdpSocket,
    port: u16,
    prefix: Prefix,
    rustdds: Gid,
    /// Where RustDDS listens to discovery.
    discovery: SocketAddr,
    said: Mutex<Said>,
}

/// How much has been said.
#[derive(Default)]
struct Said {
    of_readers: u32,
    of_writers: u32,
    heartbeats: u32,
}

impl Minder {
    /// A minder of this participant, which has made itself known to it.
    ///
    /// # Errors
    /// If there is no socket for it.
    pub(crate) fn new(participant: &DomainParticipant) -> Result<Self, RosError> {
        let failed = |source| RosError::System { what: "no socket on the loopback interface", source };
        let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).map_err(failed)?;
        socket.set_nonblocking(true).map_err(failed)?;
        let port = socket.local_addr().map_err(failed)?.port();
        let rustdds = Gid::from(participant.guid());
        // The same process, but no identity that RustDDS gives: those count up from zero.
        let mut prefix = rustdds.prefix();
        prefix[11] ^= 0xff;
        prefix[10] ^= 0xff;
        let discovery = discovery_port(participant.domain_id(), participant.participant_id());
        let discovery = SocketAddr::from((Ipv4Addr::LOCALHOST, discovery));
        let minder = Self { socket, port, prefix, rustdds, discovery, said: Mutex::default() };
        minder.announce();
        Ok(minder)
    }

    /// Makes itself known to RustDDS.
    pub(crate) fn announce(&self) {
        self.send(&Datagram::from(self.prefix).participant(self.prefix, self.port));
    }

    /// Says of another participant's reader what `claim` says.
    pub(crate) fn say_of_reader(&self, reader: &Described, claim: Claim) {
        let mut said = lock(&self.said);
        said.of_readers += 1;
        let number = said.of_readers;
        let start = self.heartbeat(READERS_WRITER, &mut said, number);
        self.send(&start.reader(reader, claim, number));
    }

    /// Says that another participant's writer is gone.
    pub(crate) fn dismiss_writer(&self, writer: Gid) {
        let mut said = lock(&self.said);
        said.of_writers += 1;
        let number = said.of_writers;
        let start = self.heartbeat(WRITERS_WRITER, &mut said, number);
        self.send(&start.writer_gone(writer, number));
    }

    /// Nothing before this number is to be waited for: what was lost on the way does not hold up what comes.
    fn heartbeat(&self, writer: [u8; 4], said: &mut Said, number: u32) -> Datagram {
        said.heartbeats += 1;
        Datagram::from(self.prefix).heartbeat(writer, number, number, said.heartbeats)
    }

    /// Asks RustDDS for a sign of life: an acknowledgement from its event loop, and that its discovery notes the
    /// reader of [`PROBE`].
    pub(crate) fn ask(&self) {
        let gid = Gid([&self.prefix[..], &[0, 0, 1, 4]].concat().try_into().unwrap_or_default());
        let probe = Described { gid, topic: PROBE.to_owned(), type_name: PROBE.to_owned() };
        self.say_of_reader(&probe, Claim::BestEffort);
    }

    /// Whether RustDDS has acknowledged anything since this was last called.
    pub(crate) fn acknowledged(&self) -> bool {
        let mut buffer = [0; RECEIVE_BUFFER];
        let mut acknowledged = false;
        loop {
            match self.socket.recv(&mut buffer) {
                Ok(length) => acknowledged |= acknowledges(&buffer[..length], &self.rustdds.prefix()),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                // Nothing more, or nobody listens over there: then nothing is acknowledged.
                Err(_) => return acknowledged,
            }
        }
    }

    fn send(&self, datagram: &Datagram) {
        if let Err(error) = self.socket.send_to(datagram.bytes(), self.discovery) {
            tracing::debug!("RustDDS cannot be told: {error}");
        }
    }
}

/// Where a participant listens to discovery, by the rules of RTPS (9.6.1.1).
fn discovery_port(domain: u16, participant: u16) -> u16 {
    7410 + 250 * domain + 2 * participant
}
