//! The thread that writes the journal to the store, so that nothing else waits for the disk.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use swath_ros::Signal;

use super::store::{Durability, Store, StoreError};
use swath_mission::requests::journal::{Entry, Progress};

/// Writes batches of the journal in the order in which they come. Where there is no room it tries again until there is.
pub struct Writer {
    batches: Option<Sender<Batch>>,
    thread: Option<JoinHandle<Result<(), StoreError>>>,
    told: Arc<Told>,
    given: u64,
}

/// What the thread and the others tell each other.
#[derive(Default)]
struct Told {
    /// Number of the last batch that is written.
    written: AtomicU64,
    /// Whether there is no room for the next one.
    full: AtomicBool,
    /// Whether there is to be none, by order.
    full_by_order: AtomicBool,
}

struct Batch {
    number: u64,
    entries: Arc<Vec<Entry>>,
    progress: Progress,
    durability: Durability,
}

/// Batches that are written in one transaction at most.
const GROUP_MAX: usize = 64;
/// After how long it is looked again whether there is room.
const LOOK_AGAIN: Duration = Duration::from_millis(200);
/// How long room is waited for at the end.
const LAST_WAIT: Duration = Duration::from_secs(2);

impl Writer {
    /// Starts the thread; it raises the signal when something has been written, when there is no room, and when writing
    /// has failed.
    #[must_use]
    pub fn start(store: Store, signal: Signal) -> Self {
        let (batches, receiver) = channel();
        let told = Arc::new(Told::default());
        let tells = Arc::clone(&told);
        let thread = std::thread::spawn(move || {
            let outcome = write_all(store, &receiver, &tells, &signal);
            signal.raise();
            outcome
        });
        Self { batches: Some(batches), thread: Some(thread), told, given: 0 }
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
        self.told.written.load(Ordering::Acquire)
    }

    /// Whether there is no room for what was handed over.
    #[must_use]
    pub fn full(&self) -> bool {
        self.told.full.load(Ordering::Acquire)
    }

    /// From now on there is no room, or as much as there is: a fault by order.
    pub fn set_full_by_order(&self, full: bool) {
        self.told.full_by_order.store(full, Ordering::Release);
    }

    /// Fails when writing has failed.
    ///
    /// # Errors
    /// Why writing has failed.
    pub fn check(&mut self) -> Result<(), StoreError> {
        if self.thread.as_ref().is_some_and(JoinHandle::is_finished) { self.finish() } else { Ok(()) }
    }

    /// Writes what is left and ends the thread. Orders are over.
    ///
    /// # Errors
    /// Why writing has failed.
    pub fn finish(&mut self) -> Result<(), StoreError> {
        self.set_full_by_order(false);
        self.batches = None;
        match self.thread.take().map(JoinHandle::join) {
            Some(Ok(outcome)) => outcome,
            Some(Err(panic)) => std::panic::resume_unwind(panic),
            None => Ok(()),
        }
    }
}

fn write_all(mut store: Store, receiver: &Receiver<Batch>, told: &Told, signal: &Signal) -> Result<(), StoreError> {
    let mut group = Vec::new();
    let mut over: Option<Instant> = None;
    loop {
        if group.is_empty() {
            match receiver.recv() {
                Ok(first) => group.push(first),
                Err(_) => return Ok(()),
            }
        }
        group.extend(receiver.try_iter().take(GROUP_MAX.saturating_sub(group.len())));
        match write_group(&mut store, &group, told) {
            Ok(number) => {
                group.clear();
                told.full.store(false, Ordering::Release);
                told.written.store(number, Ordering::Release);
                signal.raise();
                over = None;
            }
            Err(error) if error.is_full() && over.is_none_or(|since| since.elapsed() < LAST_WAIT) => {
                if !told.full.swap(true, Ordering::AcqRel) {
                    tracing::error!("{error}; it is tried again");
                    signal.raise();
                }
                match receiver.recv_timeout(LOOK_AGAIN) {
                    Ok(next) => group.push(next),
                    Err(RecvTimeoutError::Timeout) => {}
                    Err(RecvTimeoutError::Disconnected) => {
                        over.get_or_insert_with(Instant::now);
                        std::thread::sleep(LOOK_AGAIN);
                    }
                }
            }
            Err(error) => return Err(error),
        }
    }
}

/// Writes batches in one transaction; returns the number of the last one.
fn write_group(store: &mut Store, group: &[Batch], told: &Told) -> Result<u64, StoreError> {
    let durability = group.iter().map(|batch| batch.durability).max().unwrap_or(Durability::Machine);
    let Some(last) = group.last() else { return Ok(0) };
    if told.full_by_order.load(Ordering::Acquire) {
        return Err(store.full());
    }
    store.write(group.iter().flat_map(|batch| batch.entries.iter()), &last.progress, durability)?;
    Ok(last.number)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn until(what: &str, mut look: impl FnMut() -> bool) {
        let begin = Instant::now();
        while !look() {
            assert!(begin.elapsed() < Duration::from_secs(20), "{what}");
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    #[test]
    fn what_has_no_room_is_written_when_there_is_some() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(&folder.path().join("s.sqlite"), "m").unwrap();
        let mut writer = Writer::start(store, Signal::new());
        let write = |writer: &mut Writer| writer.write(Arc::default(), Progress::default(), Durability::Machine);
        write(&mut writer);
        until("the first batch", || writer.written() == 1);
        assert!(!writer.full());
        writer.set_full_by_order(true);
        let numbers: Vec<u64> = (0..100).map(|_| write(&mut writer)).collect();
        until("no room", || writer.full());
        std::thread::sleep(2 * LOOK_AGAIN);
        assert!(writer.full() && writer.written() == 1);
        writer.set_full_by_order(false);
        until("all batches", || Some(&writer.written()) == numbers.last());
        assert!(!writer.full());
        writer.finish().unwrap();
    }

    #[test]
    fn orders_are_over_at_the_end() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.sqlite");
        let mut writer = Writer::start(Store::open(&path, "m").unwrap(), Signal::new());
        writer.set_full_by_order(true);
        writer.write(Arc::default(), Progress::default(), Durability::Machine);
        until("no room", || writer.full());
        writer.finish().unwrap();
        assert_eq!(writer.written(), 1);
        assert!(Store::open(&path, "m").unwrap().snapshot().unwrap().begun);
    }

    #[test]
    fn other_failures_end_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.sqlite");
        let mut writer = Writer::start(Store::open(&path, "m").unwrap(), Signal::new());
        // Whoever opened the store last writes it.
        let _other = Store::open(&path, "m").unwrap();
        writer.write(Arc::default(), Progress::default(), Durability::Process);
        let mut ended = Ok(());
        until("the end", || {
            ended = writer.check();
            ended.is_err()
        });
        assert!(matches!(ended, Err(StoreError::TakenOver { .. })));
    }
}
