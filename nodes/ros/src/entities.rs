//! A DDS participant in the domain and network of the environment, and the endpoints that it makes.

use rustdds::no_key::{DataWriter, SimpleDataReader};
use rustdds::{
    DomainParticipant, DomainParticipantBuilder, Publisher as DdsPublisher, QosPolicies, Subscriber as DdsSubscriber,
    TopicKind,
};

use crate::cdr::{Adapter, Cdr};
use crate::environment::Environment;
use crate::error::RosError;
use crate::qos::{QosProfile, policies};

/// What an endpoint is made from.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    /// DDS name of the topic.
    pub(crate) topic: String,
    /// DDS name of its type.
    pub(crate) type_name: String,
    pub(crate) qos: QosProfile,
}

/// What endpoints are made with.
pub(crate) struct Entities {
    publisher: DdsPublisher,
    subscriber: DdsSubscriber,
    pub(crate) participant: DomainParticipant,
}

impl Entities {
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
