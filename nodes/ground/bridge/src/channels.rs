//! Topics as Foxglove's channels, with schemas and bytes as they are.

use std::sync::Arc;

use foxglove::{ChannelBuilder, Context, PartialMetadata, RawChannel, Schema};
use swath_bags::qos::Durability;
use swath_bags::schema::{Schema as Definition, adapt};
use swath_bags::tap::{Sink, Tapped};
use swath_bags::{BagError, Result, Topic};
use swath_msgs::RosMessage as _;
use swath_msgs::swath_msgs::StripStatus;
use swath_ros::{Cdr, decode, graph};

use crate::latched::{Kept, send_latched};
use crate::strips::Strips;

/// What a topic has become.
struct Open {
    channel: Arc<RawChannel>,
    latched: bool,
    /// What tells how strips stand, if it does.
    strips: Option<Reading>,
}

/// How states of strips are read: recordings of earlier versions by what they say of their types.
struct Reading {
    then: Definition,
    now: Definition,
}

impl Reading {
    fn new(topic: &Topic) -> Result<Self> {
        Ok(Self { then: Definition::of(topic)?, now: Definition::parse(StripStatus::TYPE_NAME, StripStatus::SCHEMA)? })
    }

    fn status(&self, cdr: &[u8]) -> Result<StripStatus> {
        let cdr = if self.then == self.now { cdr.to_vec() } else { adapt(&self.then, &self.now, cdr)? };
        Ok(decode(&Cdr::from_bytes(cdr))?)
    }
}

/// All channels: a sink of the tap.
pub struct Channels {
    context: Arc<Context>,
    kept: Arc<Kept>,
    /// By the topics' numbers.
    open: Vec<Open>,
    /// Full name of the topic that tells how strips stand.
    events: String,
    /// What a map draws.
    pub strips: Strips,
}

impl Channels {
    /// None yet, for the nodes of a namespace.
    #[must_use]
    pub fn new(context: &Arc<Context>, kept: Arc<Kept>, namespace: &str) -> Self {
        let namespace = namespace.trim_end_matches('/');
        Self {
            context: Arc::clone(context),
            open: Vec::new(),
            events: format!("{namespace}/{}", graph::STRIP_EVENTS.entry.name),
            strips: Strips::new(context, Arc::clone(&kept), namespace),
            kept,
        }
    }

    /// Opens the channel of the topic with the next number; an empty schema is none.
    ///
    /// # Errors
    /// When the name is taken or the schema is missing where one is needed.
    pub fn open(&mut self, topic: &Topic) -> Result<()> {
        let refuse = |error: foxglove::FoxgloveError| BagError::Topic {
            topic: topic.name.clone(),
            reason: format!("no channel for it: {error}"),
        };
        let encoding = topic.schema_encoding();
        let schema =
            (!encoding.is_empty()).then(|| Schema::new(topic.full_type_name(), encoding, topic.schema().to_vec()));
        let channel = ChannelBuilder::new(&topic.name)
            .message_encoding(&topic.message_encoding)
            .schema(schema)
            .context(&self.context)
            .build_raw()
            .map_err(refuse)?;
        let latched = topic.qos.iter().any(|offered| offered.durability == Durability::TransientLocal);
        let tells = topic.name == self.events && topic.full_type_name() == StripStatus::TYPE_NAME;
        let strips = tells.then(|| Reading::new(topic)).transpose()?;
        self.open.push(Open { channel, latched, strips });
        Ok(())
    }

    /// Sends a message of the topic with a number.
    pub fn send(&mut self, topic: usize, log_time: u64, cdr: &[u8]) {
        let Some(open) = self.open.get(topic) else { return };
        if open.latched {
            send_latched(&self.kept, &open.channel, log_time, cdr);
        } else {
            open.channel.log_with_meta(cdr, PartialMetadata::with_log_time(log_time));
        }
        if let Some(reading) = &open.strips {
            match reading.status(cdr) {
                Ok(status) => self.strips.take(&status),
                Err(error) => tracing::debug!("how a strip stands is not understood: {error}"),
            }
        }
    }

    /// Whether a topic is latched.
    #[must_use]
    pub fn is_latched(&self, topic: usize) -> bool {
        self.open.get(topic).is_some_and(|open| open.latched)
    }

    /// Whether a topic tells how strips stand.
    #[must_use]
    pub fn tells_of_strips(&self, topic: usize) -> bool {
        self.open.get(topic).is_some_and(|open| open.strips.is_some())
    }

    /// Forgets what was sent, before another time is shown.
    pub fn begin_anew(&mut self) {
        self.kept.forget();
        self.strips.forget();
    }
}

impl Sink for Channels {
    fn topic(&mut self, _number: usize, topic: &Topic) -> Result<()> {
        self.open(topic)
    }

    fn message(&mut self, message: &Tapped<'_>) -> Result<()> {
        self.send(message.topic, message.log_time, message.cdr);
        Ok(())
    }

    fn lost(&mut self, topic: usize, messages: u64) {
        let name = self.open.get(topic).map_or("", |open| open.channel.topic());
        tracing::warn!("{name}: {messages} messages were lost on their way here");
    }
}
