//! Wakes a thread when one of its subscriptions, or anything else that matters to it, has news.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Wake, Waker};
use std::thread::Thread;
use std::time::{Duration, Instant};

/// A flag that one thread waits for and any thread may raise. Clones are the same flag.
#[derive(Clone, Default)]
pub struct Signal {
    shared: Arc<Shared>,
}

#[derive(Default)]
struct Shared {
    raised: AtomicBool,
    waiting: Mutex<Option<Thread>>,
}

impl Wake for Shared {
    fn wake(self: Arc<Self>) {
        self.raise();
    }

    fn wake_by_ref(self: &Arc<Self>) {
        self.raise();
    }
}

impl Shared {
    fn raise(&self) {
        self.raised.store(true, Ordering::Release);
        if let Some(thread) = lock(&self.waiting).as_ref() {
            thread.unpark();
        }
    }
}

impl Signal {
    /// A flag that is not raised.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Raises the flag.
    pub fn raise(&self) {
        self.shared.raise();
    }

    /// Waits until the flag is raised or the time is over, lowers it, and tells whether it was raised.
    ///
    /// A subscription raises the flag for samples that come after its `take` has returned nothing.
    /// So take from each subscription until it has nothing, then wait.
    ///
    /// The thread sleeps at once: with six busy threads on two cores, looking again and again
    /// before sleeping made the loop of `examples/bench_ros.rs` no faster and cost half as much
    /// processor time again.
    #[expect(clippy::must_use_candidate, reason = "who waits for news looks for them itself")]
    pub fn wait(&self, timeout: Duration) -> bool {
        if self.lower() {
            return true;
        }
        let start = Instant::now();
        *lock(&self.shared.waiting) = Some(std::thread::current());
        let raised = loop {
            if self.lower() {
                break true;
            }
            match timeout.checked_sub(start.elapsed()) {
                Some(remaining) if !remaining.is_zero() => std::thread::park_timeout(remaining),
                _ => break false,
            }
        };
        *lock(&self.shared.waiting) = None;
        raised
    }

    /// As [`Self::wait`], but once the flag is raised it lets more news gather for a while.
    ///
    /// For those who need not be quick and read much: waking a thread for each sample costs more
    /// than taking it.
    #[expect(clippy::must_use_candidate, reason = "who waits for news looks for them itself")]
    pub fn wait_gathering(&self, gather: Duration, timeout: Duration) -> bool {
        let raised = self.wait(timeout);
        if raised {
            std::thread::sleep(gather);
            self.lower();
        }
        raised
    }

    /// A waker that raises the flag.
    #[must_use]
    pub fn waker(&self) -> Waker {
        Waker::from(Arc::clone(&self.shared))
    }

    fn lower(&self) -> bool {
        self.shared.raised.swap(false, Ordering::Acquire)
    }
}

/// Locks a mutex whose data cannot be left half-changed by a panic.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_raised_flag_is_seen_once() {
        let signal = Signal::new();
        assert!(!signal.wait(Duration::ZERO));
        signal.raise();
        signal.raise();
        assert!(signal.wait(Duration::ZERO));
        assert!(!signal.wait(Duration::ZERO));
    }

    #[test]
    fn a_waiting_thread_is_woken() {
        let signal = Signal::new();
        let waker = signal.waker();
        std::thread::scope(|scope| {
            let waiting = scope.spawn(|| signal.wait(Duration::from_secs(60)));
            waker.wake_by_ref();
            assert!(waiting.join().unwrap());
        });
    }
}
