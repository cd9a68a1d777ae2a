//! What one end has received of a class: items go on in the order of their numbers, each once.

use std::collections::BTreeMap;

use super::frame::{Item, Received};

/// Most items that wait for one before them.
const EARLY_MAX: usize = 1 << 16;
/// Most gaps that a frame tells of.
const GAPS_MAX: usize = 128;

/// What has come of a class.
#[derive(Clone, Debug, Default)]
pub(super) struct Inbox {
    /// Number of the next item that goes on.
    next: u64,
    /// Items that wait for one before them.
    early: BTreeMap<u64, Item>,
}

impl Inbox {
    /// An inbox that has handed on all items below `next`.
    pub(super) fn restored(next: u64) -> Self {
        Self { next, early: BTreeMap::new() }
    }

    /// Number of the next item that goes on.
    pub(super) fn next(&self) -> u64 {
        self.next
    }

    /// An item has come.
    pub(super) fn put(&mut self, number: u64, item: Item) {
        if number >= self.next && number - self.next < EARLY_MAX as u64 {
            self.early.entry(number).or_insert(item);
        }
    }

    /// The next item, if it is there.
    pub(super) fn take(&mut self) -> Option<Item> {
        let item = self.early.remove(&self.next)?;
        self.next += 1;
        Some(item)
    }

    /// What is told to the other end.
    pub(super) fn received(&self) -> Received {
        let mut received = Received { next: self.next, beyond: Vec::new() };
        let mut end = self.next;
        for &number in self.early.keys() {
            let full = received.beyond.len() == GAPS_MAX;
            match received.beyond.last_mut() {
                Some((_, there)) if number == end => *there += 1,
                _ if full => break,
                _ => received.beyond.push((number - end, 1)),
            }
            end = number + 1;
        }
        received
    }
}
