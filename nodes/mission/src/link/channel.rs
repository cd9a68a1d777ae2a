//! The radio channel with the frames that are under way in it.

use std::collections::BTreeMap;

use swath_sim::time::Tick;

use super::end::Sent;
use super::radio::{Direction, Radio};

/// Frames on their way, by the tick at which they arrive.
type UnderWay = BTreeMap<Tick, Vec<Vec<u8>>>;

/// The radio channel, and what is under way in it.
#[derive(Clone, Debug)]
pub struct Channel {
    radio: Radio,
    up: UnderWay,
    down: UnderWay,
}

impl Channel {
    /// A channel in which nothing is under way.
    #[must_use]
    pub fn new(radio: Radio) -> Self {
        Self { radio, up: UnderWay::new(), down: UnderWay::new() }
    }

    /// The radio.
    #[must_use]
    pub fn radio(&self) -> &Radio {
        &self.radio
    }

    /// The same, to be disturbed.
    pub fn radio_mut(&mut self) -> &mut Radio {
        &mut self.radio
    }

    /// The first tick from `from` on at which it is open or a frame arrives; none before the mission's end.
    #[must_use]
    pub fn next_event(&self, from: Tick) -> Option<Tick> {
        let arrivals = [&self.up, &self.down].into_iter().filter_map(|it| it.keys().next().copied());
        arrivals.chain(self.radio.next_open(from)).min()
    }

    /// Frames that have arrived up to a tick.
    pub fn arrived(&mut self, direction: Direction, tick: Tick) -> Vec<Vec<u8>> {
        let under_way = self.under_way(direction);
        let mut frames = Vec::new();
        while let Some(entry) = under_way.first_entry().filter(|entry| *entry.key() <= tick) {
            frames.extend(entry.remove());
        }
        frames
    }

    /// Takes what an end sends at a tick.
    pub fn carry(&mut self, direction: Direction, tick: Tick, sent: Vec<Sent>) {
        for (arrives, bytes) in self.radio.carry(direction, tick, sent) {
            self.under_way(direction).entry(arrives).or_default().push(bytes);
        }
    }

    fn under_way(&mut self, direction: Direction) -> &mut UnderWay {
        match direction {
            Direction::Up => &mut self.up,
            Direction::Down => &mut self.down,
        }
    }
}
