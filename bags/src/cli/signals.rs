//! Ctrl-C and SIGTERM for programs that must not be torn away from what they are closing.

use std::process::exit;
use std::thread;
use std::time::{Duration, Instant};

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;
use swath_ros::{Shutdown, Signal};

use crate::error::{BagError, Result};

/// How long after the first signal the following ones are taken for the same wish [wall time]: a terminal sends one to
/// every process of a launch, and the launcher sends another to its own.
const SAME_WISH: Duration = Duration::from_secs(10);

/// Watches for signals that ask for the end, which raise `signal` too. Only one that comes long after the first ends the
/// process at once.
///
/// # Errors
/// [`BagError::Io`] when the system lets no signals be watched.
pub(super) fn shutdown_on_signals(signal: &Signal) -> Result<Shutdown> {
    let refused = |source| BagError::Io { action: "watch", path: "signals".into(), source };
    let shutdown = Shutdown::default();
    let mut signals = Signals::new([SIGINT, SIGTERM]).map_err(refused)?;
    let (watcher, wake) = (shutdown.clone(), signal.clone());
    let watch = move || {
        let mut first: Option<Instant> = None;
        for number in signals.forever() {
            if first.get_or_insert_with(Instant::now).elapsed() > SAME_WISH {
                exit(128 + number);
            }
            watcher.ask();
            wake.raise();
        }
    };
    thread::Builder::new().name("signals".to_owned()).spawn(watch).map_err(refused)?;
    Ok(shutdown)
}
