//! Tells this process's RustDDS, in datagrams of discovery, what its interface has no words for, and asks whether it
//! still hears and speaks.
//!
//! A minder is a participant that nobody but this process's RustDDS knows: it has one socket on the loopback
//! interface. RustDDS takes what a participant says of another one's endpoints, so the minder can say that a reader
//! does without what it misses, and RustDDS's writers wait for it no longer.

use std::io::ErrorKind;
use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::sync::Mutex;

use ros2_client::Gid;
use rustdds::{DomainParticipant, RTPSEntity as _};

use crate::error::RosError;
use crate::rtps::{
    Claim, Datagram, Described, EntityId, Prefix, READERS_WRITER, WRITERS_WRITER, acknowledges, prefix_of,
};
use crate::signal::lock;

/// The topic of a reader that the minder announces to see whether discovery is at work; nobody writes it.
pub(crate) const PROBE: &str = "swath_probe";

/// The largest datagram that RustDDS sends to a minder is some hundred bytes.
const RECEIVE_BUFFER: usize = 2048;

/// The participant that only this process's RustDDS knows.
pub(crate) struct Minder {
    socket: UdpSocket,
    port: u16,
    talk: Mutex<Talk>,
}

/// With whom it talks, as whom, and how much has been said.
struct Talk {
    rustdds: Prefix,
    own: Prefix,
    /// Where RustDDS listens to discovery.
    discovery: SocketAddr,
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
        let minder = Self { socket, port, talk: Mutex::new(Talk::with(participant)) };
        minder.announce();
        Ok(minder)
    }

    /// This process has another participant.
    pub(crate) fn turn_to(&self, participant: &DomainParticipant) {
        *lock(&self.talk) = Talk::with(participant);
        self.announce();
    }

    /// Makes itself known to RustDDS.
    pub(crate) fn announce(&self) {
        let talk = lock(&self.talk);
        self.send(&talk, &Datagram::from(talk.own).participant(talk.own, self.port));
    }

    /// Says of another participant's reader what `claim` says.
    pub(crate) fn say_of_reader(&self, reader: &Described, claim: Claim) {
        self.say(&mut lock(&self.talk), reader, claim);
    }

    fn say(&self, talk: &mut Talk, reader: &Described, claim: Claim) {
        talk.of_readers += 1;
        let number = talk.of_readers;
        let datagram = talk.start(READERS_WRITER, number).reader(reader, claim, number);
        self.send(talk, &datagram);
    }

    /// Says that another participant's writer is gone.
    pub(crate) fn dismiss_writer(&self, writer: Gid) {
        let mut talk = lock(&self.talk);
        talk.of_writers += 1;
        let number = talk.of_writers;
        let datagram = talk.start(WRITERS_WRITER, number).writer_gone(writer, number);
        self.send(&talk, &datagram);
    }

    /// Asks RustDDS for a sign of life: an acknowledgement from its event loop, and that its discovery notes the
    /// reader of [`PROBE`].
    pub(crate) fn ask(&self) {
        let mut talk = lock(&self.talk);
        let mut gid = [0; 16];
        gid[..12].copy_from_slice(&talk.own);
        gid[12..].copy_from_slice(&[0, 0, 1, 4]);
        let probe = Described { gid: gid.into(), topic: PROBE.to_owned(), type_name: PROBE.to_owned() };
        self.say(&mut talk, &probe, Claim::BestEffort);
    }

    /// Whether RustDDS has acknowledged anything since this was last called.
    pub(crate) fn acknowledged(&self) -> bool {
        let rustdds = lock(&self.talk).rustdds;
        let mut buffer = [0; RECEIVE_BUFFER];
        let mut acknowledged = false;
        loop {
            match self.socket.recv(&mut buffer) {
                Ok(length) => acknowledged |= acknowledges(&buffer[..length], &rustdds),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                // Nothing more, or nobody listens over there: then nothing is acknowledged.
                Err(_) => return acknowledged,
            }
        }
    }

    fn send(&self, talk: &Talk, datagram: &Datagram) {
        if let Err(error) = self.socket.send_to(datagram.bytes(), talk.discovery) {
            tracing::debug!("RustDDS cannot be told: {error}");
        }
    }
}

impl Talk {
    fn with(participant: &DomainParticipant) -> Self {
        let rustdds = prefix_of(participant.guid().into());
        // Of the same process, but no identity that RustDDS gives: those are drawn at random.
        let mut own = rustdds;
        own[10] ^= 0xff;
        own[11] ^= 0xff;
        let port = discovery_port(participant.domain_id(), participant.participant_id());
        let discovery = SocketAddr::from((Ipv4Addr::LOCALHOST, port));
        Self { rustdds, own, discovery, of_readers: 0, of_writers: 0, heartbeats: 0 }
    }

    /// Nothing before this number is to be waited for: what was lost on the way does not hold up what comes.
    fn start(&mut self, writer: EntityId, number: u32) -> Datagram {
        self.heartbeats += 1;
        Datagram::from(self.own).heartbeat(writer, number, number, self.heartbeats)
    }
}

/// Where a participant listens to discovery, by the rules of RTPS (9.6.1.1).
fn discovery_port(domain: u16, participant: u16) -> u16 {
    7410 + 250 * domain + 2 * participant
}
