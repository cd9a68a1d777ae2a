//! Which time a message is given: its own stamp, the clock's, or that of its coming.

/// Simulated time by which a stamp may differ from the clock's and still be a simulated time [ns].
///
/// An hour: in lockstep a sample that DDS has to send twice comes minutes of simulated time late, while what differs by
/// more carries another clock's time, as what `ros2` commands stamp with wall time does.
const FAR: u64 = 3_600_000_000_000;

/// Which clock gives messages their time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TapClock {
    /// The stamp with which a message begins; where that is missing or far from `/clock`, the latest `/clock`, and
    /// where nobody publishes that, the time of its coming.
    #[default]
    Simulated,
    /// As [`TapClock::Simulated`], and somebody will publish `/clock`: messages that come before the first one are
    /// held until then.
    SimulatedLater,
    /// When the message came in.
    Wall,
}

/// A message's times [ns].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Times {
    pub log: u64,
    pub publish: u64,
}

impl Times {
    fn both(time: u64) -> Self {
        Self { log: time, publish: time }
    }
}

/// What is known of simulated time.
#[derive(Debug)]
pub(super) struct Timeline {
    clock: TapClock,
    /// The latest `/clock` [ns].
    shown: Option<u64>,
    /// The latest stamp of any message while there is no `/clock` [ns].
    latest: Option<u64>,
    /// Whether somebody publishes `/clock`; `None` before anybody has looked.
    clock_is_there: Option<bool>,
}

impl Timeline {
    pub(super) fn new(clock: TapClock) -> Self {
        Self { clock, shown: None, latest: None, clock_is_there: None }
    }

    pub(super) fn set_clock_is_there(&mut self, is_there: bool) {
        self.clock_is_there = Some(is_there);
    }

    /// The latest simulated time [ns].
    pub(super) fn now(&self) -> Option<u64> {
        self.shown.or(self.latest)
    }

    /// Takes in a `/clock`; whether it is the first.
    pub(super) fn tick(&mut self, time: Option<u64>) -> bool {
        let is_first = self.shown.is_none() && time.is_some();
        self.shown = time.or(self.shown);
        is_first
    }

    /// Whether messages are held because a `/clock` will come.
    pub(super) fn awaits_clock(&self) -> bool {
        self.shown.is_none() && (self.clock == TapClock::SimulatedLater || self.clock_is_there != Some(false))
    }

    /// The times of a message; `None` while they are not known.
    pub(super) fn times(&mut self, stamp: Option<u64>, received: u64, sent: Option<u64>) -> Option<Times> {
        if self.clock == TapClock::Wall {
            return Some(Times { log: received, publish: sent.unwrap_or(received) });
        }
        if let Some(now) = self.shown {
            return Some(Times::both(stamp.filter(|stamp| stamp.abs_diff(now) <= FAR).unwrap_or(now)));
        }
        if self.awaits_clock() {
            return None;
        }
        self.latest = self.latest.max(stamp);
        stamp.or(self.latest).map(Times::both)
    }

    /// The times of a message that is not held any longer.
    pub(super) fn times_anyway(&mut self, stamp: Option<u64>, received: u64) -> Times {
        match self.shown {
            Some(now) => Times::both(stamp.filter(|stamp| stamp.abs_diff(now) <= FAR).unwrap_or(now)),
            None => Times::both(stamp.or(self.latest).unwrap_or(received)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const S: u64 = 1_000_000_000;
    /// A time of the wall [ns].
    const WALL: u64 = 1_800_000_000 * S;

    fn log(timeline: &mut Timeline, stamp: Option<u64>) -> Option<u64> {
        timeline.times(stamp, WALL, None).map(|times| times.log)
    }

    #[test]
    fn a_stamp_far_from_the_clock_is_none() {
        let mut timeline = Timeline::new(TapClock::Simulated);
        assert!(timeline.tick(Some(100 * S)) && !timeline.tick(Some(200 * S)));
        assert_eq!(log(&mut timeline, Some(201 * S)), Some(201 * S));
        assert_eq!(log(&mut timeline, Some(WALL)), Some(200 * S), "another clock's time");
        assert_eq!(log(&mut timeline, None), Some(200 * S));
        assert_eq!(timeline.now(), Some(200 * S), "stamps do not move the clock");
        assert!(!timeline.tick(None) && !timeline.tick(Some(50 * S)));
        assert_eq!(log(&mut timeline, None), Some(50 * S), "time may be set back");
    }

    #[test]
    fn without_a_clock_stamps_are_the_time() {
        let mut timeline = Timeline::new(TapClock::Simulated);
        assert_eq!(log(&mut timeline, Some(5 * S)), None, "nobody has looked for a clock yet");
        timeline.set_clock_is_there(false);
        assert_eq!(log(&mut timeline, None), None, "nothing tells the time");
        assert_eq!(log(&mut timeline, Some(5 * S)), Some(5 * S));
        assert_eq!(log(&mut timeline, None), Some(5 * S));
        assert_eq!(timeline.times_anyway(None, WALL).log, 5 * S);
        assert_eq!(Timeline::new(TapClock::Simulated).times_anyway(None, WALL).log, WALL);
    }

    #[test]
    fn while_a_clock_is_awaited_messages_are_held() {
        for mut timeline in [Timeline::new(TapClock::SimulatedLater), Timeline::new(TapClock::Simulated)] {
            timeline.set_clock_is_there(true);
            assert_eq!((log(&mut timeline, Some(WALL)), timeline.awaits_clock()), (None, true));
            timeline.tick(Some(S));
            assert_eq!((log(&mut timeline, Some(WALL)), timeline.awaits_clock()), (Some(S), false));
        }
        let mut wall = Timeline::new(TapClock::Wall);
        assert_eq!(wall.times(Some(S), WALL, Some(WALL - 1)), Some(Times { log: WALL, publish: WALL - 1 }));
    }
}
