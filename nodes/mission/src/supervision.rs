//! When a process of a mission is taken for lost, when it is started again, and when that is given up: decided without a
//! clock, a process or a thread.

use std::collections::VecDeque;
use std::time::Duration;

use serde::{Deserialize, Serialize};

/// `[supervision]` of a mission file: what the launcher does about nodes that end or hang. All times are of the wall
/// clock [s].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SupervisionConfig {
    /// Pause before a lost node is started again; it doubles with each loss within `within_s`.
    pub backoff_s: f64,
    /// Longest pause.
    pub backoff_max_s: f64,
    /// Starts within `within_s` after which it is given up.
    pub starts: u32,
    /// See `starts`.
    pub within_s: f64,
    /// A node without a sign of life for so long is warned of.
    pub warn_s: f64,
    /// A node without a sign of life for so long is killed, and started again.
    pub kill_s: f64,
    /// How long a node may take from its start to its first sign of life.
    pub startup_s: f64,
    /// How long nodes fly on without their launcher.
    pub orphaned_s: f64,
}

impl Default for SupervisionConfig {
    fn default() -> Self {
        Self {
            backoff_s: 0.2,
            backoff_max_s: 5.0,
            starts: 5,
            within_s: 60.0,
            warn_s: 2.0,
            kill_s: 5.0,
            startup_s: 30.0,
            orphaned_s: 60.0,
        }
    }
}

/// How long a process may take to end once it is killed [s]: one that waits for a disk that does not answer does not.
const DIES_S: f64 = 1.0;

/// What is to be done about a process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Nothing.
    Nothing,
    /// It has given no sign of life for a while: say so.
    Warn,
    /// It hangs: kill it.
    Kill,
    /// It was killed and does not end: leave it alone, another one takes its place.
    Abandon,
    /// Start it again.
    Start,
    /// It was lost too often: leave it.
    GiveUp,
}

/// What a sign of life of a process means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Heard {
    /// It goes on as before, or counts no more.
    AsBefore,
    /// It is the first one since its start.
    First,
    /// It was warned of.
    AfterWarning,
}

/// Where a process stands.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    /// It was started, or gave its last sign of life, then; whether it was warned of since.
    Runs { sign: Duration, fresh: bool, warned: bool },
    /// It was killed then and has not ended yet.
    Dies { since: Duration },
    /// It is started again then.
    Waits { until: Duration },
    /// It is not started again.
    GivenUp,
}

/// One process, as it is watched. Times are since any moment before its first start.
#[derive(Clone, Debug)]
pub struct Watch {
    config: SupervisionConfig,
    stage: Stage,
    /// When it was lost, the latest last; those within the window.
    losses: VecDeque<Duration>,
}

impl Watch {
    /// A process that is started `now`.
    #[must_use]
    pub fn new(config: SupervisionConfig, now: Duration) -> Self {
        let stage = Stage::Runs { sign: now, fresh: true, warned: false };
        Self { config, stage, losses: VecDeque::new() }
    }

    /// It was started again.
    pub fn started(&mut self, now: Duration) {
        self.stage = Stage::Runs { sign: now, fresh: true, warned: false };
    }

    /// It gives a sign of life.
    pub fn sign(&mut self, now: Duration) -> Heard {
        let Stage::Runs { fresh, warned, .. } = self.stage else { return Heard::AsBefore };
        self.stage = Stage::Runs { sign: now, fresh: false, warned: false };
        match (fresh, warned) {
            (true, _) => Heard::First,
            (_, true) => Heard::AfterWarning,
            _ => Heard::AsBefore,
        }
    }

    /// It has ended.
    pub fn lost(&mut self, now: Duration) -> Step {
        self.wait_after_loss(now);
        if self.losses() > self.config.starts {
            return self.give_up();
        }
        Step::Nothing
    }

    /// It has ended for want of something that may be there again at any time: it is started again however often.
    pub fn wants(&mut self, now: Duration) {
        self.wait_after_loss(now);
    }

    fn wait_after_loss(&mut self, now: Duration) {
        let seconds = Duration::from_secs_f64;
        let since = now.saturating_sub(seconds(self.config.within_s));
        self.losses.retain(|&loss| loss >= since);
        self.losses.push_back(now);
        let doubled = self.config.backoff_s * 2_f64.powi(self.losses() as i32 - 1);
        self.stage = Stage::Waits { until: now + seconds(doubled.min(self.config.backoff_max_s)) };
    }

    /// It is not started again.
    pub fn give_up(&mut self) -> Step {
        self.stage = Stage::GivenUp;
        Step::GiveUp
    }

    /// Losses within the window, up to the last one.
    #[must_use]
    pub fn losses(&self) -> u32 {
        self.losses.len() as u32
    }

    /// Whether it is not started again.
    #[must_use]
    pub fn given_up(&self) -> bool {
        self.stage == Stage::GivenUp
    }

    /// It is started again after all, once: what comes of it is another matter.
    pub fn pardon(&mut self, now: Duration) {
        self.losses.clear();
        self.stage = Stage::Waits { until: now };
    }

    /// Time has come to `now`.
    pub fn step(&mut self, now: Duration) -> Step {
        let silent = |sign: Duration, limit_s: f64| now.saturating_sub(sign) >= Duration::from_secs_f64(limit_s);
        match self.stage {
            Stage::Runs { sign, fresh: true, .. } if silent(sign, self.config.startup_s) => self.kill(now),
            Stage::Runs { sign, fresh: false, .. } if silent(sign, self.config.kill_s) => self.kill(now),
            Stage::Runs { sign, fresh: false, warned: false } if silent(sign, self.config.warn_s) => {
                self.stage = Stage::Runs { sign, fresh: false, warned: true };
                Step::Warn
            }
            Stage::Dies { since } if silent(since, DIES_S) => Step::Abandon,
            Stage::Waits { until } if now >= until => Step::Start,
            _ => Step::Nothing,
        }
    }

    fn kill(&mut self, now: Duration) -> Step {
        self.stage = Stage::Dies { since: now };
        Step::Kill
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn ms(milliseconds: u64) -> Duration {
        Duration::from_millis(milliseconds)
    }

    fn watch() -> Watch {
        let mut watch = Watch::new(SupervisionConfig::default(), ms(0));
        assert_eq!(watch.sign(ms(1000)), Heard::First);
        assert_eq!(watch.sign(ms(1500)), Heard::AsBefore);
        watch
    }

    #[test]
    fn a_hung_process_is_warned_of_once_and_then_killed() {
        let mut watch = watch();
        assert_eq!(watch.step(ms(3499)), Step::Nothing);
        assert_eq!(watch.step(ms(3500)), Step::Warn);
        assert_eq!(watch.step(ms(4000)), Step::Nothing);
        assert_eq!(watch.sign(ms(4100)), Heard::AfterWarning);
        assert_eq!(watch.step(ms(6100)), Step::Warn);
        assert_eq!(watch.step(ms(9099)), Step::Nothing);
        assert_eq!(watch.step(ms(9100)), Step::Kill);
        assert_eq!(watch.step(ms(9500)), Step::Nothing, "it is killed once");
        assert_eq!(watch.sign(ms(9501)), Heard::AsBefore, "what it has said before counts no more");
        assert_eq!(watch.lost(ms(9502)), Step::Nothing);
        assert_eq!(watch.step(ms(9702)), Step::Start);
    }

    #[test]
    fn one_that_does_not_end_when_it_is_killed_is_left_alone_and_replaced() {
        let mut watch = watch();
        assert_eq!(watch.step(ms(3500)), Step::Warn);
        assert_eq!(watch.step(ms(6500)), Step::Kill);
        assert_eq!(watch.step(ms(7499)), Step::Nothing);
        assert_eq!(watch.step(ms(7500)), Step::Abandon);
        assert_eq!(watch.lost(ms(7500)), Step::Nothing);
        assert_eq!(watch.step(ms(7700)), Step::Start);
    }

    #[test]
    fn one_that_does_not_come_up_is_killed_too() {
        let mut watch = Watch::new(SupervisionConfig::default(), ms(0));
        assert_eq!(watch.step(ms(29_999)), Step::Nothing);
        assert_eq!(watch.step(ms(30_000)), Step::Kill);
    }

    #[test]
    fn pauses_double_up_to_their_limit_and_after_five_starts_it_is_given_up() {
        let mut watch = Watch::new(SupervisionConfig { starts: 8, ..SupervisionConfig::default() }, ms(0));
        let (mut now, mut pauses) = (ms(1000), Vec::new());
        loop {
            if watch.lost(now) == Step::GiveUp {
                break;
            }
            let start = (0..).map(|after| now + ms(100 * after)).find(|&at| watch.step(at) == Step::Start).unwrap();
            pauses.push((start - now).as_millis());
            watch.started(start);
            now = start + ms(10);
        }
        assert_eq!(pauses, [200, 400, 800, 1600, 3200, 5000, 5000, 5000]);
        assert!(watch.given_up());
        assert_eq!(watch.step(now + ms(100_000)), Step::Nothing);
        watch.pardon(now);
        assert_eq!(watch.step(now), Step::Start);
    }

    #[test]
    fn one_that_wants_something_is_started_however_often() {
        let mut watch = watch();
        for loss in 0..100 {
            let now = ms(2000 + loss * 1000);
            watch.wants(now);
            assert!(!watch.given_up());
            assert_eq!(watch.step(now + ms(5000)), Step::Start, "loss {loss}");
            watch.started(now);
        }
    }

    #[test]
    fn losses_that_are_long_past_do_not_count() {
        let mut watch = watch();
        for loss in 0..100 {
            let now = ms(2000 + loss * 13_000);
            assert_eq!(watch.lost(now), Step::Nothing, "loss {loss}");
            watch.started(now + ms(1000));
        }
        assert_eq!(watch.losses(), 5);
    }
}
