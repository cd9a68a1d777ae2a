//! A topic of an open bag.

use crate::error::Result;
use crate::schema;
use crate::topic::Topic;

/// A topic of an open bag.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BagTopic {
    /// Name, type, schema, QoS.
    pub topic: Topic,
    /// Messages in all files.
    pub messages: u64,
}

impl BagTopic {
    /// Parses the topic's schema.
    ///
    /// # Errors
    /// [`BagError::Schema`] when it is malformed, or of an encoding that is not known.
    pub fn parse_schema(&self) -> Result<schema::Schema> {
        schema::Schema::of(&self.topic)
    }
}
