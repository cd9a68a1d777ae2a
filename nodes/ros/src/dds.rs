//! What the endpoints of a node are made with: a DDS participant in the domain and network of the environment.

use rustdds::{
    DomainParticipant, DomainParticipantBuilder, Publisher as DdsPublisher, QosPolicies, Subscriber as DdsSubscriber,
    TopicKind,
};

use crate::endpoint::{Adapter, Cdr};
use crate::environment::Environment;
use crate::error::RosError;
use crate::qos::{QosProfile, policies};

/// What endpoints are made with.
pub(crate) struct Dds {
    publisher: DdsPublisher,
    subscriber: DdsSubscriber,
    pub(crate) participant: DomainParticipant,
}

impl Dds {
    pub(crate) fn new(environment: &Environment) -> Result<Self, RosError> {
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

    pub(crate) fn writer(
        &self,
        topic: &str,
        type_name: &str,
        qos: &QosProfile,
    ) -> Result<rustdds::no_key::DataWriter<Cdr, Adapter>, RosError> {
        let what = format!("a writer of {topic}");
        let policies = policies(qos);
        let topic = self.topic(topic, type_name, &policies)?;
        self.publisher.create_datawriter_no_key(&topic, Some(policies)).map_err(|error| create_error(&what, &error))
    }

    pub(crate) fn reader(
        &self,
        topic: &str,
        type_name: &str,
        qos: &QosProfile,
    ) -> Result<rustdds::no_key::SimpleDataReader<Cdr, Adapter>, RosError> {
        let what = format!("a reader of {topic}");
        let policies = policies(qos);
        let topic = self.topic(topic, type_name, &policies)?;
        self.subscriber
            .create_simple_datareader_no_key(&topic, Some(policies))
            .map_err(|error| create_error(&what, &error))
    }

    fn topic(&self, name: &str, type_name: &str, policies: &QosPolicies) -> Result<rustdds::Topic, RosError> {
        self.participant
            .create_topic(name.to_owned(), type_name.to_owned(), policies, TopicKind::NoKey)
            .map_err(|error| create_error(&format!("the topic {name}"), &error))
    }
}

fn create_error(what: &str, error: &rustdds::dds::CreateError) -> RosError {
    RosError::Create { what: what.to_owned(), reason: error.to_string() }
}
