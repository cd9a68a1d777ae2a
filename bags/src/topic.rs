//! What a bag knows about a topic.

use std::collections::BTreeMap;
use std::sync::Arc;

use mcap::records::Channel;

use crate::error::{BagError, Result};
use crate::file::parts::Schema;
use crate::qos::{self, QosProfile, QosTexts};

/// The key of a channel's metadata under which QoS profiles stand.
const QOS: &str = "offered_qos_profiles";
/// The key of a channel's metadata under which the type's hash stands.
const TYPE_HASH: &str = "topic_type_hash";

/// How the messages of a topic are described.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Definition {
    /// `ros2msg`, `ros2idl` and others; empty when no schema is known.
    pub encoding: String,
    /// The schema, byte for byte; a text for `ros2msg`, with its dependencies.
    pub data: Arc<[u8]>,
}

/// A topic as it is recorded: name, type and what readers need to decode it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Topic {
    /// Full name, `/swath/state`.
    pub name: String,
    /// `pkg/msg/Type`.
    pub type_name: String,
    /// The schema; `None` for a channel that has none, and no type either.
    pub definition: Option<Definition>,
    /// `cdr`, as ROS 2 sends messages.
    pub message_encoding: String,
    /// The channel's metadata: for ROS 2 the QoS profiles and the type's hash.
    pub metadata: BTreeMap<String, String>,
    /// What the publishers offered, as the metadata tells it; nothing when that is not known, or at fault.
    pub qos: Vec<QosProfile>,
}

/// What makes two topics one.
pub(crate) type TopicKey = (String, String, Option<Definition>, String, BTreeMap<String, String>);

impl Topic {
    /// Checks the names and puts the QoS profiles into their stored form.
    ///
    /// # Errors
    /// [`BagError::Topic`] when the name is no full topic name or the type no `pkg/msg/Type`.
    pub fn new(name: &str, type_name: &str, schema: &str, type_hash: &str, qos: Vec<QosProfile>) -> Result<Self> {
        let refuse = |reason: String| BagError::Topic { topic: name.to_owned(), reason };
        if !name.starts_with('/') || name.len() < 2 {
            return Err(refuse("a full topic name starts with / and has more".to_owned()));
        }
        if !is_type_name(type_name) {
            return Err(refuse(format!("{type_name:?} is no type name of the form pkg/msg/Type")));
        }
        let encoding = if schema.is_empty() { "" } else { "ros2msg" }.to_owned();
        let metadata = [(QOS, qos::to_yaml(&qos)?), (TYPE_HASH, type_hash.to_owned())];
        Ok(Self {
            name: name.to_owned(),
            type_name: type_name.to_owned(),
            definition: Some(Definition { encoding, data: schema.as_bytes().into() }),
            message_encoding: "cdr".to_owned(),
            metadata: metadata.into_iter().map(|(key, value)| (key.to_owned(), value)).collect(),
            qos,
        })
    }

    /// A channel of an MCAP file with its schema, as it stands.
    pub(crate) fn of_channel(channel: &Channel, schema: Option<&Schema>, texts: &mut QosTexts) -> Self {
        let definition = |schema: &Schema| Definition { encoding: schema.encoding.clone(), data: schema.data.clone() };
        Self {
            name: channel.topic.clone(),
            type_name: schema.map(|schema| schema.name.clone()).unwrap_or_default(),
            definition: schema.map(definition),
            message_encoding: channel.message_encoding.clone(),
            metadata: channel.metadata.clone(),
            qos: channel.metadata.get(QOS).map(|text| texts.parse(text)).unwrap_or_default(),
        }
    }

    /// What makes it the same topic as another.
    pub(crate) fn key(&self) -> TopicKey {
        let (name, type_name) = (self.name.clone(), self.type_name.clone());
        (name, type_name, self.definition.clone(), self.message_encoding.clone(), self.metadata.clone())
    }

    /// `ros2msg`, `ros2idl` and others; empty without a schema.
    #[must_use]
    pub fn schema_encoding(&self) -> &str {
        self.definition.as_ref().map_or("", |definition| &definition.encoding)
    }

    /// The schema's bytes; empty without one.
    #[must_use]
    pub fn schema(&self) -> &[u8] {
        self.definition.as_ref().map_or(&[], |definition| &definition.data)
    }

    /// `RIHS01_…`; empty when it is not known.
    pub fn type_hash(&self) -> &str {
        self.metadata.get(TYPE_HASH).map_or("", String::as_str)
    }

    /// What the publishers offered; `None` when the channel does not tell.
    ///
    /// # Errors
    /// [`BagError::Qos`] when the text is at fault.
    #[must_use]
    pub fn offered_qos(&self) -> Option<Result<Vec<QosProfile>>> {
        self.metadata.get(QOS).map(|text| qos::from_yaml(text))
    }

    /// Changes what the publishers are said to have offered.
    pub(crate) fn set_qos(&mut self, qos: Vec<QosProfile>) -> Result<()> {
        self.metadata.insert(QOS.to_owned(), qos::to_yaml(&qos)?);
        self.qos = qos;
        Ok(())
    }

    /// The topic as a new bag holds it: its QoS profiles in words.
    pub(crate) fn in_words(&self) -> Self {
        let mut topic = self.clone();
        if let Some(text) = topic.metadata.get_mut(QOS) {
            *text = qos::in_words(text).into_owned();
        }
        topic
    }

    /// The type's name in full, where it is written without its middle part as in ROS 1.
    #[must_use]
    pub fn full_type_name(&self) -> String {
        match self.type_name.split_once('/') {
            Some((package, name)) if !name.contains('/') => format!("{package}/msg/{name}"),
            _ => self.type_name.clone(),
        }
    }
}

/// Whether a text has the form `pkg/msg/Type` (or `srv`, `action` in the middle).
pub(crate) fn is_type_name(text: &str) -> bool {
    let word = |s: &str| {
        s.starts_with(|c: char| c.is_ascii_alphabetic()) && s.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
    };
    let parts: Vec<&str> = text.split('/').collect();
    matches!(parts[..], [package, "msg" | "srv" | "action", name] if word(package) && word(name))
}
