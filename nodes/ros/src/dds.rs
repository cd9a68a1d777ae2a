//! What the endpoints of a node are made with: a DDS participant in the domain and network of the environment, that can
//! be replaced by another one while the node runs.

use std::any::Any;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, Weak};

use rustdds::no_key::{DataWriter, SimpleDataReader};
use rustdds::{
    DomainParticipant, DomainParticipantBuilder, Publisher as DdsPublisher, QosPolicies, Subscriber as DdsSubscriber,
    TopicKind,
};

use crate::cdr::{Adapter, Cdr};
use crate::endpoint::Gid;
use crate::environment::Environment;
use crate::error::RosError;
use crate::qos::policies;
use crate::signal::lock;
use crate::slot::{Plan, ReaderSlot, Slot, WriterSlot};

/// The participant, and the endpoints made with it.
pub(crate) struct Dds {
    environment: Environment,
    entities: Mutex<Entities>,
    slots: Mutex<Vec<Weak<dyn Slot>>>,
}

/// What endpoints are made with.
pub(crate) struct Entities {
    publisher: DdsPublisher,
    subscriber: DdsSubscriber,
    participant: DomainParticipant,
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
    pub(crate) fn new(environment: &Environment) -> Result<Self, RosError> {
        let entities = Mutex::new(Entities::new(environment)?);
        Ok(Self { environment: environment.clone(), entities, slots: Mutex::default() })
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
        // What is broken may take its time, or panic.
        let farewell = std::thread::Builder::new().name("old DDS".to_owned()).spawn(move || drop((old, former)));
        farewell.map_err(|source| RosError::System { what: "no thread to end DDS", source })?;
        Ok(Renewed { participant, gids, slots })
    }
}

impl Entities {
    fn new(environment: &Environment) -> Result<Self, RosError> {
        let what = format!("a participant in domain {}", environment.domain);
        let failed = |error: rustdds::dds::CreateError| create_error(&what, &error);
        let mut builder = DomainParticipantBuilder::new(environment.domain);
        if let Some(networks) = environment.networks() {
            builder = builder.with_only_networks(networks);
        }
        let participant = builder.build().map_err(failed)?;
        let none = QosPolicies::builder().build();
        let publisher = participant.create_publisher(&none).map_err(failed)?;
        let subscriber = participant.create_subscriber(&none).map_err(failed)?;
        Ok(Self { publisher, subscriber, participant })
    }

    pub(crate) fn writer(&self, plan: &Plan) -> Result<DataWriter<Cdr, Adapter>, RosError> {
        let (topic, policies) = self.topic(plan)?;
        self.publisher
            .create_datawriter_no_key(&topic, Some(policies))
            .map_err(|error| create_error(&format!("a writer of {}", plan.topic), &error))
    }

    pub(crate) fn reader(&self, plan: &Plan) -> Result<SimpleDataReader<Cdr, Adapter>, RosError> {
        let (topic, policies) = self.topic(plan)?;
        self.subscriber
            .create_simple_datareader_no_key(&topic, Some(policies))
            .map_err(|error| create_error(&format!("a reader of {}", plan.topic), &error))
    }

    fn topic(&self, plan: &Plan) -> Result<(rustdds::Topic, QosPolicies), RosError> {
        let policies = policies(&plan.qos);
        let topic =
            self.participant.create_topic(plan.topic.clone(), plan.type_name.clone(), &policies, TopicKind::NoKey);
        let topic = topic.map_err(|error| create_error(&format!("the topic {}", plan.topic), &error))?;
        Ok((topic, policies))
    }
}

fn create_error(what: &str, error: &rustdds::dds::CreateError) -> RosError {
    RosError::Create { what: what.to_owned(), reason: error.to_string() }
}
