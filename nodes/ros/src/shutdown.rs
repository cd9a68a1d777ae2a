//! Ctrl-C and SIGTERM as something that a node's loop can look at.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

use crate::error::RosError;
use crate::signal::Signal;

/// A signal that comes so soon after the first is the same wish: Ctrl-C goes to all programs of a terminal, and what
/// started a program passes it on.
const SAME_WISH: Duration = Duration::from_secs(1);

/// Whether a signal has asked this process to end.
static SIGNALLED: AtomicBool = AtomicBool::new(false);

/// Whether a signal that is watched for has come.
pub(crate) fn signalled() -> bool {
    SIGNALLED.load(Ordering::Relaxed)
}

/// Whether this process ends by itself, because nobody is there for whom it works.
static ENDED: AtomicBool = AtomicBool::new(false);

/// Ends this process as a signal would.
pub(crate) fn end() {
    ENDED.store(true, Ordering::Relaxed);
}

/// Whether the process was asked to end. Clones are the same wish.
#[derive(Clone, Default)]
pub struct Shutdown {
    asked: Arc<AtomicBool>,
}

impl Shutdown {
    /// Watches for Ctrl-C and SIGTERM, which raise `signal` too. One that comes more than a second later ends the
    /// process.
    ///
    /// # Errors
    /// [`RosError::System`] when signals cannot be watched.
    pub fn on_signals(signal: &Signal) -> Result<Self, RosError> {
        let shutdown = Self::default();
        let mut signals = Signals::new([SIGINT, SIGTERM])
            .map_err(|source| RosError::System { what: "signals cannot be watched", source })?;
        let (watcher, wake) = (shutdown.clone(), signal.clone());
        std::thread::Builder::new()
            .name("signals".to_owned())
            .spawn(move || {
                let mut first = None;
                for number in signals.forever() {
                    if first.get_or_insert_with(Instant::now).elapsed() > SAME_WISH {
                        std::process::exit(128 + number);
                    }
                    SIGNALLED.store(true, Ordering::Relaxed);
                    watcher.ask();
                    wake.raise();
                }
            })
            .map_err(|source| RosError::System { what: "no thread for signals", source })?;
        Ok(shutdown)
    }

    /// Whether the process was asked to end.
    #[must_use]
    pub fn asked(&self) -> bool {
        self.asked.load(Ordering::Relaxed) || ENDED.load(Ordering::Relaxed)
    }

    /// Asks the process to end.
    pub fn ask(&self) {
        self.asked.store(true, Ordering::Relaxed);
    }
}
