//! What a bag knows about a topic.

use crate::{
    error::{BagError, Result},
    qos::{self, QosProfile},
};

/// A topic as it is recorded: name, type and what readers need to decode it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Topic {
    /// Full name, `/swath/state`.
    pub name: String,
    /// `pkg/msg/Type`.
    pub type_name: String,
    /// The `.msg` text with its dependencies, as `ros2msg` schemas have it; empty when unknown.
    pub schema: String,
    /// `RIHS01_…`, or empty.
    pub type_hash: String,
    /// `ros2msg`; empty when no schema is known.
    pub schema_encoding: String,
    /// `cdr`, as ROS 2 sends messages.
    pub message_encoding: String,
    /// What the publishers offered.
    pub qos: Vec<QosProfile>,
    /// `qos` as the channel's metadata holds it.
    pub(crate) qos_yaml: String,
}

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
        Ok(Self {
            name: name.to_owned(),
            type_name: type_name.to_owned(),
            schema: schema.to_owned(),
            schema_encoding: if schema.is_empty() { "" } else { "ros2msg" }.to_owned(),
            message_encoding: "cdr".to_owned(),
            type_hash: type_hash.to_owned(),
            qos_yaml: qos::to_yaml(&qos)?,
            qos,
        })
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
