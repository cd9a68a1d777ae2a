//! Simulated time, as the spacecraft's clock gives it, for stamps and log lines.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use swath_msgs::builtin_interfaces::Time;

/// The latest simulated time that this process knows. Clones are the same clock.
#[derive(Clone, Debug, Default)]
pub struct SimClock {
    nanoseconds: Arc<AtomicU64>,
}

impl SimClock {
    /// Simulated time is now this [ns since the mission epoch].
    pub fn set_ns(&self, nanoseconds: u64) {
        self.nanoseconds.store(nanoseconds, Ordering::Relaxed);
    }

    /// Simulated time [ns since the mission epoch].
    #[must_use]
    pub fn now_ns(&self) -> u64 {
        self.nanoseconds.load(Ordering::Relaxed)
    }

    /// Simulated time as messages carry it.
    #[must_use]
    pub fn stamp(&self) -> Time {
        stamp(self.now_ns())
    }
}

/// A time [ns since the mission epoch] as messages carry it; beyond 2^31 s it stands still.
#[must_use]
pub fn stamp(nanoseconds: u64) -> Time {
    let (sec, nanosec) = (nanoseconds / 1_000_000_000, nanoseconds % 1_000_000_000);
    Time { sec: i32::try_from(sec).unwrap_or(i32::MAX), nanosec: nanosec as u32 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_is_split_into_seconds_and_nanoseconds() {
        let clock = SimClock::default();
        clock.clone().set_ns(1_500_000_000);
        assert_eq!(clock.stamp(), Time { sec: 1, nanosec: 500_000_000 });
        assert_eq!(stamp(u64::MAX).sec, i32::MAX);
    }
}
