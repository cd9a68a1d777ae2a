//! One end of the radio: sends items until they are acknowledged, and hands on each item that comes once and in order.
//!
//! The idea is COP-1's (CCSDS 232.1-B-2), numbers, a window, a timer and retransmission, without its bytes; what does not
//! get through in a pass waits for the next one. An item is acknowledged by its number, so single losses cost single
//! items. Numbers belong to items, not to frames: how items lie in frames need not survive the end of a process.

use serde::{Deserialize, Serialize};
use swath_sim::time::Tick;

use super::frame::{CLASSES, Frame, FrameError, Item};
use super::inbox::Inbox;
use super::outbox::Outbox;

/// Least size of a full frame [bit].
const FRAME_BITS_MIN: u64 = 8192;
/// Frames that a tick has room for at least, where the rate is high.
const FRAMES_PER_TICK: u64 = 8;
/// How much may be under way, in round trips.
const WINDOW_TRIPS: u64 = 8;

/// How an end uses its transmitter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rates {
    /// What it can send in a tick [bit].
    pub bits_per_tick: u64,
    /// Size of a full frame [bit].
    pub frame_bits: u64,
    /// Time on the air after which an item that is not acknowledged is taken for lost [ticks].
    pub patience: u64,
    /// Data that may be under way [bit].
    pub window_bits: u64,
    /// Silence on the air after which it sends a frame without items [ticks].
    pub hello: u64,
}

impl Rates {
    /// Rates of an end that sends and hears so much in a tick [bit], where a frame takes `delay` ticks at most.
    #[must_use]
    pub fn new(sends: u64, hears: u64, delay: u64, hello: u64) -> Self {
        let frame = |per_tick: u64| FRAME_BITS_MIN.max(per_tick / FRAMES_PER_TICK);
        // A frame of its own, one that is on its way back, and the two ways.
        let patience = 2 * delay + frame(sends).div_ceil(sends.max(1)) + frame(hears).div_ceil(hears.max(1)) + 2;
        Self {
            bits_per_tick: sends.max(1),
            frame_bits: frame(sends),
            patience,
            window_bits: WINDOW_TRIPS * patience * sends.max(1) + frame(sends),
            hello,
        }
    }
}

/// A frame that leaves.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sent {
    /// Its bytes.
    pub bytes: Vec<u8>,
    /// Ticks from the present one until its last bit has left.
    pub air_ticks: u64,
}

/// What came in a frame and has gone on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Arrival {
    /// Its class.
    pub class: usize,
    /// Its number in its class.
    pub number: u64,
    /// The item.
    pub item: Item,
}

/// What an end must not forget.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Kept {
    /// By class: number of the first item that is not known to have arrived, and the items from there on.
    pub to_send: [(u64, Vec<Item>); CLASSES],
    /// By class: number of the next item that goes on.
    pub received: [u64; CLASSES],
}

/// What an end has seen of the air.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Frames sent.
    pub sent: u64,
    /// Frames heard that were whole.
    pub heard: u64,
    /// Frames that were damaged or foreign.
    pub damaged: u64,
    /// Frames of a sender whose clock is ahead of ours.
    pub ahead: u64,
}

/// One end of the radio.
#[derive(Clone, Debug)]
pub struct End {
    rates: Rates,
    out: [Outbox; CLASSES],
    inn: [Inbox; CLASSES],
    /// What the transmitter still has to send of frames that have begun [bit].
    debt: u64,
    /// Ticks on the air so far.
    air: u64,
    /// The last tick at which it could send.
    open: Option<Tick>,
    /// Tick on the air of the last frame sent; none in this pass yet.
    spoke: Option<u64>,
    /// Whether items came that are not acknowledged.
    owes: bool,
    counts: Counts,
}

impl End {
    /// An end that has sent and heard nothing.
    #[must_use]
    pub fn new(rates: Rates) -> Self {
        Self::restored(rates, Kept::default())
    }

    /// An end that goes on from what was kept.
    #[must_use]
    pub fn restored(rates: Rates, kept: Kept) -> Self {
        Self {
            rates,
            out: kept.to_send.map(|(base, items)| Outbox::restored(base, items)),
            inn: kept.received.map(Inbox::restored),
            debt: 0,
            air: 0,
            open: None,
            spoke: None,
            owes: false,
            counts: Counts::default(),
        }
    }

    /// What must not be forgotten.
    #[must_use]
    pub fn kept(&self) -> Kept {
        Kept {
            to_send: self.out.each_ref().map(|out| (out.base(), out.items().cloned().collect())),
            received: self.inn.each_ref().map(Inbox::next),
        }
    }

    /// Adds an item to a class, the last for one that is not there, and returns its number.
    pub fn push(&mut self, class: usize, item: Item) -> u64 {
        self.out[class.min(CLASSES - 1)].push(item)
    }

    /// Items of a class below this number have arrived.
    #[must_use]
    pub fn arrived(&self, class: usize) -> u64 {
        self.out.get(class).map_or(0, Outbox::base)
    }

    /// Items of a class below this number were sent at least once.
    #[must_use]
    pub fn sent(&self, class: usize) -> u64 {
        self.out.get(class).map_or(0, Outbox::fresh)
    }

    /// Number of the next item of a class.
    #[must_use]
    pub fn next(&self, class: usize) -> u64 {
        self.out.get(class).map_or(0, Outbox::end)
    }

    /// Number of the next item of a class that is to come.
    #[must_use]
    pub fn to_come(&self, class: usize) -> u64 {
        self.inn.get(class).map_or(0, Inbox::next)
    }

    /// Items of each class that are not known to have arrived.
    #[must_use]
    pub fn waiting(&self) -> [u64; CLASSES] {
        self.out.each_ref().map(|out| out.end() - out.base())
    }

    /// Size of a full frame [bit].
    #[must_use]
    pub fn frame_bits(&self) -> u64 {
        self.rates.frame_bits
    }

    /// What it has seen of the air.
    #[must_use]
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// A frame is heard. Returns what goes on: the caller keeps it before it calls [`Self::transmit`].
    ///
    /// # Errors
    /// When it is damaged or foreign; one of a clock that is ahead is counted, and nothing of it goes on.
    pub fn hear(&mut self, now: Tick, bytes: &[u8]) -> Result<Vec<Arrival>, FrameError> {
        let frame = Frame::decode(bytes).inspect_err(|_| self.counts.damaged += 1)?;
        if frame.sent > now {
            self.counts.ahead += 1;
            return Ok(Vec::new());
        }
        self.counts.heard += 1;
        for (out, received) in self.out.iter_mut().zip(&frame.received) {
            out.acknowledge(self.air, received);
        }
        for part in frame.parts {
            self.owes = true;
            let Some(inbox) = self.inn.get_mut(usize::from(part.class)) else { continue };
            for (at, item) in part.items.into_iter().enumerate() {
                inbox.put(part.first.saturating_add(at as u64), item);
            }
        }
        let mut arrivals = Vec::new();
        for (class, inbox) in self.inn.iter_mut().enumerate() {
            while let Some(item) = inbox.take() {
                arrivals.push(Arrival { class, number: inbox.next() - 1, item });
            }
        }
        Ok(arrivals)
    }

    /// What leaves at a tick at which the radio is open. Between passes it is not called, and timers stand still.
    pub fn transmit(&mut self, now: Tick) -> Vec<Sent> {
        if self.open.replace(now).is_none_or(|before| before.after(1) != now) {
            self.begin_pass();
        }
        self.air += 1;
        for out in &mut self.out {
            out.expire(self.air, self.rates.patience);
        }
        let mut sent = Vec::new();
        while self.debt < self.rates.bits_per_tick {
            let Some(frame) = self.next_frame(now) else { break };
            let bytes = frame.encode();
            self.debt = self.debt.saturating_add(bytes.len() as u64 * 8).saturating_add(frame.data_bits());
            self.counts.sent += 1;
            sent.push(Sent { bytes, air_ticks: (self.debt - 1) / self.rates.bits_per_tick });
        }
        self.debt = self.debt.saturating_sub(self.rates.bits_per_tick);
        sent
    }

    /// What had begun to leave when the radio closed was cut off, and each pass begins with a frame.
    fn begin_pass(&mut self) {
        self.spoke = None;
        self.debt = 0;
    }

    fn next_frame(&mut self, now: Tick) -> Option<Frame> {
        let (mut room, mut parts) = (self.rates.frame_bits, Vec::new());
        let mut under_way: u64 = self.out.iter().map(Outbox::under_way).sum();
        for (class, out) in self.out.iter_mut().enumerate() {
            let others = under_way - out.under_way();
            let window = self.rates.window_bits.saturating_sub(others);
            out.fill(class as u8, self.air, &mut room, true, window, &mut parts);
            under_way = others + out.under_way();
        }
        let silent = self.spoke.is_none_or(|spoke| self.air - spoke >= self.rates.hello);
        if parts.is_empty() && !self.owes && !silent {
            return None;
        }
        self.spoke = Some(self.air);
        self.owes = false;
        Some(Frame { sent: now, received: self.inn.each_ref().map(Inbox::received), parts })
    }
}
