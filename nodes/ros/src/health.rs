//! Whether the RustDDS of this process still does what it is there for.

use std::collections::VecDeque;
use std::time::{Duration, Instant, SystemTime};

use crate::minder::Minder;
use crate::roster::Roster;

/// How often RustDDS is asked whether it still hears and speaks.
pub(crate) const ASK_EVERY: Duration = Duration::from_secs(1);
/// So many questions in a row without an answer, and RustDDS is taken for dead.
const UNANSWERED: u32 = 5;
/// The host's clock has been set back if it has lost more than this.
const STEP_BACK: Duration = Duration::from_millis(500);
/// So many cures of deafness in [`CURES_WITHIN`] and another one is no use.
const CURES: usize = 3;
const CURES_WITHIN: Duration = Duration::from_secs(60);

/// Why a process needs another participant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ailment {
    /// RustDDS does not answer any more.
    Deaf,
    /// The host's clock was set back: until it has caught up, RustDDS hears of no new participant.
    ClockBack,
    /// It was cut off from others that RustDDS has given up, and that are there again.
    CutOff,
    /// It was cured again and again.
    Incurable,
}

impl Ailment {
    /// The reason in words.
    pub(crate) const fn reason(self) -> &'static str {
        match self {
            Self::Deaf => "it did not answer any more",
            Self::ClockBack => "the host's clock was set back",
            Self::CutOff => "it was cut off from others",
            Self::Incurable => "it fails again and again",
        }
    }
}

/// What has been seen of it.
pub(crate) struct Health {
    asked: Option<Instant>,
    unanswered: u32,
    clocks: Clocks,
    cures: VecDeque<Instant>,
}

impl Health {
    pub(crate) fn new() -> Self {
        Self { asked: None, unanswered: 0, clocks: Clocks::now(), cures: VecDeque::new() }
    }

    /// After a cure. A clock that is set back or a network that parts, however often, is no failure of RustDDS.
    pub(crate) fn after(former: Self, cured: Ailment) -> Self {
        let mut cures = former.cures;
        if cured == Ailment::Deaf {
            cures.push_back(Instant::now());
        }
        Self { cures, ..Self::new() }
    }

    /// What ails it, if it is this: it may be incurable.
    fn diagnosis(&mut self, ailment: Ailment, now: Instant) -> Ailment {
        self.cures.retain(|cure| now.saturating_duration_since(*cure) < CURES_WITHIN);
        if ailment == Ailment::Deaf && self.cures.len() >= CURES { Ailment::Incurable } else { ailment }
    }

    /// Asks RustDDS whether it hears and speaks, once in a while, and tells what ails it.
    pub(crate) fn examine(&mut self, minder: &Minder, roster: &Roster) -> Option<Ailment> {
        let now = Instant::now();
        if self.asked.is_some_and(|asked| now.duration_since(asked) < ASK_EVERY) {
            return None;
        }
        let (acknowledged, probed) = (minder.acknowledged(), roster.take_probed());
        if self.asked.is_none() || (acknowledged && probed) {
            self.unanswered = 0;
        } else {
            self.unanswered += 1;
            tracing::debug!("RustDDS does not answer: event loop {acknowledged}, discovery {probed}");
            minder.announce();
        }
        self.asked = Some(now);
        minder.ask();
        let clocks = Clocks::now();
        let back = clocks.has_gone_back_since(&self.clocks);
        self.clocks = clocks;
        let reunited = roster.take_reunited();
        let ailment = match (self.unanswered >= UNANSWERED, back) {
            (true, _) => Ailment::Deaf,
            (false, true) => Ailment::ClockBack,
            (false, false) if reunited => Ailment::CutOff,
            (false, false) => return None,
        };
        Some(self.diagnosis(ailment, now))
    }
}

/// The clock that only goes forward, and the one that people set.
#[derive(Clone, Copy)]
struct Clocks {
    steady: Instant,
    wall: SystemTime,
}

impl Clocks {
    fn now() -> Self {
        Self { steady: Instant::now(), wall: SystemTime::now() }
    }

    fn has_gone_back_since(&self, earlier: &Self) -> bool {
        let passed = self.steady.saturating_duration_since(earlier.steady);
        let expected = earlier.wall + passed;
        expected.duration_since(self.wall).is_ok_and(|lost| lost > STEP_BACK)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_cured_three_times_a_minute_and_of_a_clock_that_was_set_back_however_often() {
        let mut health = Health::new();
        let now = Instant::now();
        for _ in 0..20 {
            assert_eq!(health.diagnosis(Ailment::ClockBack, now), Ailment::ClockBack);
            health = Health::after(health, Ailment::ClockBack);
        }
        for _ in 0..CURES {
            assert_eq!(health.diagnosis(Ailment::Deaf, now), Ailment::Deaf);
            health = Health::after(health, Ailment::Deaf);
        }
        assert_eq!(health.diagnosis(Ailment::ClockBack, now), Ailment::ClockBack);
        assert_eq!(health.diagnosis(Ailment::Deaf, now), Ailment::Incurable);
        assert_eq!(health.diagnosis(Ailment::Deaf, now + 2 * CURES_WITHIN), Ailment::Deaf);
    }

    #[test]
    fn only_a_clock_that_was_set_back_is_noticed() {
        let before = Clocks::now();
        let second = Duration::from_secs(1);
        let later = |wall| Clocks { steady: before.steady + second, wall };
        assert!(!later(before.wall + second).has_gone_back_since(&before));
        assert!(!later(before.wall + 3600 * second).has_gone_back_since(&before));
        assert!(!later(before.wall + Duration::from_millis(900)).has_gone_back_since(&before));
        assert!(later(before.wall).has_gone_back_since(&before));
        assert!(later(before.wall - 3600 * second).has_gone_back_since(&before));
    }
}
