//! What times are as numbers, and what a tick is, as messages tell it.

use swath_msgs::builtin_interfaces::Time;
use swath_node::stamp::nanoseconds;

/// A time [ms since 1970-01-01 UTC], 0 for none.
#[must_use]
pub fn milliseconds(time: &Time) -> f64 {
    nanoseconds(time) as f64 / 1e6
}

/// Learns what a tick is from messages that say both tick and time.
#[derive(Default)]
pub struct TickClock {
    first: Option<(u64, f64)>,
    /// Epoch and length of a tick [ms], as they were told last.
    pub told: Option<(f64, f64)>,
}

/// Length of a tick until two messages have told it [ms]: that of the default control frequency.
pub const TICK_MS: f64 = 500.0;

impl TickClock {
    /// Epoch and length of a tick [ms], if they have changed.
    pub fn learn(&mut self, tick: u64, t: f64) -> Option<(f64, f64)> {
        let (first, at) = *self.first.get_or_insert((tick, t));
        let tick_ms = match (self.told, tick > first) {
            (_, true) => (t - at) / (tick - first) as f64,
            (Some((_, known)), false) => known,
            (None, false) => TICK_MS,
        };
        let learnt = (at - first as f64 * tick_ms, tick_ms);
        let same = |(epoch, length): (f64, f64)| (epoch - learnt.0).abs() < 1.0 && (length - tick_ms).abs() < 1e-6;
        if self.told.is_some_and(same) {
            return None;
        }
        self.told = Some(learnt);
        Some(learnt)
    }
}
