//! How late messages were sent.

use std::time::Duration;

/// Counts of times in steps of a tenth of a millisecond.
#[derive(Debug, Clone)]
pub(crate) struct Lateness {
    counts: Vec<u64>,
    total: u64,
}

/// Width of a step.
const STEP: Duration = Duration::from_micros(100);
/// Steps; what is later counts into the last.
const STEPS: usize = 10_000;

impl Default for Lateness {
    fn default() -> Self {
        Self { counts: vec![0; STEPS], total: 0 }
    }
}

impl Lateness {
    /// Counts one message.
    pub(crate) fn note(&mut self, late: Duration) {
        let step = (late.as_nanos() / STEP.as_nanos()).min(STEPS as u128 - 1) as usize;
        self.counts[step] += 1;
        self.total += 1;
    }

    /// The time that a share of all messages does not exceed, rounded up to the step.
    pub(crate) fn quantile(&self, share: f64) -> Duration {
        let wanted = (self.total as f64 * share).ceil() as u64;
        let mut seen = 0;
        for (step, count) in (1..).zip(&self.counts) {
            seen += count;
            if seen >= wanted {
                return STEP * step;
            }
        }
        STEP * STEPS as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles() {
        let mut lateness = Lateness::default();
        (0..99).for_each(|_| lateness.note(Duration::from_micros(250)));
        lateness.note(Duration::from_secs(100));
        assert_eq!(lateness.quantile(0.99), Duration::from_micros(300));
        assert_eq!(lateness.quantile(1.0), Duration::from_secs(1));
    }
}
