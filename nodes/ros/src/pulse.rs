//! Signs of life: a node whose launcher listens says on stdout, from its own main loop, that it is alive.

use std::io::Write as _;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use crate::shutdown;
use crate::signal::lock;

/// How often a node says that it is alive; a launcher expects to hear of it within a few times this.
pub const SIGN_EVERY: Duration = Duration::from_millis(500);

/// What a node's launcher hears on its stdout, a line each; other lines are the program's own.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Sign {
    /// Its main loop turns; with simulated time as it knows it [ns].
    Alive(u64),
    /// What was ordered to befall it befalls it now; with the number among those ordered for it, from 0.
    Struck(u64),
}

const ALIVE: &str = "alive";
const STRUCK: &str = "struck";

impl Sign {
    /// The line.
    #[must_use]
    pub fn line(&self) -> String {
        match self {
            Self::Alive(now_ns) => format!("{ALIVE} {now_ns}\n"),
            Self::Struck(number) => format!("{STRUCK} {number}\n"),
        }
    }

    /// Reads a line; nothing for one that is the program's own.
    #[must_use]
    pub fn parse(line: &str) -> Option<Self> {
        let (word, number) = line.trim_end().split_once(' ')?;
        let number = number.parse().ok()?;
        match word {
            ALIVE => Some(Self::Alive(number)),
            STRUCK => Some(Self::Struck(number)),
            _ => None,
        }
    }
}

/// A node's signs of life.
pub(crate) struct Pulse {
    /// How long it flies on without a launcher; none when no launcher listens at all.
    orphaned_for: Option<Duration>,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    told: Option<Instant>,
    orphaned: Option<Instant>,
}

impl Pulse {
    pub(crate) fn new(orphaned_for: Option<Duration>) -> Self {
        Self { orphaned_for, state: Mutex::default() }
    }

    /// The main loop has come by.
    pub(crate) fn beat(&self, now_ns: u64) {
        let Some(limit) = self.orphaned_for else { return };
        let mut state = lock(&self.state);
        if state.told.is_some_and(|told| told.elapsed() < SIGN_EVERY) {
            return;
        }
        state.told = Some(Instant::now());
        match state.orphaned {
            None if say(&Sign::Alive(now_ns)) => {}
            None => {
                state.orphaned = Some(Instant::now());
                tracing::error!("the launcher is gone: this node ends in {} s", limit.as_secs());
            }
            Some(since) if since.elapsed() >= limit => shutdown::end(),
            Some(_) => {}
        }
    }

    /// How long the launcher has been gone.
    pub(crate) fn orphaned(&self) -> Option<Duration> {
        lock(&self.state).orphaned.map(|since| since.elapsed())
    }
}

/// Says something to the launcher, and tells whether it can still hear.
pub(crate) fn say(sign: &Sign) -> bool {
    let mut stdout = std::io::stdout().lock();
    stdout.write_all(sign.line().as_bytes()).and_then(|()| stdout.flush()).is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signs_are_read_as_they_are_written() {
        for sign in [Sign::Alive(12_500_000_000), Sign::Struck(3)] {
            assert_eq!(Sign::parse(&sign.line()), Some(sign));
        }
        for line in ["", "alive", "alive x", "alive -1", "{\"event\":\"ready\"}", "dead 3"] {
            assert_eq!(Sign::parse(line), None, "{line}");
        }
    }
}
