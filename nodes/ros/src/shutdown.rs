//! Ctrl-C and SIGTERM as something that a node's loop can look at.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

use crate::error::RosError;
use crate::signal::Signal;

/// Whether the process was asked to end. Clones are the same wish.
#[derive(Clone, Default)]
pub struct Shutdown {
    asked: Arc<AtomicBool>,
}

impl Shutdown {
    /// Watches for Ctrl-C and SIGTERM, which raise `signal` too. A second one ends the process.
    pub fn on_signals(signal: &Signal) -> Result<Self, RosError> {
        let shutdown = Self::default();
        let mut signals = Signals::new([SIGINT, SIGTERM])
            .map_err(|source| RosError::System { what: "signals cannot be watched", source })?;
        let (watcher, wake) = (shutdown.clone(), signal.clone());
        std::thread::Builder::new()
            .name("signals".to_owned())
            .spawn(move || {
                for number in signals.forever() {
                    if watcher.asked() {
                        std::process::exit(128 + number);
                    }
                    watcher.ask();
                    wake.raise();
                }
            })
            .map_err(|source| RosError::System { what: "no thread for signals", source })?;
        Ok(shutdown)
    }

    /// Whether the process was asked to end.
    pub fn asked(&self) -> bool {
        self.asked.load(Ordering::Relaxed)
    }

    /// Asks the process to end.
    pub fn ask(&self) {
        self.asked.store(true, Ordering::Relaxed);
    }
}
