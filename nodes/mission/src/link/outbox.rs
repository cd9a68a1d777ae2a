//! What one end has to send of a class: each item has a number and stays until the other end has acknowledged it.

use std::collections::{BTreeSet, VecDeque};

use super::frame::{Item, Part, Received};

/// Where an item stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// It was never sent, or is taken for lost.
    Waits,
    /// It was sent then [ticks on the air], and may have arrived.
    Sent(u64),
    /// The other end said then that it has it [ticks on the air]; it may lose what waits there for an item before it.
    Arrived(u64),
}

#[derive(Clone, Debug)]
struct Slot {
    item: Item,
    stage: Stage,
}

/// Items of a class that have not all arrived, in the order of their numbers.
#[derive(Clone, Debug, Default)]
pub(super) struct Outbox {
    /// Number of the first.
    base: u64,
    slots: VecDeque<Slot>,
    /// Number of the first that was never sent.
    fresh: u64,
    /// Items that were sent and are taken for lost.
    lost: BTreeSet<u64>,
    /// Items that were sent, in the order of their sending: when [ticks on the air], number.
    timers: VecDeque<(u64, u64)>,
    /// Sum of what was sent and may still arrive [bit].
    under_way: u64,
}

impl Outbox {
    /// Items that were written down, from number `base` on; what became of them is not known.
    pub(super) fn restored(base: u64, items: impl IntoIterator<Item = Item>) -> Self {
        let slots = items.into_iter().map(|item| Slot { item, stage: Stage::Waits }).collect();
        Self { base, slots, fresh: base, ..Self::default() }
    }

    /// Adds an item, and returns its number.
    pub(super) fn push(&mut self, item: Item) -> u64 {
        self.slots.push_back(Slot { item, stage: Stage::Waits });
        self.end() - 1
    }

    /// Number of the first item that is not known to have arrived.
    pub(super) fn base(&self) -> u64 {
        self.base
    }

    /// Number of the next item that comes.
    pub(super) fn end(&self) -> u64 {
        self.base + self.slots.len() as u64
    }

    /// Number of the first item that was never sent.
    pub(super) fn fresh(&self) -> u64 {
        self.fresh
    }

    /// Sum of what was sent and may still arrive [bit].
    pub(super) fn under_way(&self) -> u64 {
        self.under_way
    }

    /// Items that have not arrived, in the order of their numbers.
    pub(super) fn items(&self) -> impl Iterator<Item = &Item> {
        self.slots.iter().map(|slot| &slot.item)
    }

    fn slot(&mut self, number: u64) -> Option<&mut Slot> {
        self.slots.get_mut(usize::try_from(number.checked_sub(self.base)?).ok()?)
    }

    /// Items of which nothing was heard for `patience` are taken for lost [ticks on the air].
    pub(super) fn expire(&mut self, now: u64, patience: u64) {
        let until = now.saturating_sub(patience);
        while let Some((sent, number)) = self.timers.pop_front_if(|(sent, _)| *sent <= until) {
            let Some(slot) = self.slot(number) else { continue };
            let bits = slot.item.bits();
            match slot.stage {
                Stage::Sent(last) if last == sent => self.under_way -= bits,
                Stage::Arrived(heard) if heard <= until => {}
                Stage::Arrived(_) => {
                    self.timers.push_back((now, number));
                    continue;
                }
                Stage::Sent(_) | Stage::Waits => continue,
            }
            if let Some(slot) = self.slot(number) {
                slot.stage = Stage::Waits;
            }
            self.lost.insert(number);
        }
    }

    /// The other end tells what it has. What it has handed on is gone from here.
    pub(super) fn acknowledge(&mut self, now: u64, received: &Received) {
        // An end that was started again hears of what it has not sent since.
        let end = self.end();
        while self.base < received.next
            && let Some(slot) = self.slots.pop_front()
        {
            if let Stage::Sent(_) = slot.stage {
                self.under_way -= slot.item.bits();
            }
            self.lost.remove(&self.base);
            self.base += 1;
        }
        self.fresh = self.fresh.max(self.base);
        let mut from = received.next;
        for &(missing, there) in &received.beyond {
            from = from.saturating_add(missing);
            let to = from.saturating_add(there);
            for number in from.max(self.base)..to.min(end) {
                self.arrived(now, number);
            }
            from = to;
            if from >= end {
                break;
            }
        }
    }

    fn arrived(&mut self, now: u64, number: u64) {
        let Some(slot) = self.slot(number) else { return };
        let (stage, bits) = (std::mem::replace(&mut slot.stage, Stage::Arrived(now)), slot.item.bits());
        match stage {
            Stage::Sent(_) => self.under_way -= bits,
            Stage::Waits => {
                self.lost.remove(&number);
                self.timers.push_back((now, number));
            }
            Stage::Arrived(_) => {}
        }
    }

    /// Takes items for a frame that has room for `room` bits, what is lost first, and makes parts of them; the first
    /// item may be larger than the room where `whole` says so. New items are taken while no more than `window` bits are
    /// under way.
    pub(super) fn fill(
        &mut self,
        class: u8,
        now: u64,
        room: &mut u64,
        whole: bool,
        window: u64,
        parts: &mut Vec<Part>,
    ) {
        loop {
            let again = self.lost.first().copied();
            while self.slot(self.fresh).is_some_and(|slot| matches!(slot.stage, Stage::Arrived(_))) {
                self.fresh += 1;
            }
            let fresh = Some(self.fresh).filter(|&it| it < self.end() && self.under_way <= window);
            let Some(number) = again.or(fresh) else { return };
            let first = parts.is_empty() && whole;
            let Some(slot) = self.slot(number) else { return };
            let bits = slot.item.bits();
            if bits > *room && !first {
                return;
            }
            slot.stage = Stage::Sent(now);
            let item = slot.item.clone();
            *room = room.saturating_sub(bits);
            self.under_way += bits;
            self.timers.push_back((now, number));
            if again.is_some() {
                self.lost.remove(&number);
            } else {
                self.fresh += 1;
            }
            match parts.last_mut().filter(|part| part.class == class && part.first + part.items.len() as u64 == number)
            {
                Some(part) => part.items.push(item),
                None => parts.push(Part { class, first: number, items: vec![item] }),
            }
        }
    }
}
