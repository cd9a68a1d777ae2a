//! The reliable readers of other processes, and whether our writers wait for them.

use std::collections::BTreeMap;

use ros2_client::Gid;

use crate::rtps::{Claim, Described};

/// Readers that ask for reliability, by identity.
#[derive(Debug, Default)]
pub(crate) struct Guests {
    readers: BTreeMap<Gid, Reader>,
}

#[derive(Debug)]
struct Reader {
    described: Described,
    /// What RustDDS believes of it.
    claim: Claim,
    /// It has lagged, and is not waited for again.
    let_go: bool,
}

impl Guests {
    /// Discovery describes a reader. Tells whether that changes what RustDDS believes of it, other than by our doing.
    pub(crate) fn detect(&mut self, described: Described, reliable: bool) -> bool {
        let claim = if reliable { Claim::Reliable } else { Claim::BestEffort };
        match self.readers.get_mut(&described.gid) {
            Some(known) if known.claim == claim => false,
            Some(known) => {
                known.claim = claim;
                reliable
            }
            None if reliable => {
                let gid = described.gid;
                self.readers.insert(gid, Reader { described, claim, let_go: false });
                true
            }
            None => false,
        }
    }

    /// What RustDDS has to be told of this reader, if anything: it is waited for if it is a member's and has not lagged.
    pub(crate) fn settle(&mut self, gid: Gid, member: bool) -> Option<(Described, Claim)> {
        let reader = self.readers.get_mut(&gid)?;
        let claim = if member && !reader.let_go { Claim::Reliable } else { Claim::BestEffort };
        (reader.claim != claim).then(|| {
            reader.claim = claim;
            (reader.described.clone(), claim)
        })
    }

    /// From now on this reader is not waited for; tells whether it was.
    pub(crate) fn let_go(&mut self, gid: Gid) -> bool {
        self.readers.get_mut(&gid).is_some_and(|reader| {
            reader.let_go = true;
            reader.claim == Claim::Reliable
        })
    }

    /// The readers of this process, and their topics in DDS.
    pub(crate) fn readers_of<'a>(&'a self, process: &'a [u8]) -> impl Iterator<Item = (Gid, &'a str)> {
        let own = self.readers.iter().filter(move |(gid, _)| gid.as_bytes().starts_with(process));
        own.map(|(gid, reader)| (*gid, reader.described.topic.as_str()))
    }

    pub(crate) fn lose(&mut self, gid: Gid) {
        self.readers.remove(&gid);
    }

    pub(crate) fn lose_process(&mut self, process: &[u8]) {
        self.readers.retain(|gid, _| !gid.as_bytes().starts_with(process));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn described(number: u8) -> Described {
        Described { gid: Gid::from([number; 16]), topic: "rt/a".to_owned(), type_name: "T".to_owned() }
    }

    fn claim_of(told: Option<(Described, Claim)>) -> Option<Claim> {
        told.map(|(_, claim)| claim)
    }

    #[test]
    fn only_members_are_waited_for() {
        let mut guests = Guests::default();
        let gid = described(1).gid;
        assert!(guests.detect(described(1), true));
        assert_eq!(claim_of(guests.settle(gid, false)), Some(Claim::BestEffort));
        assert_eq!(guests.settle(gid, false), None);
        // What RustDDS believes because we said so comes back as news, and is none.
        assert!(!guests.detect(described(1), false));
        assert_eq!(claim_of(guests.settle(gid, true)), Some(Claim::Reliable));
        assert!(!guests.detect(described(1), true));
        assert_eq!(guests.settle(gid, true), None);
    }

    #[test]
    fn a_reader_that_is_announced_again_is_settled_again() {
        let mut guests = Guests::default();
        let gid = described(1).gid;
        guests.detect(described(1), true);
        guests.settle(gid, false);
        assert!(guests.detect(described(1), true));
        assert_eq!(claim_of(guests.settle(gid, false)), Some(Claim::BestEffort));
    }

    #[test]
    fn one_that_lagged_is_not_waited_for_again() {
        let mut guests = Guests::default();
        let gid = described(1).gid;
        guests.detect(described(1), true);
        assert!(guests.let_go(gid));
        assert_eq!(claim_of(guests.settle(gid, true)), Some(Claim::BestEffort));
        assert!(!guests.let_go(gid));
        assert_eq!(guests.settle(gid, true), None);
        guests.lose(gid);
        assert!(guests.detect(described(1), true));
        assert_eq!(guests.settle(gid, true), None);
    }

    #[test]
    fn those_who_do_not_ask_for_reliability_are_left_alone() {
        let mut guests = Guests::default();
        assert!(!guests.detect(described(1), false));
        assert_eq!(guests.settle(described(1).gid, false), None);
    }
}
