//! The bag as a sink of the tap.

use crate::error::Result;
use crate::tap::{Sink, Tapped};
use crate::topic::Topic;
use crate::writer::{BagSummary, BagWriter, TopicId};

/// Writes what comes out of the tap into a bag.
pub struct BagSink {
    writer: BagWriter,
    /// The bag's topics, by their numbers in the tap.
    topics: Vec<TopicId>,
    /// Whether messages are let go by.
    pub paused: bool,
}

impl BagSink {
    /// A sink into a new bag.
    #[must_use]
    pub fn new(writer: BagWriter) -> Self {
        Self { writer, topics: Vec::new(), paused: false }
    }

    /// The bag's writer.
    #[must_use]
    pub fn writer(&self) -> &BagWriter {
        &self.writer
    }

    /// Closes the bag.
    ///
    /// # Errors
    /// As [`BagWriter::close`].
    pub fn close(self) -> Result<BagSummary> {
        self.writer.close()
    }
}

impl Sink for BagSink {
    fn topic(&mut self, _number: usize, topic: &Topic) -> Result<()> {
        self.topics.push(self.writer.add_topic(topic)?);
        Ok(())
    }

    fn message(&mut self, message: &Tapped<'_>) -> Result<()> {
        if self.paused {
            return Ok(());
        }
        let topic = self.topics[message.topic];
        if self.writer.write(topic, message.log_time, message.publish_time, message.cdr).is_err() {
            // The writer has stopped: this one message is lost beyond those that it counts itself.
            self.writer.count_lost(topic, 1);
        }
        Ok(())
    }

    fn lost(&mut self, topic: usize, messages: u64) {
        self.writer.count_lost(self.topics[topic], messages);
    }
}
