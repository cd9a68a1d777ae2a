//! Where a writer or reader of RustDDS stands, so that it can be replaced by another one.

use std::any::Any;
use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError, RwLock, RwLockReadGuard};
use std::task::{Wake, Waker};
use std::time::{Duration, Instant};

use ros2_client::Gid;
use rustdds::dds::{ReadResult, WriteResult};
use rustdds::no_key::{DataWriter, DeserializedCacheChange, SimpleDataReader};
use rustdds::{RTPSEntity as _, SampleIdentity, WriteOptions};

use crate::cdr::{Adapter, Cdr};
use crate::entities::{Entities, Plan};
use crate::error::RosError;
use crate::qos::Durability;
use crate::signal::{Signal, lock};

/// How long the last samples of a writer that goes may take to arrive.
const LAST_WORDS: Duration = Duration::from_millis(100);

/// How long its readers have to hand them out: a reader of RustDDS forgets what it has not handed out yet when the
/// writer goes.
const LINGER: Duration = Duration::from_millis(50);

type DdsWriter = DataWriter<Cdr, Adapter>;
type DdsReader = SimpleDataReader<Cdr, Adapter>;

/// What can be made anew with another participant.
pub(crate) trait Slot: Send + Sync {
    /// Makes the endpoint anew; returns the old one and its identity.
    fn renew(&self, entities: &Entities) -> Result<(Gid, Box<dyn Any + Send>), RosError>;

    /// The endpoint's identity.
    fn gid(&self) -> Gid;

    /// The new endpoint is known to all: it goes on where the old one was.
    fn resume(&self);

    /// Waits until every reliable reader has all samples, and tells whether that is so.
    fn flush(&self, timeout: Duration) -> bool;
}

/// A writer.
pub(crate) struct WriterSlot {
    plan: Plan,
    writer: RwLock<DdsWriter>,
    /// The last sample, if it is kept for readers that come later.
    last: Mutex<Option<(Cdr, WriteOptions)>>,
    born: Instant,
    /// When it wrote last [ms after `born`]; 0 if it never has.
    written: AtomicU64,
}

impl WriterSlot {
    pub(crate) fn new(plan: Plan, entities: &Entities) -> Result<Self, RosError> {
        let writer = RwLock::new(entities.writer(&plan)?);
        Ok(Self { plan, writer, last: Mutex::default(), born: Instant::now(), written: AtomicU64::new(0) })
    }

    /// Writes a sample; waits for at most `qos::BLOCKING`.
    pub(crate) fn write(&self, cdr: Cdr, options: WriteOptions) -> WriteResult<SampleIdentity, Cdr> {
        if self.plan.qos.durability == Durability::TransientLocal {
            *lock(&self.last) = Some((cdr.clone(), options.clone()));
        }
        self.written.store(self.age_ms().max(1), Ordering::Relaxed);
        read(&self.writer).write_with_options(cdr, options)
    }

    /// Waits until every reliable reader has all samples, and tells whether that is so.
    pub(crate) fn flush(&self, timeout: Duration) -> bool {
        read(&self.writer).wait_for_acknowledgments(timeout).unwrap_or(false)
    }

    fn age_ms(&self) -> u64 {
        self.born.elapsed().as_millis() as u64
    }

    /// Waits until the last samples can be expected to have arrived, before the writer goes.
    pub(crate) fn take_leave(&self) {
        let written = self.written.load(Ordering::Relaxed);
        if written == 0 {
            return;
        }
        self.flush(LAST_WORDS);
        let quiet = Duration::from_millis(self.age_ms().saturating_sub(written));
        std::thread::sleep(LINGER.saturating_sub(quiet));
    }

    /// The writer's identity.
    pub(crate) fn gid(&self) -> Gid {
        read(&self.writer).guid().into()
    }
}

impl Slot for WriterSlot {
    fn renew(&self, entities: &Entities) -> Result<(Gid, Box<dyn Any + Send>), RosError> {
        let writer = entities.writer(&self.plan)?;
        let old = std::mem::replace(&mut *self.writer.write().unwrap_or_else(PoisonError::into_inner), writer);
        Ok((old.guid().into(), Box::new(old)))
    }

    fn gid(&self) -> Gid {
        Self::gid(self)
    }

    fn resume(&self) {
        let last = lock(&self.last).clone();
        if let Some((cdr, options)) = last
            && let Err(error) = read(&self.writer).write_with_options(cdr, options)
        {
            tracing::warn!("what was latched on {} is lost: {error}", self.plan.topic);
        }
    }

    fn flush(&self, timeout: Duration) -> bool {
        Self::flush(self, timeout)
    }
}

/// A reader.
pub(crate) struct ReaderSlot {
    plan: Plan,
    reader: RwLock<DdsReader>,
    bell: Mutex<Option<Arc<Bell>>>,
    /// What the reader before this one had not handed out yet.
    left: Mutex<VecDeque<DeserializedCacheChange<Cdr>>>,
}

impl ReaderSlot {
    pub(crate) fn new(plan: Plan, entities: &Entities) -> Result<Self, RosError> {
        let reader = RwLock::new(entities.reader(&plan)?);
        Ok(Self { plan, reader, bell: Mutex::default(), left: Mutex::default() })
    }

    /// The next sample, if there is one.
    pub(crate) fn take(&self) -> ReadResult<Option<DeserializedCacheChange<Cdr>>> {
        let reader = read(&self.reader);
        if let Some(sample) = lock(&self.left).pop_front() {
            return Ok(Some(sample));
        }
        reader.try_take_one()
    }

    /// A bell that raises this signal, instead of the one before.
    pub(crate) fn hang(&self, signal: &Signal) -> Arc<Bell> {
        let bell = Arc::new(Bell { quiet: AtomicBool::new(false), signal: signal.clone() });
        *lock(&self.bell) = Some(Arc::clone(&bell));
        bell
    }

    /// The next sample rings this bell.
    pub(crate) fn set_waker(&self, bell: &Arc<Bell>) {
        read(&self.reader).set_waker(Some(Waker::from(Arc::clone(bell))));
    }

    /// The reader's identity.
    pub(crate) fn gid(&self) -> Gid {
        read(&self.reader).guid().into()
    }
}

impl Slot for ReaderSlot {
    fn renew(&self, entities: &Entities) -> Result<(Gid, Box<dyn Any + Send>), RosError> {
        let reader = entities.reader(&self.plan)?;
        let mut current = self.reader.write().unwrap_or_else(PoisonError::into_inner);
        let old = std::mem::replace(&mut *current, reader);
        let mut left = lock(&self.left);
        while let Ok(Some(sample)) = old.try_take_one() {
            left.push_back(sample);
        }
        Ok((old.guid().into(), Box::new(old)))
    }

    fn gid(&self) -> Gid {
        Self::gid(self)
    }

    fn resume(&self) {
        if let Some(bell) = lock(&self.bell).as_ref() {
            bell.wake_by_ref();
        }
    }

    /// A reader has nothing to say.
    fn flush(&self, _: Duration) -> bool {
        true
    }
}

/// What DDS rings when a sample comes.
pub(crate) struct Bell {
    /// Nothing was there when DDS was last asked, and it has not rung since.
    quiet: AtomicBool,
    signal: Signal,
}

impl Wake for Bell {
    fn wake(self: Arc<Self>) {
        self.wake_by_ref();
    }

    fn wake_by_ref(self: &Arc<Self>) {
        self.expect();
        self.signal.raise();
    }
}

impl Bell {
    /// Whether nothing can have come since DDS was last asked.
    pub(crate) fn is_quiet(&self) -> bool {
        self.quiet.load(Ordering::Acquire)
    }

    /// There was nothing: until it rings there is nothing to ask for.
    pub(crate) fn wait(&self) {
        self.quiet.store(true, Ordering::Release);
    }

    /// There may be something.
    pub(crate) fn expect(&self) {
        self.quiet.store(false, Ordering::Release);
    }
}

fn read<T>(lock: &RwLock<T>) -> RwLockReadGuard<'_, T> {
    lock.read().unwrap_or_else(PoisonError::into_inner)
}
