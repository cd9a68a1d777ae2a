//! The thread that writes the journal to the store, so that nothing else waits for the disk.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;

use swath_ros::Signal;

use super::store::{Durability, Store, StoreError};
use swath_mission::requests::journal::{Entry, Progress};

/// Writes batches of the journal in the order in which they come.
pub struct Writer {
    batches: Option<Sender<Batch>>,
    thread: Option<JoinHandle<Result<(), StoreError>>>,
    written: Arc<AtomicU64>,
    given: u64,
}

struct Batch {
    number: u64,
    entries: Arc<Vec<Entry>>,
    progress: Progress,
    durability: Durability,
}

/// Batches that are written in one transaction at most.
const GROUP_MAX: usize = 64;

impl Writer {
    /// Starts the thread; it raises the signal when something has been written, and when writing has failed.
    #[must_use]
    pub fn start(store: Store, signal: Signal) -> Self {
        let (batches, receiver) = channel();
        let written = Arc::new(AtomicU64::new(0));
        let done = Arc::clone(&written);
        let thread = std::thread::spawn(move || {
            let outcome = write_all(store, &receiver, &done, &signal);
            signal.raise();
            outcome
        });
        Self { batches: Some(batches), thread: Some(thread), written, given: 0 }
    }

    /// Hands over a batch; it is written when [`Self::written`] has reached the number that this returns.
    pub fn write(&mut self, entries: Arc<Vec<Entry>>, progress: Progress, durability: Durability) -> u64 {
        self.given += 1;
        if let Some(batches) = &self.batches {
            // A thread that has failed is noticed by `check`.
            let _ = batches.send(Batch { number: self.given, entries, progress, durability });
        }
        self.given
    }

    /// Number of the last batch that was handed over.
    #[must_use]
    pub fn given(&self) -> u64 {
        self.given
    }

    /// Number of the last batch that is written.
    #[must_use]
    pub fn written(&self) -> u64 {
        self.written.load(Ordering::Acquire)
    }

    /// Fails when writing has failed.
    ///
    /// # Errors
    /// Why writing has failed.
    pub fn check(&mut self) -> Result<(), StoreError> {
        if self.thread.as_ref().is_some_and(JoinHandle::is_finished) { self.finish() } else { Ok(()) }
    }

    /// Writes what is left and ends the thread.
    ///
    /// # Errors
    /// Why writing has failed.
    pub fn finish(&mut self) -> Result<(), StoreError> {
        self.batches = None;
        match self.thread.take().map(JoinHandle::join) {
            Some(Ok(outcome)) => outcome,
            Some(Err(panic)) => std::panic::resume_unwind(panic),
            None => Ok(()),
        }
    }
}

fn write_all(
    mut store: Store,
    receiver: &Receiver<Batch>,
    written: &AtomicU64,
    signal: &Signal,
) -> Result<(), StoreError> {
    while let Ok(first) = receiver.recv() {
        let mut group = vec![first];
        group.extend(receiver.try_iter().take(GROUP_MAX - 1));
        let durability = group.iter().map(|batch| batch.durability).max().unwrap_or(Durability::Machine);
        if let Some(last) = group.last() {
            let (number, progress) = (last.number, last.progress);
            store.write(group.iter().flat_map(|batch| batch.entries.iter()), &progress, durability)?;
            written.store(number, Ordering::Release);
            signal.raise();
        }
    }
    Ok(())
}
