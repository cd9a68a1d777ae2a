//! How long orders take from their submission to the satellite, to their image, and to the news of it.

use serde::{Deserialize, Serialize};
use swath_sim::time::{Tick, TickPeriod};

use super::ground::WayLine;

/// A distribution of times [s].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Times {
    /// How many there are.
    pub count: u64,
    /// Time that a tenth of them do not exceed.
    pub tenth_s: f64,
    /// Time that half of them do not exceed.
    pub median_s: f64,
    /// Time that nine tenths of them do not exceed.
    pub nine_tenths_s: f64,
}

impl Times {
    /// The distribution of numbers of ticks; none without any.
    #[must_use]
    pub fn of(ticks: impl IntoIterator<Item = i64>, period: TickPeriod) -> Option<Self> {
        let mut ticks: Vec<i64> = ticks.into_iter().collect();
        ticks.sort_unstable();
        // The smallest that at least this share does not exceed.
        let share = |tenths: usize| {
            let at = (ticks.len() * tenths).div_ceil(10).saturating_sub(1);
            ticks.get(at).map(|ticks| *ticks as f64 * period.seconds())
        };
        Some(Self { count: ticks.len() as u64, tenth_s: share(1)?, median_s: share(5)?, nine_tenths_s: share(9)? })
    }
}

/// What came of the orders of a mission over the radio, as the ground knows it at the end. Times are since submission.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LinkSummary {
    /// Requests that were sent to the satellite.
    pub uplinked: u64,
    /// Times until requests were on board.
    pub on_board: Option<Times>,
    /// Times until strips were imaged.
    pub imaged: Option<Times>,
    /// Times until the ground knew that.
    pub known: Option<Times>,
    /// Times until images were on the ground.
    pub delivered: Option<Times>,
}

impl LinkSummary {
    /// The summary of all requests.
    #[must_use]
    pub fn new(lines: impl Iterator<Item = WayLine>, period: TickPeriod) -> Self {
        let lines: Vec<WayLine> = lines.collect();
        let times = |when: fn(&WayLine) -> Option<Tick>| {
            Times::of(lines.iter().filter_map(|line| Some(when(line)?.since(line.queued_tick))), period)
        };
        Self {
            uplinked: lines.iter().filter(|line| line.uplinked_tick.is_some()).count() as u64,
            on_board: times(|line| line.on_board_tick),
            imaged: times(|line| line.imaged_tick),
            known: times(|line| line.known_tick),
            delivered: times(|line| line.delivered_tick),
        }
    }

    /// Rows for people.
    #[must_use]
    pub fn rows(&self) -> Vec<(&'static str, String)> {
        let text = |times: &Option<Times>| {
            times.map_or("-".to_owned(), |it| {
                let (from, median, to) = (it.tenth_s / 60.0, it.median_s / 60.0, it.nine_tenths_s / 60.0);
                format!("{}, after {median:.0} min (10 %: {from:.0}, 90 %: {to:.0})", it.count)
            })
        };
        vec![
            ("orders uplinked", self.uplinked.to_string()),
            ("on board", text(&self.on_board)),
            ("imaged", text(&self.imaged)),
            ("known", text(&self.known)),
            ("images down", text(&self.delivered)),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_times_that_a_share_does_not_exceed() {
        let period = TickPeriod::from_frequency(2.0).unwrap();
        let times = Times::of((1..=20).rev(), period).unwrap();
        assert_eq!((times.count, times.tenth_s, times.median_s, times.nine_tenths_s), (20, 1.0, 5.0, 9.0));
        let one = Times::of([7], period).unwrap();
        assert_eq!((one.tenth_s, one.median_s, one.nine_tenths_s), (3.5, 3.5, 3.5));
        assert_eq!(Times::of([], period), None);
    }
}
