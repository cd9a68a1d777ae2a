//! Which processes belong to the mission, and whose messages count.
//!
//! Each node tells the others who it is on a DDS topic beside the ROS graph. A node of the mission counts messages of
//! the writers that the table names only from processes that are members: they say the same namespace and fleet. Of
//! several that say the same name, the one with the highest epoch is the member, and among these the one heard last:
//! it replaces the others.

use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use crate::rtps::Prefix;

/// What a process says of itself.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Identity {
    pub(crate) namespace: String,
    pub(crate) node: String,
    /// What the launcher gave all nodes of the mission; empty without a launcher.
    pub(crate) fleet: String,
    /// How often the node was started in this mission.
    pub(crate) epoch: u64,
}

impl Identity {
    /// Whether this is a later start of the same node of a mission.
    pub(crate) fn replaces(&self, other: &Self) -> bool {
        let mission = |it: &Self| (it.namespace.clone(), it.fleet.clone(), it.node.clone());
        !self.fleet.is_empty() && mission(self) == mission(other) && self.epoch > other.epoch
    }
}

/// How long a process may take to say who it is.
pub(crate) const INTRODUCTION: Duration = Duration::from_secs(2);

/// Whether what a writer writes counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Standing {
    /// It does.
    Counts,
    /// Its process has not said yet who it is.
    Unknown,
    /// It is a stranger's.
    Stranger,
}

/// What is known of the others.
#[derive(Debug, Default)]
pub(crate) struct Members {
    namespace: String,
    fleet: String,
    /// Names of nodes, within the namespace, that are no nodes of ours but count.
    external: BTreeSet<String>,
    heard: BTreeMap<Prefix, Heard>,
    order: u64,
    /// When an unknown process was met first.
    met: BTreeMap<Prefix, Instant>,
    /// Processes that DDS has given up.
    lost: BTreeSet<Prefix>,
    /// One of them is there again, and it is this process that begins anew.
    pub(crate) reunited: bool,
}

/// A process that has said who it is.
#[derive(Debug)]
struct Heard {
    order: u64,
    identity: Identity,
    /// When it went; what it has sent before still counts.
    gone: Option<Instant>,
}

/// How long it is remembered who a process was that is gone.
const MEMORY: Duration = Duration::from_secs(600);

impl Members {
    pub(crate) fn new(namespace: &str, fleet: String, external: impl IntoIterator<Item = String>) -> Self {
        let external = external.into_iter().collect();
        Self { namespace: namespace.to_owned(), fleet, external, ..Self::default() }
    }

    /// Takes in what a process says of itself.
    pub(crate) fn note(&mut self, process: Prefix, identity: Identity) {
        self.met.remove(&process);
        if let Some(known) = self.heard.get_mut(&process).filter(|known| known.identity == identity) {
            // It was only out of sight, or repeats itself: that makes it no newcomer.
            known.gone = None;
            return;
        }
        self.order += 1;
        self.heard.insert(process, Heard { order: self.order, identity, gone: None });
    }

    /// A process is gone.
    pub(crate) fn lose(&mut self, process: Prefix, now: Instant) {
        self.met.remove(&process);
        if let Some(known) = self.heard.get_mut(&process) {
            known.gone = Some(now);
        }
        self.heard.retain(|_, known| known.gone.is_none_or(|gone| now.saturating_duration_since(gone) < MEMORY));
        self.lost.insert(process);
        self.lost.retain(|process| self.heard.contains_key(process));
    }

    /// DDS has found a process; `member` is this one, if it belongs to the mission.
    ///
    /// What one said that RustDDS gave up, it takes in no more, should that be there again after all: one of both has to
    /// begin anew. Who is no member does; of two members the one with the lesser identity.
    pub(crate) fn find(&mut self, process: Prefix, member: Option<Prefix>) {
        let again = self.lost.remove(&process);
        if again && member.is_none_or(|own| own < process && self.name_of(process).is_some()) {
            self.reunited = true;
            // To whoever begins anew they are all new.
            self.lost.clear();
        }
    }

    /// Name of the mission's node that this process is.
    pub(crate) fn name_of(&self, process: Prefix) -> Option<&str> {
        let known = self.heard.get(&process)?;
        if !self.is_ours(&known.identity) {
            return None;
        }
        let replaces = |other: &Heard| match other.identity.epoch.cmp(&known.identity.epoch) {
            // An earlier start never comes back.
            Ordering::Greater => true,
            Ordering::Equal => other.order > known.order && other.gone.is_none(),
            Ordering::Less => false,
        };
        let same = |other: &Heard| other.identity.node == known.identity.node && self.is_ours(&other.identity);
        let replaced = self.heard.values().any(|other| same(other) && replaces(other));
        (!replaced).then_some(known.identity.node.as_str())
    }

    /// How often each node of this namespace that is there was started, by what it says of itself.
    pub(crate) fn epochs(&self) -> BTreeMap<String, u64> {
        let mut epochs = BTreeMap::new();
        let here = self.heard.values().filter(|known| known.gone.is_none());
        for Identity { node, epoch, .. } in
            here.map(|known| &known.identity).filter(|identity| identity.namespace == self.namespace)
        {
            let latest = epochs.entry(node.clone()).or_insert(*epoch);
            *latest = (*epoch).max(*latest);
        }
        epochs
    }

    fn is_ours(&self, identity: &Identity) -> bool {
        identity.namespace == self.namespace && identity.fleet == self.fleet
    }

    /// Whether what this process writes counts, where `writers` of the mission write and nobody else.
    ///
    /// `announced` are the full names that its nodes have in the ROS graph.
    pub(crate) fn standing(
        &mut self,
        process: Prefix,
        announced: &[String],
        writers: &[&str],
        now: Instant,
    ) -> Standing {
        if let Some(name) = self.name_of(process) {
            return if writers.contains(&name) { Standing::Counts } else { Standing::Stranger };
        }
        let prefix = format!("{}/", self.namespace.trim_end_matches('/'));
        let external = |full: &String| {
            let name = full.strip_prefix(&prefix).unwrap_or_default();
            self.external.contains(name) && writers.contains(&name)
        };
        if announced.iter().any(external) {
            return Standing::Counts;
        }
        if self.heard.contains_key(&process) {
            return Standing::Stranger;
        }
        let met = *self.met.entry(process).or_insert(now);
        if now.saturating_duration_since(met) < INTRODUCTION { Standing::Unknown } else { Standing::Stranger }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn identity(node: &str, fleet: &str, epoch: u64) -> Identity {
        Identity { namespace: "/swath".to_owned(), node: node.to_owned(), fleet: fleet.to_owned(), epoch }
    }

    fn members() -> Members {
        Members::new("/swath", "f".to_owned(), ["navigator".to_owned()])
    }

    #[test]
    fn members_are_of_one_fleet_and_namespace() {
        let mut members = members();
        members.note([1; 12], identity("planner", "f", 0));
        members.note([2; 12], identity("guidance", "g", 0));
        members.note([3; 12], Identity { namespace: "/sat2".to_owned(), ..identity("guidance", "f", 0) });
        assert_eq!(members.name_of([1; 12]), Some("planner"));
        assert_eq!(members.name_of([2; 12]), None);
        assert_eq!(members.name_of([3; 12]), None);
        assert_eq!(members.name_of([4; 12]), None);
    }

    #[test]
    fn the_one_started_last_replaces_the_others() {
        let mut members = members();
        members.note([1; 12], identity("planner", "f", 0));
        members.note([2; 12], identity("planner", "f", 0));
        assert_eq!((members.name_of([1; 12]), members.name_of([2; 12])), (None, Some("planner")));
        // Of an earlier start, though it is heard later: it was asleep.
        members.note([3; 12], identity("planner", "f", 1));
        members.note([4; 12], identity("planner", "f", 0));
        assert_eq!(members.name_of([3; 12]), Some("planner"));
        assert_eq!(members.name_of([4; 12]), None);
        assert_eq!(members.epochs(), BTreeMap::from([("planner".to_owned(), 1)]));
        // Another fleet's replaces nobody, and one that repeats itself is not heard later for that.
        members.note([5; 12], identity("planner", "g", 9));
        members.note([1; 12], identity("planner", "f", 0));
        assert_eq!(members.name_of([3; 12]), Some("planner"));
        // What one that is gone has sent still counts, unless another one has taken its place.
        members.lose([3; 12], Instant::now());
        assert_eq!(members.name_of([4; 12]), None);
        members.note([6; 12], identity("planner", "f", 2));
        assert_eq!(members.name_of([3; 12]), None);
        members.lose([6; 12], Instant::now());
        assert_eq!(members.name_of([6; 12]), Some("planner"));
        // One that was out of sight is no newcomer.
        members.note([7; 12], identity("planner", "f", 2));
        members.note([8; 12], identity("planner", "f", 2));
        members.lose([7; 12], Instant::now());
        members.note([7; 12], identity("planner", "f", 2));
        assert_eq!(members.name_of([7; 12]), None);
        assert_eq!(members.name_of([8; 12]), Some("planner"));
        members.lose([1; 12], Instant::now() + 2 * MEMORY);
        assert!(!members.heard.contains_key(&[6; 12]));
    }

    #[test]
    fn after_a_cut_one_of_both_begins_anew() {
        let cut = |own: Option<Prefix>, node: &str, fleet: &str| {
            let mut members = members();
            members.note([5; 12], identity(node, fleet, 0));
            members.note([6; 12], identity(node, fleet, 1));
            members.find([5; 12], own);
            assert!(!members.reunited, "it was there all the time");
            members.lose([5; 12], Instant::now());
            members.lose([6; 12], Instant::now());
            members.find([6; 12], own);
            let reunited = std::mem::take(&mut members.reunited);
            members.find([6; 12], own);
            assert!(!members.reunited, "once");
            reunited
        };
        assert!(cut(None, "planner", "g"), "who looks on from outside");
        assert!(cut(Some([1; 12]), "planner", "f"));
        assert!(!cut(Some([9; 12]), "planner", "f"), "the other one does");
        assert!(!cut(Some([1; 12]), "planner", "g"), "no stranger makes a mission begin anew");
    }

    #[test]
    fn a_later_start_of_the_same_node_of_the_same_mission_replaces_it() {
        let own = identity("planner", "f", 1);
        assert!(identity("planner", "f", 2).replaces(&own));
        for other in [identity("planner", "f", 1), identity("planner", "g", 2), identity("guidance", "f", 2)] {
            assert!(!other.replaces(&own), "{other:?}");
        }
        assert!(!identity("planner", "", 2).replaces(&identity("planner", "", 1)), "there is no mission");
    }

    #[test]
    fn messages_count_from_the_writers_of_the_table() {
        let mut members = members();
        let now = Instant::now();
        members.note([1; 12], identity("planner", "f", 0));
        members.note([2; 12], identity("planner", "", 0));
        let mut standing = |process: Prefix, announced: &[&str], writers: &[&str], after| {
            let announced: Vec<_> = announced.iter().map(|name| (*name).to_owned()).collect();
            members.standing(process, &announced, writers, now + after)
        };
        let zero = Duration::ZERO;
        assert_eq!(standing([1; 12], &[], &["planner"], zero), Standing::Counts);
        assert_eq!(standing([1; 12], &[], &["guidance"], zero), Standing::Stranger);
        assert_eq!(standing([2; 12], &["/swath/planner"], &["planner"], zero), Standing::Stranger);
        assert_eq!(standing([3; 12], &["/swath/planner"], &["planner"], zero), Standing::Unknown);
        assert_eq!(standing([3; 12], &[], &["planner"], INTRODUCTION), Standing::Stranger);
        assert_eq!(standing([4; 12], &["/swath/navigator"], &["navigator"], zero), Standing::Counts);
        assert_eq!(standing([4; 12], &["/swath/navigator"], &["planner"], INTRODUCTION), Standing::Unknown);
        assert_eq!(standing([5; 12], &["/navigator"], &["navigator"], zero), Standing::Unknown);
    }
}
