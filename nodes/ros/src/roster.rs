//! Who is there: the nodes of the domain, their endpoints, and which of them are matched with ours.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};

use ros2_client::Gid;
use rustdds::{DomainParticipantStatusEvent, EndpointDescription, LostReason, Timestamp};
use swath_msgs::rmw_dds_common::{self, NodeEntitiesInfo, ParticipantEntitiesInfo};

use crate::cdr::Cdr;
use crate::graph::{self, Entry};
use crate::guests::Guests;
use crate::members::{Identity, Members, Standing};
use crate::message::{decode, encode};
use crate::minder::{Minder, PROBE};
use crate::names::Names;
use crate::notices::{Notices, Trouble};
use crate::qos::is_reliable;
use crate::rtps::{Described, Prefix, prefix_of};
use crate::signal::lock;
use crate::slot::WriterSlot;

/// For how long after a node has shown itself another one of its name counts as one that came at the same time.
const TOGETHER: Duration = Duration::from_secs(2);

/// So many messages of a stranger's writer, and RustDDS is told to hear it no longer: those of members share their room
/// with them.
const STRANGE: u32 = 64;

/// Whether an endpoint writes or reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Direction {
    Write,
    Read,
}

/// What a node knows of itself and of the others.
pub(crate) struct Roster {
    names: Names,
    announcer: Arc<WriterSlot>,
    minder: Arc<Minder>,
    /// Whether this node belongs to a mission: then only members count and are waited for.
    member: bool,
    /// What went wrong with the messages of others.
    pub(crate) notices: Notices,
    state: Mutex<State>,
    changed: Condvar,
    /// Grows whenever it may have changed who counts.
    revision: AtomicU64,
}

struct State {
    /// This process.
    own: Gid,
    announced: Option<Instant>,
    readers: BTreeSet<Gid>,
    writers: BTreeSet<Gid>,
    /// What the table says of our endpoints.
    table: Vec<(Direction, Gid, Entry)>,
    /// Nodes of the other processes, by participant.
    nodes: BTreeMap<Gid, Vec<NodeEntitiesInfo>>,
    /// Remote endpoints matched with each of ours.
    matched: BTreeMap<Gid, BTreeSet<Gid>>,
    /// QoS disagreements, in words.
    refusals: BTreeSet<String>,
    members: Members,
    guests: Guests,
    /// Messages of strangers, by writer.
    strangers: BTreeMap<Gid, u32>,
    /// RustDDS's discovery has noted the minder's probe.
    probed: bool,
    /// A node of our name that was there first.
    yields_to: Option<Gid>,
}

impl Roster {
    /// `members` are those who count, if this node belongs to a mission (`member`).
    pub(crate) fn new(
        own: Gid,
        names: Names,
        announcer: Arc<WriterSlot>,
        minder: Arc<Minder>,
        members: Members,
        member: bool,
    ) -> Self {
        Self {
            names,
            announcer,
            minder,
            member,
            notices: Notices::default(),
            state: Mutex::new(State::new(own, members)),
            changed: Condvar::new(),
            revision: AtomicU64::new(0),
        }
    }

    /// This process has another participant, and its endpoints have other identities; what is known of the others is
    /// learnt again.
    pub(crate) fn renew(&self, own: Gid, gids: &BTreeMap<Gid, Gid>) {
        let renewed = |gid: &Gid| gids.get(gid).copied().unwrap_or(*gid);
        let mut state = lock(&self.state);
        let former = std::mem::replace(&mut *state, State::new(own, Members::default()));
        state.members = former.members;
        state.announced = Instant::now().checked_sub(TOGETHER); // It yields to nobody, least to its former self.
        state.readers = former.readers.iter().map(renewed).collect();
        state.writers = former.writers.iter().map(renewed).collect();
        state.table = former.table.iter().map(|(way, gid, entry)| (*way, renewed(gid), *entry)).collect();
        drop(state);
        self.note_change();
    }

    /// Lets the other processes know of this node, now and whenever its endpoints change.
    pub(crate) fn announce(&self) {
        let mut state = lock(&self.state);
        state.announced.get_or_insert_with(Instant::now);
        self.publish(&state);
    }

    /// Lets the other processes know that this node is gone.
    pub(crate) fn retire(&self) {
        let mut state = lock(&self.state);
        if state.announced.take().is_some() {
            self.send(state.own, Vec::new());
        }
    }

    pub(crate) fn enrol(&self, direction: Direction, gid: Gid) {
        self.change_own(direction, |gids| gids.insert(gid));
    }

    /// An endpoint of ours is one of the table.
    pub(crate) fn remember(&self, direction: Direction, gid: Gid, entry: Entry) {
        lock(&self.state).table.push((direction, gid, entry));
    }

    pub(crate) fn withdraw(&self, direction: Direction, gid: Gid) {
        lock(&self.state).table.retain(|(_, known, _)| *known != gid);
        self.change_own(direction, |gids| gids.remove(&gid));
    }

    fn change_own(&self, direction: Direction, change: impl FnOnce(&mut BTreeSet<Gid>) -> bool) {
        let mut state = lock(&self.state);
        let gids = match direction {
            Direction::Write => &mut state.writers,
            Direction::Read => &mut state.readers,
        };
        if change(gids) && state.announced.is_some() {
            self.publish(&state);
        }
    }

    fn publish(&self, state: &State) {
        let messages = |gids: &BTreeSet<Gid>| gids.iter().map(gid_msg).collect();
        let node = NodeEntitiesInfo {
            node_namespace: self.names.namespace().to_owned(),
            node_name: self.names.name().to_owned(),
            reader_gid_seq: messages(&state.readers),
            writer_gid_seq: messages(&state.writers),
        };
        self.send(state.own, vec![node]);
    }

    fn send(&self, own: Gid, node_entities_info_seq: Vec<NodeEntitiesInfo>) {
        let message = ParticipantEntitiesInfo { gid: gid_msg(&own), node_entities_info_seq };
        let sent = encode(&message).map(|cdr| self.announcer.write(cdr, Some(Timestamp::now()).into()));
        match sent {
            Ok(Ok(_)) => {}
            Ok(Err(error)) => tracing::warn!("the node could not be announced: {error}"),
            Err(error) => tracing::warn!("the node could not be announced: {error}"),
        }
    }

    /// Takes in what another process says of its nodes.
    pub(crate) fn note_nodes(&self, cdr: &Cdr) {
        match decode::<ParticipantEntitiesInfo>(cdr) {
            Ok(info) => {
                let participant = Gid::from(info.gid.data);
                let mut state = lock(&self.state);
                if participant != state.own {
                    self.mind_namesake(&mut state, participant, &info.node_entities_info_seq);
                    state.nodes.insert(participant, info.node_entities_info_seq);
                    drop(state);
                    self.note_change();
                }
            }
            Err(error) => tracing::debug!("another process announces its nodes wrongly: {error}"),
        }
    }

    /// Nodes that come later do not come up beside this one, if they are ours; those of others may, and are told of.
    fn mind_namesake(&self, state: &mut State, other: Gid, nodes: &[NodeEntitiesInfo]) {
        let name = self.names.fully_qualified();
        if !nodes.iter().any(|node| fully_qualified(node) == name) {
            return;
        }
        let Some(announced) = state.announced else { return };
        let ours = other.as_bytes()[..2] == state.own.as_bytes()[..2];
        if ours && other < state.own && announced.elapsed() < TOGETHER {
            state.yields_to = Some(other);
        } else if !state.nodes.contains_key(&other) {
            self.notices.note(Trouble::Namesake, &name, || "it came later, and does not count".to_owned());
        }
    }

    /// The kernel has not handed over so many datagrams.
    pub(crate) fn note_dropped(&self, count: u64) {
        let text = || "they would have ended DDS or filled the memory, or came faster than they were taken".to_owned();
        self.notices.note_several(Trouble::Dropped, &self.names.fully_qualified(), count, text);
    }

    /// RustDDS was started anew.
    pub(crate) fn note_renewal(&self, reason: &str) {
        self.notices.note(Trouble::Renewed, &self.names.fully_qualified(), || reason.to_owned());
    }

    /// Takes in who another process says that it is.
    pub(crate) fn note_identity(&self, sender: Gid, identity: Identity) {
        let process = prefix_of(sender);
        let mut state = lock(&self.state);
        if process == prefix_of(state.own) {
            return;
        }
        state.members.note(process, identity);
        self.settle_all(&mut state);
        drop(state);
        self.note_change();
    }

    /// Takes in what DDS has noticed.
    pub(crate) fn note_event(&self, event: DomainParticipantStatusEvent) {
        use DomainParticipantStatusEvent as Event;
        let mut state = lock(&self.state);
        match event {
            Event::ReaderDetected { reader } => self.note_reader(&mut state, reader),
            Event::RemoteReaderMatched { local_writer, remote_reader } => {
                state.match_up(local_writer.into(), remote_reader.into());
                self.settle(&mut state, remote_reader.into());
            }
            Event::RemoteWriterMatched { local_reader, remote_writer } => {
                state.match_up(local_reader.into(), remote_writer.into());
            }
            Event::ReaderLost { guid, .. } | Event::WriterLost { guid, .. } => state.lose(guid.into()),
            Event::ParticipantDiscovered { dpd } => {
                let own = prefix_of(state.own);
                state.members.find(prefix_of(dpd.guid.into()), self.member.then_some(own));
            }
            Event::ParticipantLost { id, reason } => {
                if matches!(reason, LostReason::Timeout { .. }) {
                    self.note_silence(&state, id.as_ref());
                }
                state.lose_participant(id.as_ref());
            }
            Event::RemoteReaderQosIncompatible { remote_reader, .. } => state.refuse(remote_reader.into(), "a reader"),
            Event::RemoteWriterQosIncompatible { remote_writer, .. } => state.refuse(remote_writer.into(), "a writer"),
            _ => return,
        }
        drop(state);
        self.note_change();
    }

    /// A process has not been heard for so long that its readers are served no longer. Those of members are missed by
    /// others.
    fn note_silence(&self, state: &State, process: &[u8]) {
        let served = state.guests.readers_of(process).find(|(gid, _)| state.is_matched(*gid));
        let Some((gid, topic)) = served.filter(|_| self.member) else { return };
        if state.members.name_of(prefix_of(gid)).is_none() {
            let of = state.node_of(&gid).unwrap_or_else(|| "an unknown process".to_owned());
            let text = || format!("{of} is silent, and served no longer");
            self.notices.note(Trouble::Lagging, topic.strip_prefix("rt").unwrap_or(topic), text);
        }
    }

    fn note_change(&self) {
        self.revision.fetch_add(1, Ordering::Release);
        self.changed.notify_all();
    }

    fn note_reader(&self, state: &mut State, reader: EndpointDescription) {
        if reader.topic_name == PROBE {
            state.probed = true;
            return;
        }
        let gid = Gid::from(reader.guid);
        if !self.member || prefix_of(gid) == prefix_of(state.own) {
            return;
        }
        let described = Described { gid, topic: reader.topic_name, type_name: reader.type_name };
        if state.guests.detect(described, is_reliable(&reader.qos)) && state.is_matched(gid) {
            self.settle(state, gid);
        }
    }

    /// Has our writers wait for this reader, or not.
    fn settle(&self, state: &mut State, reader: Gid) {
        let member = state.members.name_of(prefix_of(reader)).is_some();
        if let Some((described, claim)) = state.guests.settle(reader, member) {
            self.minder.say_of_reader(&described, claim);
        }
    }

    /// It may have changed who is a member.
    fn settle_all(&self, state: &mut State) {
        for reader in state.matched.values().flatten().copied().collect::<BTreeSet<_>>() {
            self.settle(state, reader);
        }
    }

    /// No longer waits for the readers of this writer of ours, which has waited for too long, and tells how many were
    /// let go.
    pub(crate) fn let_go_readers(&self, writer: Gid, topic: &str) -> usize {
        if !self.member {
            return 0;
        }
        let mut state = lock(&self.state);
        let mut let_go = 0;
        for reader in state.matched.get(&writer).cloned().unwrap_or_default() {
            if state.guests.let_go(reader) {
                let_go += 1;
                let of = state.node_of(&reader).unwrap_or_else(|| "an unknown process".to_owned());
                self.notices.note(Trouble::Lagging, topic, || format!("{of} is not waited for any longer"));
            }
            self.settle(&mut state, reader);
        }
        let_go
    }

    /// Whether what this writer writes counts, where only `writers` of the mission write; with it the revision up to
    /// which that holds.
    pub(crate) fn standing(&self, writer: Gid, writers: &[&str]) -> (Standing, u64) {
        let revision = self.revision();
        let process = prefix_of(writer);
        let mut state = lock(&self.state);
        if !self.member || process == prefix_of(state.own) {
            return (Standing::Counts, revision);
        }
        let announced: Vec<String> = state.nodes_of(process).map(fully_qualified).collect();
        (state.members.standing(process, &announced, writers, Instant::now()), revision)
    }

    /// Counts a message that does not count.
    pub(crate) fn note_stranger(&self, writer: Gid, topic: &str) {
        let text = || "their writer does not belong to the mission, they do not count".to_owned();
        // On topics of the whole domain others have their say.
        if topic.starts_with(&format!("{}/", self.names.namespace().trim_end_matches('/'))) {
            self.notices.note(Trouble::Stranger, topic, text);
        }
        let mut state = lock(&self.state);
        let count = state.strangers.entry(writer).or_default();
        *count += 1;
        if *count == STRANGE {
            state.strangers.remove(&writer);
            self.minder.dismiss_writer(writer);
        }
    }

    /// Grows whenever it may have changed who counts.
    pub(crate) fn revision(&self) -> u64 {
        self.revision.load(Ordering::Acquire)
    }

    /// Whether discovery has noted the minder's probe since this was last called.
    pub(crate) fn take_probed(&self) -> bool {
        std::mem::take(&mut lock(&self.state).probed)
    }

    /// Whether this endpoint of ours is matched with one of that process.
    pub(crate) fn is_matched_with(&self, own: Gid, process: Prefix) -> bool {
        let state = lock(&self.state);
        state.matched.get(&own).into_iter().flatten().any(|gid| prefix_of(*gid) == process)
    }

    pub(crate) fn matched(&self, own: Gid) -> Vec<Gid> {
        let state = lock(&self.state);
        state.matched.get(&own).into_iter().flatten().copied().collect()
    }

    /// Fully qualified names of all nodes of the other processes.
    pub(crate) fn nodes(&self) -> BTreeSet<String> {
        lock(&self.state).nodes.values().flatten().map(fully_qualified).collect()
    }

    /// Whether this node has to begin anew for one that was cut off and is there again.
    pub(crate) fn take_reunited(&self) -> bool {
        std::mem::take(&mut lock(&self.state).members.reunited)
    }

    /// How often each node of our namespace was started.
    pub(crate) fn epochs(&self) -> BTreeMap<String, u64> {
        lock(&self.state).members.epochs()
    }

    /// The participant of another process that has a node of our name.
    pub(crate) fn namesake(&self) -> Option<Gid> {
        let name = self.names.fully_qualified();
        let state = lock(&self.state);
        state
            .nodes
            .iter()
            .find(|(_, nodes)| nodes.iter().any(|node| fully_qualified(node) == name))
            .map(|(gid, _)| *gid)
    }

    /// Of two nodes with one name that came up together, tells whether ours has to go.
    pub(crate) fn must_yield(&self) -> bool {
        lock(&self.state).yields_to.is_some()
    }

    /// This node's writers on topics of the table.
    pub(crate) fn writers_of_table(&self) -> BTreeSet<Gid> {
        let state = lock(&self.state);
        let writers = state.table.iter().filter(|(direction, ..)| *direction == Direction::Write);
        writers.map(|(_, gid, _)| *gid).collect()
    }

    /// What is missing, in words, until these nodes (as the table names them) are matched on all topics that they have
    /// in common with this one.
    pub(crate) fn missing(&self, nodes: &[&str]) -> Vec<String> {
        let state = lock(&self.state);
        let there: BTreeSet<String> = state.nodes.values().flatten().map(fully_qualified).collect();
        let namespace = self.names.namespace().trim_end_matches('/');
        let mut missing = Vec::new();
        for node in nodes {
            let full = format!("{namespace}/{node}");
            if there.contains(&full) {
                missing.extend(state.unmatched(node, &full));
            } else {
                missing.push(format!("node {full} is not there"));
            }
        }
        if !missing.is_empty() {
            missing.extend(state.refusals.iter().cloned());
        }
        missing
    }

    /// Waits until the condition holds, and tells whether it does when the time is over.
    pub(crate) fn wait_until(&self, deadline: Instant, condition: impl Fn() -> bool) -> bool {
        loop {
            if condition() {
                return true;
            }
            let Some(remaining) = deadline.checked_duration_since(Instant::now()) else {
                return false;
            };
            // What is waited for may also change without a notification: look every so often.
            let slice = remaining.min(Duration::from_millis(50));
            let guard = lock(&self.state);
            drop(self.changed.wait_timeout(guard, slice).unwrap_or_else(PoisonError::into_inner));
        }
    }
}

impl State {
    fn new(own: Gid, members: Members) -> Self {
        Self {
            own,
            announced: None,
            readers: BTreeSet::new(),
            writers: BTreeSet::new(),
            table: Vec::new(),
            nodes: BTreeMap::new(),
            matched: BTreeMap::new(),
            refusals: BTreeSet::new(),
            members,
            guests: Guests::default(),
            strangers: BTreeMap::new(),
            probed: false,
            yields_to: None,
        }
    }

    fn match_up(&mut self, own: Gid, remote: Gid) {
        self.matched.entry(own).or_default().insert(remote);
    }

    fn is_matched(&self, remote: Gid) -> bool {
        self.matched.values().any(|matched| matched.contains(&remote))
    }

    /// The nodes of a process in the ROS graph.
    fn nodes_of(&self, process: Prefix) -> impl Iterator<Item = &NodeEntitiesInfo> {
        self.nodes.iter().filter(move |(gid, _)| prefix_of(**gid) == process).flat_map(|(_, nodes)| nodes)
    }

    fn lose(&mut self, remote: Gid) {
        self.guests.lose(remote);
        self.strangers.remove(&remote);
        for matched in self.matched.values_mut() {
            matched.remove(&remote);
        }
    }

    fn lose_participant(&mut self, prefix: &[u8]) {
        self.guests.lose_process(prefix);
        self.strangers.retain(|gid, _| !gid.as_bytes().starts_with(prefix));
        if let Ok(process) = prefix.try_into() {
            self.members.lose(process, Instant::now());
        }
        self.nodes.retain(|gid, _| !gid.as_bytes().starts_with(prefix));
        for matched in self.matched.values_mut() {
            matched.retain(|gid| !gid.as_bytes().starts_with(prefix));
        }
    }

    /// What a node that is there does not write or read yet.
    fn unmatched(&self, node: &str, full: &str) -> Vec<String> {
        let mut missing = Vec::new();
        for (direction, gid, entry) in &self.table {
            let (others, verb) = match direction {
                Direction::Write => (entry.readers, "read"),
                Direction::Read => (entry.writers, "write"),
            };
            let common = others.contains(&node) || (node == graph::RECORDER && *direction == Direction::Write);
            let matched = self.matched.get(gid).into_iter().flatten();
            if common && !matched.filter_map(|gid| self.node_of(gid)).any(|other| other == full) {
                missing.push(format!("{full} does not {verb} {}", entry.name));
            }
        }
        missing
    }

    fn refuse(&mut self, remote: Gid, what: &str) {
        let of = self.node_of(&remote).map_or(String::new(), |node| format!(" of {node}"));
        self.refusals.insert(format!("{what}{of} asks for another quality of service"));
    }

    fn node_of(&self, endpoint: &Gid) -> Option<String> {
        let endpoint = gid_msg(endpoint);
        self.nodes
            .values()
            .flatten()
            .find(|node| node.reader_gid_seq.contains(&endpoint) || node.writer_gid_seq.contains(&endpoint))
            .map(fully_qualified)
    }
}

fn fully_qualified(node: &NodeEntitiesInfo) -> String {
    format!("{}/{}", node.node_namespace.trim_end_matches('/'), node.node_name)
}

fn gid_msg(gid: &Gid) -> rmw_dds_common::Gid {
    rmw_dds_common::Gid { data: gid.to_bytes16() }
}
