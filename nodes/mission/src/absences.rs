//! When somebody is lost, and when they are back.

use std::collections::VecDeque;

use swath_sim::time::Tick;

/// Spans of time in which somebody is not there, in order.
#[derive(Clone, Debug, Default)]
pub struct Absences(VecDeque<(Tick, Tick)>);

/// Whether somebody is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Presence {
    /// They are, and were when this was asked last.
    Here,
    /// They are, and were lost in between.
    Back,
    /// They are not, up to this tick.
    Away(Tick),
}

impl Absences {
    /// Spans from the first number, while somebody is lost, up to the second one, when they are back.
    #[must_use]
    pub fn new(spans: impl IntoIterator<Item = (Tick, Tick)>) -> Self {
        Self(spans.into_iter().collect())
    }

    /// How it is at `now`, which never comes back to an earlier time.
    pub(crate) fn at(&mut self, now: Tick) -> Presence {
        let mut presence = Presence::Here;
        while let Some(&(_, until)) = self.0.front().filter(|(from, _)| *from <= now) {
            if now < until {
                return Presence::Away(until);
            }
            self.0.pop_front();
            presence = Presence::Back;
        }
        presence
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_was_lost_is_back_once() {
        let mut absences = Absences::new([(2, 4), (4, 4), (6, 9)].map(|(from, until)| (Tick(from), Tick(until))));
        let seen: Vec<_> = [0, 2, 3, 4, 5, 7, 10, 11].map(|tick| absences.at(Tick(tick))).into();
        use Presence::{Away, Back, Here};
        assert_eq!(seen, [Here, Away(Tick(4)), Away(Tick(4)), Back, Here, Away(Tick(9)), Back, Here]);
    }
}
