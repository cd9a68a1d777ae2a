//! Simulated time as whole control ticks.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::error::SimError;

/// Simulated time: control ticks since the mission epoch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Tick(pub u64);

impl Tick {
    /// The tick `ticks` after this one.
    #[must_use]
    pub fn after(self, ticks: u32) -> Self {
        Self(self.0 + u64::from(ticks))
    }

    /// Signed number of ticks from `earlier` to this one.
    #[must_use]
    pub fn since(self, earlier: Self) -> i64 {
        self.0 as i64 - earlier.0 as i64
    }
}

impl fmt::Display for Tick {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "tick {}", self.0)
    }
}

/// Length of a control tick; a whole number of nanoseconds, so that stamps are exact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TickPeriod {
    nanoseconds: u64,
}

/// Slack when a duration is rounded up to ticks [ticks]: 160.000000000001 ticks are 160.
const ROUND_UP_SLACK: f64 = 1e-9;

impl TickPeriod {
    /// Period of a control frequency [Hz].
    ///
    /// # Errors
    /// When the frequency is outside 0.1 to 100 Hz or its period is not a whole number of nanoseconds.
    pub fn from_frequency(frequency_hz: f64) -> Result<Self, SimError> {
        if !(0.1..=100.0).contains(&frequency_hz) {
            return Err(SimError::Frequency { frequency_hz });
        }
        let nanoseconds = 1e9 / frequency_hz;
        if nanoseconds.fract() != 0.0 {
            return Err(SimError::Frequency { frequency_hz });
        }
        Ok(Self { nanoseconds: nanoseconds as u64 })
    }

    /// Length of one tick [ns].
    #[must_use]
    pub fn nanoseconds(self) -> u64 {
        self.nanoseconds
    }

    /// Length of one tick [s].
    #[must_use]
    pub fn seconds(self) -> f64 {
        self.nanoseconds as f64 * 1e-9
    }

    /// Time of a tick since the epoch [s].
    #[must_use]
    pub fn time_s(self, tick: Tick) -> f64 {
        tick.0 as f64 * self.seconds()
    }

    /// A duration [s] rounded up to whole ticks; negative durations and NaN give 0.
    #[must_use]
    pub fn ticks_ceil(self, duration_s: f64) -> u32 {
        (duration_s / self.seconds() - ROUND_UP_SLACK).ceil() as u32
    }

    /// Length of a number of ticks [s].
    #[must_use]
    pub fn duration_s(self, ticks: u32) -> f64 {
        f64::from(ticks) * self.seconds()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_round_up_once() {
        let period = TickPeriod::from_frequency(2.0).unwrap();
        assert_eq!(period.ticks_ceil(80.0), 160);
        assert_eq!(period.ticks_ceil(80.01), 161);
        assert_eq!(period.ticks_ceil(0.1 + 0.2 + 0.2), 1);
        assert_eq!(period.ticks_ceil(-3.0), 0);
        assert_eq!(period.ticks_ceil(f64::NAN), 0);
    }

    #[test]
    fn frequencies_without_an_exact_period_are_refused() {
        for frequency_hz in [3.0, 0.0, f64::NAN, -2.0, 1000.0] {
            assert!(TickPeriod::from_frequency(frequency_hz).is_err(), "{frequency_hz}");
        }
        assert_eq!(TickPeriod::from_frequency(10.0).unwrap().nanoseconds(), 100_000_000);
    }
}
