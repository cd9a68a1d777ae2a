//! The radio channel as a node, without ROS: ticks of the radio in turn, each heard by both ends before the next one.

use swath_mission::faults::FaultPlan;
use swath_mission::link::channel::Channel;
use swath_mission::link::end::Sent;
use swath_mission::link::radio::Direction;
use swath_sim::time::Tick;

/// What an end hears at a tick of the radio.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Turn {
    /// The tick.
    pub tick: Tick,
    /// The next tick of the radio.
    pub next: Tick,
    /// Whether the end may send.
    pub open: bool,
    /// Frames that arrive.
    pub frames: Vec<Vec<u8>>,
}

/// The radio channel of a mission that ends at its horizon, which is the radio's last tick.
#[derive(Clone, Debug)]
pub struct LinkLogic {
    channel: Channel,
    horizon: Tick,
    /// The tick of the radio, and the next one.
    tick: Tick,
    next: Tick,
    open: bool,
    /// Whether the tick follows right after the one before.
    follows: bool,
    satellite: Side,
    ground: Side,
}

/// One end.
#[derive(Clone, Debug, Default)]
struct Side {
    /// What it hears at the tick.
    hears: Vec<Vec<u8>>,
    /// What it has sent at the tick, once it has said so.
    sent: Option<Vec<Sent>>,
}

impl LinkLogic {
    /// The channel at the epoch.
    #[must_use]
    pub fn new(channel: Channel, horizon: Tick) -> Self {
        let mut logic = Self {
            open: false,
            channel,
            horizon,
            tick: Tick(0),
            next: Tick(0),
            follows: true,
            satellite: Side::default(),
            ground: Side::default(),
        };
        logic.come_to(Tick(0));
        logic
    }

    /// The faults of the mission are these from now on.
    pub fn disturb(&mut self, faults: &FaultPlan) {
        self.channel.radio_mut().disturb(faults);
    }

    /// What an end should hear now; `direction` is that of the frames it hears. The ground, which may not know more than
    /// there is, hears of a tick after a pause only once the satellite has come to it.
    #[must_use]
    pub fn turn(&self, direction: Direction) -> Option<Turn> {
        let side = match direction {
            Direction::Up => &self.satellite,
            Direction::Down if self.follows || self.satellite.sent.is_some() => &self.ground,
            Direction::Down => return None,
        };
        let turn = || Turn { tick: self.tick, next: self.next, open: self.open, frames: side.hears.clone() };
        side.sent.is_none().then(turn)
    }

    /// Whether an end's word of a tick is news; `direction` is that of the frames it sends.
    #[must_use]
    pub fn awaits(&self, direction: Direction, tick: Tick) -> bool {
        let side = match direction {
            Direction::Up => &self.ground,
            Direction::Down => &self.satellite,
        };
        tick == self.tick && side.sent.is_none()
    }

    /// An end says what it has sent at the tick.
    pub fn on_sent(&mut self, direction: Direction, tick: Tick, sent: Vec<Sent>) {
        if !self.awaits(direction, tick) {
            return;
        }
        match direction {
            Direction::Up => self.ground.sent = Some(sent),
            Direction::Down => self.satellite.sent = Some(sent),
        }
        if self.ground.sent.is_none() || self.satellite.sent.is_none() || self.tick >= self.horizon {
            return;
        }
        for (direction, side) in [(Direction::Up, &mut self.ground), (Direction::Down, &mut self.satellite)] {
            self.channel.carry(direction, self.tick, side.sent.take().unwrap_or_default());
        }
        self.come_to(self.next);
    }

    fn come_to(&mut self, tick: Tick) {
        self.follows = tick == Tick(0) || tick == self.tick.after(1);
        self.tick = tick;
        self.open = self.channel.radio().open(tick);
        self.satellite.hears = self.channel.arrived(Direction::Up, tick);
        self.ground.hears = self.channel.arrived(Direction::Down, tick);
        let after = tick.after(1);
        self.next = match (self.open, tick < self.horizon) {
            (_, false) | (true, _) => after,
            (false, true) => self.channel.next_event(after).unwrap_or(self.horizon).min(self.horizon),
        };
    }
}
