//! Who is there: the nodes of the domain, their endpoints, and which of them are matched with ours.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};

use rustdds::no_key::DataWriter;
use rustdds::{DomainParticipantStatusEvent, Timestamp};
use swath_msgs::rmw_dds_common::{self, NodeEntitiesInfo, ParticipantEntitiesInfo};

use crate::endpoint::{Adapter, Cdr, Gid};
use crate::message::{decode, encode};
use crate::names::Names;
use crate::signal::lock;

/// Whether an endpoint writes or reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Direction {
    Write,
    Read,
}

/// What a node knows of itself and of the others.
pub(crate) struct Roster {
    own: Gid,
    names: Names,
    announcer: DataWriter<Cdr, Adapter>,
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Default)]
struct State {
    announced: bool,
    readers: BTreeSet<Gid>,
    writers: BTreeSet<Gid>,
    /// Nodes of the other processes, by participant.
    nodes: BTreeMap<Gid, Vec<NodeEntitiesInfo>>,
    /// Remote endpoints matched with each of ours.
    matched: BTreeMap<Gid, BTreeSet<Gid>>,
    /// QoS disagreements, in words.
    refusals: BTreeSet<String>,
}

impl Roster {
    pub(crate) fn new(own: Gid, names: Names, announcer: DataWriter<Cdr, Adapter>) -> Self {
        Self { own, names, announcer, state: Mutex::default(), changed: Condvar::new() }
    }

    /// Lets the other processes know of this node, now and whenever its endpoints change.
    pub(crate) fn announce(&self) {
        let mut state = lock(&self.state);
        state.announced = true;
        self.publish(&state);
    }

    /// Lets the other processes know that this node is gone.
    pub(crate) fn retire(&self) {
        let mut state = lock(&self.state);
        if state.announced {
            state.announced = false;
            self.send(Vec::new());
        }
    }

    pub(crate) fn enrol(&self, direction: Direction, gid: Gid) {
        self.change_own(direction, |gids| gids.insert(gid));
    }

    pub(crate) fn withdraw(&self, direction: Direction, gid: Gid) {
        self.change_own(direction, |gids| gids.remove(&gid));
    }

    /// Whether this endpoint of ours still exists.
    pub(crate) fn is_enrolled(&self, direction: Direction, gid: Gid) -> bool {
        let state = lock(&self.state);
        match direction {
            Direction::Write => state.writers.contains(&gid),
            Direction::Read => state.readers.contains(&gid),
        }
    }

    fn change_own(&self, direction: Direction, change: impl FnOnce(&mut BTreeSet<Gid>) -> bool) {
        let mut state = lock(&self.state);
        let gids = match direction {
            Direction::Write => &mut state.writers,
            Direction::Read => &mut state.readers,
        };
        if change(gids) && state.announced {
            self.publish(&state);
        }
    }

    fn publish(&self, state: &State) {
        let messages = |gids: &BTreeSet<Gid>| gids.iter().map(gid_msg).collect();
        self.send(vec![NodeEntitiesInfo {
            node_namespace: self.names.namespace().to_owned(),
            node_name: self.names.name().to_owned(),
            reader_gid_seq: messages(&state.readers),
            writer_gid_seq: messages(&state.writers),
        }]);
    }

    fn send(&self, node_entities_info_seq: Vec<NodeEntitiesInfo>) {
        let message = ParticipantEntitiesInfo { gid: gid_msg(&self.own), node_entities_info_seq };
        let sent = encode(&message).map(|cdr| self.announcer.write(cdr, Some(Timestamp::now())));
        match sent {
            Ok(Ok(())) => {}
            Ok(Err(error)) => tracing::warn!("the node could not be announced: {error}"),
            Err(error) => tracing::warn!("the node could not be announced: {error}"),
        }
    }

    /// Takes in what another process says of its nodes.
    pub(crate) fn note_nodes(&self, cdr: &Cdr) {
        match decode::<ParticipantEntitiesInfo>(cdr) {
            Ok(info) => {
                let participant = Gid(info.gid.data);
                if participant != self.own {
                    lock(&self.state).nodes.insert(participant, info.node_entities_info_seq);
                    self.changed.notify_all();
                }
            }
            Err(error) => tracing::debug!("another process announces its nodes wrongly: {error}"),
        }
    }

    /// Takes in what DDS has noticed.
    pub(crate) fn note_event(&self, event: DomainParticipantStatusEvent) {
        use DomainParticipantStatusEvent as Event;
        let mut state = lock(&self.state);
        match event {
            Event::RemoteReaderMatched { local_writer, remote_reader } => {
                state.match_up(local_writer.into(), remote_reader.into());
            }
            Event::RemoteWriterMatched { local_reader, remote_writer } => {
                state.match_up(local_reader.into(), remote_writer.into());
            }
            Event::ReaderLost { guid, .. } | Event::WriterLost { guid, .. } => {
                state.lose(guid.into());
            }
            Event::ParticipantLost { id, .. } => state.lose_participant(id.as_ref()),
            Event::RemoteReaderQosIncompatible { remote_reader, .. } => {
                state.refuse(remote_reader.into(), "a reader");
            }
            Event::RemoteWriterQosIncompatible { remote_writer, .. } => {
                state.refuse(remote_writer.into(), "a writer");
            }
            _ => return,
        }
        drop(state);
        self.changed.notify_all();
    }

    pub(crate) fn matched(&self, own: Gid) -> Vec<Gid> {
        let state = lock(&self.state);
        state.matched.get(&own).into_iter().flatten().copied().collect()
    }

    /// Fully qualified names of the nodes that own the remote endpoints matched with ours.
    pub(crate) fn matched_nodes(&self, own: Gid) -> BTreeSet<String> {
        let state = lock(&self.state);
        let matched = state.matched.get(&own);
        matched.into_iter().flatten().filter_map(|gid| state.node_of(gid)).collect()
    }

    /// Fully qualified names of all nodes of the other processes.
    pub(crate) fn nodes(&self) -> BTreeSet<String> {
        lock(&self.state).nodes.values().flatten().map(fully_qualified).collect()
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
        self.namesake().is_some_and(|other| other < self.own)
    }

    pub(crate) fn refusals(&self) -> Vec<String> {
        lock(&self.state).refusals.iter().cloned().collect()
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
    fn match_up(&mut self, own: Gid, remote: Gid) {
        self.matched.entry(own).or_default().insert(remote);
    }

    fn lose(&mut self, remote: Gid) {
        for matched in self.matched.values_mut() {
            matched.remove(&remote);
        }
    }

    fn lose_participant(&mut self, prefix: &[u8]) {
        self.nodes.retain(|gid, _| !gid.0.starts_with(prefix));
        for matched in self.matched.values_mut() {
            matched.retain(|gid| !gid.0.starts_with(prefix));
        }
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
    rmw_dds_common::Gid { data: gid.0 }
}
