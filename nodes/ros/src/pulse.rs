//! Signs of life: a node whose launcher listens says on stdout, from its own main loop, that it is alive.

use std::fs::{File, OpenOptions};
use std::io::{ErrorKind, Write as _};
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
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
    /// Where a launcher listens that takes the node over.
    next: Option<PathBuf>,
    /// How often one did.
    taken_over: AtomicU64,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    told: Option<Instant>,
    orphaned: Option<Instant>,
    /// The launcher that has taken over; before, the first one listens on stdout.
    ear: Option<File>,
}

impl State {
    /// Says something to the launcher, and tells whether it can still hear.
    fn say(&mut self, sign: &Sign) -> bool {
        let said = match &mut self.ear {
            None => {
                let mut stdout = std::io::stdout().lock();
                stdout.write_all(sign.line().as_bytes()).and_then(|()| stdout.flush())
            }
            Some(ear) => ear.write_all(sign.line().as_bytes()),
        };
        // A launcher that has much to read yet is there.
        said.is_ok() || said.is_err_and(|error| error.kind() == ErrorKind::WouldBlock)
    }
}

impl Pulse {
    pub(crate) fn new(orphaned_for: Option<Duration>, next: Option<PathBuf>) -> Self {
        Self { orphaned_for, next, taken_over: AtomicU64::new(0), state: Mutex::default() }
    }

    /// The main loop has come by.
    pub(crate) fn beat(&self, now_ns: u64) {
        let Some(limit) = self.orphaned_for else { return };
        let mut state = lock(&self.state);
        if state.told.is_some_and(|told| told.elapsed() < SIGN_EVERY) {
            return;
        }
        state.told = Some(Instant::now());
        let orphaned = state.orphaned;
        match orphaned {
            None if state.say(&Sign::Alive(now_ns)) => {}
            None => {
                state.orphaned = Some(Instant::now());
                tracing::error!("the launcher is gone: this node ends in {} s", limit.as_secs());
            }
            Some(_) if self.turns_to_the_next(&mut state) => {
                tracing::info!("another launcher is there");
                state.orphaned = None;
                self.taken_over.fetch_add(1, Ordering::Relaxed);
            }
            Some(since) if since.elapsed() >= limit => shutdown::end(),
            Some(_) => {}
        }
    }

    /// Whether a launcher listens at the place that was agreed on.
    fn turns_to_the_next(&self, state: &mut State) -> bool {
        let Some(next) = &self.next else { return false };
        // Without a reader it cannot be opened so.
        let nonblocking = rustix::fs::OFlags::NONBLOCK.bits().cast_signed();
        state.ear = OpenOptions::new().write(true).custom_flags(nonblocking).open(next).ok();
        state.ear.is_some()
    }

    /// Tells the launcher that what was ordered befalls this node now; with its number among those, from 0.
    pub(crate) fn tell_struck(&self, number: u64) {
        lock(&self.state).say(&Sign::Struck(number));
    }

    /// How often another launcher has taken over.
    pub(crate) fn taken_over(&self) -> u64 {
        self.taken_over.load(Ordering::Relaxed)
    }

    /// How long the launcher has been gone.
    pub(crate) fn orphaned(&self) -> Option<Duration> {
        lock(&self.state).orphaned.map(|since| since.elapsed())
    }
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

    #[test]
    fn a_node_without_its_launcher_turns_to_the_next_one_as_soon_as_that_listens() {
        let folder = std::env::temp_dir().join(format!("swath-signs-{}", std::process::id()));
        let mode = rustix::fs::Mode::RUSR | rustix::fs::Mode::WUSR;
        let made = rustix::fs::mknodat(rustix::fs::CWD, &folder, rustix::fs::FileType::Fifo, mode, 0);
        made.unwrap();
        let pulse = Pulse::new(Some(Duration::from_secs(60)), Some(folder.clone()));
        let mut state = State::default();
        assert!(!pulse.turns_to_the_next(&mut state), "nobody listens");
        let mut ear = OpenOptions::new().read(true).write(true).open(&folder).unwrap();
        assert!(pulse.turns_to_the_next(&mut state));
        assert!(state.say(&Sign::Alive(7)));
        let mut line = [0; 8];
        std::io::Read::read_exact(&mut ear, &mut line).unwrap();
        assert_eq!(Sign::parse(std::str::from_utf8(&line).unwrap()), Some(Sign::Alive(7)));
        drop(ear);
        assert!(!state.say(&Sign::Alive(8)), "it is gone, too");
        std::fs::remove_file(&folder).unwrap();
    }
}
