//! When a message of a given log time is due: rate, pause and seeking as arithmetic.

use std::time::{Duration, Instant};

/// The relation of log time and wall time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pace {
    /// Log time over wall time; 0 is as fast as it goes.
    rate: f64,
    /// Log time [ns] at `since`.
    base: u64,
    since: Instant,
    paused: bool,
}

impl Pace {
    /// Starts at a log time [ns].
    pub(crate) fn new(rate: f64, base: u64, now: Instant, paused: bool) -> Self {
        Self { rate, base, since: now, paused }
    }

    pub(crate) fn rate(&self) -> f64 {
        self.rate
    }

    pub(crate) fn is_paused(&self) -> bool {
        self.paused
    }

    /// The log time that has been reached [ns]; the base while nothing sets a pace.
    pub(crate) fn log_time(&self, now: Instant) -> u64 {
        if self.paused {
            return self.base;
        }
        let elapsed = now.saturating_duration_since(self.since).as_secs_f64();
        self.base.saturating_add((elapsed * self.rate * 1e9) as u64)
    }

    /// How long from now until a log time [ns]; `None` while paused.
    pub(crate) fn wait(&self, log_time: u64, now: Instant) -> Option<Duration> {
        if self.paused {
            return None;
        }
        if self.rate == 0.0 {
            return Some(Duration::ZERO);
        }
        let from_base = log_time.saturating_sub(self.base) as f64 / self.rate / 1e9;
        // A day is longer than anyone waits without looking again.
        let due = self.since + Duration::from_secs_f64(from_base.min(86_400.0));
        Some(due.saturating_duration_since(now))
    }

    /// Goes on from where it is, at another rate.
    pub(crate) fn set_rate(&mut self, rate: f64, now: Instant) {
        self.move_to(self.log_time(now), now);
        self.rate = rate;
    }

    pub(crate) fn set_paused(&mut self, paused: bool, now: Instant) {
        self.move_to(self.log_time(now), now);
        self.paused = paused;
    }

    /// Goes on from a log time [ns].
    pub(crate) fn move_to(&mut self, log_time: u64, now: Instant) {
        self.base = log_time;
        self.since = now;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const S: u64 = 1_000_000_000;

    #[test]
    fn rate_pause_and_seek() {
        let t0 = Instant::now();
        let at = |s: f64| t0 + Duration::from_secs_f64(s);
        let mut pace = Pace::new(2.0, 100 * S, t0, false);
        assert_eq!(pace.log_time(at(1.0)), 102 * S);
        assert_eq!(pace.wait(104 * S, at(1.0)), Some(Duration::from_secs(1)));
        assert_eq!(pace.wait(101 * S, at(1.0)), Some(Duration::ZERO), "the past is due at once");
        pace.set_paused(true, at(1.0));
        assert_eq!((pace.log_time(at(9.0)), pace.wait(104 * S, at(9.0))), (102 * S, None));
        pace.set_paused(false, at(10.0));
        pace.set_rate(0.5, at(10.0));
        assert_eq!(pace.wait(103 * S, at(10.0)), Some(Duration::from_secs(2)));
        pace.move_to(50 * S, at(11.0));
        assert_eq!(pace.wait(51 * S, at(11.0)), Some(Duration::from_secs(2)));
        pace.set_rate(0.0, at(11.0));
        assert_eq!(pace.wait(u64::MAX, at(11.0)), Some(Duration::ZERO), "as fast as it goes");
    }
}
