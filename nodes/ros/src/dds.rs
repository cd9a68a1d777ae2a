//! What the endpoints of a node are made with: a DDS participant in the domain and network of the environment, that can
//! be replaced by another one while the node runs.

use std::any::Any;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, Weak};
use std::time::{Duration, Instant};

use ros2_client::Gid;
use rustdds::DomainParticipant;

use crate::entities::{Entities, Plan};
use crate::environment::Environment;
use crate::error::RosError;
use crate::screen;
use crate::signal::lock;
use crate::slot::{ReaderSlot, Slot, WriterSlot};

/// The participant, and the endpoints made with it.
pub(crate) struct Dds {
    environment: Environment,
    /// Whether the kernel keeps from it what would hurt it.
    screened: bool,
    entities: Mutex<Entities>,
    slots: Mutex<Vec<Weak<dyn Slot>>>,
}

/// What a new participant brings.
pub(crate) struct Renewed {
    pub(crate) participant: DomainParticipant,
    /// The new identity of each endpoint, by the old one.
    pub(crate) gids: BTreeMap<Gid, Gid>,
    slots: Vec<Arc<dyn Slot>>,
}

impl Renewed {
    /// The endpoints go on where they were.
    pub(crate) fn resume(&self) {
        self.slots.iter().for_each(|slot| slot.resume());
    }
}

impl Dds {
    pub(crate) fn new(environment: &Environment, screened: bool) -> Result<Self, RosError> {
        let entities = Mutex::new(Entities::new(environment)?);
        let dds = Self { environment: environment.clone(), screened, entities, slots: Mutex::default() };
        dds.put_up_screen();
        Ok(dds)
    }

    fn put_up_screen(&self) {
        if self.screened
            && let Err(error) = screen::put_up(self.environment.domain)
        {
            tracing::warn!("the kernel takes no packet filter for DDS: {error}");
        }
    }

    /// Datagrams that the kernel did not hand over so far: they would have done harm, or came faster than they were
    /// taken.
    pub(crate) fn dropped(&self) -> u64 {
        if self.screened { screen::dropped(self.environment.domain) } else { 0 }
    }

    /// The participant of the moment.
    pub(crate) fn participant(&self) -> DomainParticipant {
        lock(&self.entities).participant.clone()
    }

    pub(crate) fn writer(&self, plan: Plan) -> Result<Arc<WriterSlot>, RosError> {
        let entities = lock(&self.entities);
        let slot = Arc::new(WriterSlot::new(plan, &entities)?);
        self.remember(Arc::downgrade(&slot) as Weak<dyn Slot>);
        Ok(slot)
    }

    pub(crate) fn reader(&self, plan: Plan) -> Result<Arc<ReaderSlot>, RosError> {
        let entities = lock(&self.entities);
        let slot = Arc::new(ReaderSlot::new(plan, &entities)?);
        self.remember(Arc::downgrade(&slot) as Weak<dyn Slot>);
        Ok(slot)
    }

    fn remember(&self, slot: Weak<dyn Slot>) {
        let mut slots = lock(&self.slots);
        slots.retain(|slot| slot.strong_count() > 0);
        slots.push(slot);
    }

    /// Waits until every reliable reader has all samples of these writers, and tells whether that is so.
    pub(crate) fn flush(&self, writers: &BTreeSet<Gid>, timeout: Duration) -> bool {
        let deadline = Instant::now() + timeout;
        let mut slots: Vec<Arc<dyn Slot>> = lock(&self.slots).iter().filter_map(Weak::upgrade).collect();
        slots.retain(|slot| writers.contains(&slot.gid()));
        slots.iter().all(|slot| slot.flush(deadline.saturating_duration_since(Instant::now())))
    }

    /// Replaces the participant and all endpoints.
    ///
    /// # Errors
    /// If there is no new participant to be had; then the old one remains.
    pub(crate) fn renew(&self) -> Result<Renewed, RosError> {
        let mut entities = lock(&self.entities);
        let new = Entities::new(&self.environment)?;
        let slots: Vec<Arc<dyn Slot>> = lock(&self.slots).iter().filter_map(Weak::upgrade).collect();
        let (mut gids, mut old) = (BTreeMap::new(), Vec::<Box<dyn Any + Send>>::new());
        for slot in &slots {
            let (gid, endpoint) = slot.renew(&new)?;
            gids.insert(gid, slot.gid());
            old.push(endpoint);
        }
        let participant = new.participant.clone();
        let former = std::mem::replace(&mut *entities, new);
        self.put_up_screen();
        // What is broken may take its time, or panic.
        let farewell = std::thread::Builder::new().name("old DDS".to_owned()).spawn(move || drop((old, former)));
        farewell.map_err(|source| RosError::System { what: "no thread to end DDS", source })?;
        Ok(Renewed { participant, gids, slots })
    }
}
