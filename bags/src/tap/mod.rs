//! Listens to the topics of a ROS 2 domain: subscribes, discovers, finds each message's time, and hands all to a sink.

mod source;
mod stamp;
mod timeline;

use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, Instant};

use swath_ros::{Node, graph};
pub use timeline::TapClock;

use self::source::{Source, Taken};
use self::timeline::{Timeline, Times};
use crate::error::{Result, chain};
use crate::qos::{History, QosOverride, QosProfile};
use crate::reader::TopicPattern;
use crate::ros_qos;
use crate::topic::Topic;

/// How long after a match the other side may still not send [wall time].
const SETTLING: Duration = Duration::from_millis(300);
/// How long topics are looked for that are there from the start [wall time].
const AT_START: Duration = Duration::from_secs(1);
/// Messages that are held because their time is not known yet; more are given the time of their coming.
const HELD: usize = 10_000;

/// Which topics are looked for that the table of Swath's node graph does not have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Discovery {
    /// Any, whenever they come up.
    #[default]
    Always,
    /// Those that are there at the start.
    AtStart,
    /// None.
    Never,
}

/// What is listened to, and how.
#[derive(Debug, Clone, Default)]
pub struct Selection {
    /// Which topics.
    pub topics: TopicPattern,
    /// Topics beside those of the node graph.
    pub discovery: Discovery,
    /// Whether hidden topics count, which have a name with a part that begins with `_`.
    pub hidden: bool,
    /// Whether the topics of missions in other namespaces are passed over.
    pub own_mission_only: bool,
    /// The time that messages are given.
    pub clock: TapClock,
    /// Messages that a subscription keeps until they are taken; more at once are lost.
    pub depth: usize,
    /// By topic: what differs from the QoS with which it would be read.
    pub qos_overrides: BTreeMap<String, QosOverride>,
    /// Nodes of the graph table whose topics must be matched before the tap is ready.
    pub expected_nodes: Vec<String>,
}

/// A message as it comes out of the tap.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Tapped<'a> {
    /// The topic's number, see [`Sink::topic`].
    pub topic: usize,
    /// The message's time by the tap's clock [ns].
    pub log_time: u64,
    /// Time of sending [ns].
    pub publish_time: u64,
    /// CDR with its encapsulation header.
    pub cdr: &'a [u8],
}

/// Where messages go.
pub trait Sink {
    /// A topic is listened to from now on, under a number: 0, 1, 2 and on.
    ///
    /// # Errors
    /// What keeps the sink from going on.
    fn topic(&mut self, number: usize, topic: &Topic) -> Result<()>;

    /// A message of a topic that was announced.
    ///
    /// # Errors
    /// What keeps the sink from going on.
    fn message(&mut self, message: &Tapped<'_>) -> Result<()>;

    /// So many more messages of a topic were lost on their way to the tap.
    fn lost(&mut self, topic: usize, messages: u64);
}

/// Subscriptions to topics of a domain.
pub struct Tap {
    // Endpoints are dropped before the node that they belong to.
    sources: Vec<Source>,
    node: Node,
    selection: Selection,
    timeline: Timeline,
    /// Topics that the sink knows of.
    announced: usize,
    /// Topics that were seen and are not listened to.
    passed_over: BTreeSet<String>,
    batch: Vec<Taken>,
    /// Messages whose time is not known before the first `/clock`.
    early: Vec<Taken>,
    started_at: Instant,
    matched_at: Option<Instant>,
}

impl Tap {
    /// Subscribes to the topics of the node graph that are selected.
    ///
    /// # Errors
    /// [`crate::BagError::Ros`] when DDS refuses a subscription.
    pub fn new(node: Node, selection: Selection) -> Result<Self> {
        let mut tap = Self {
            sources: Vec::new(),
            node,
            timeline: Timeline::new(selection.clock),
            selection,
            announced: 0,
            passed_over: BTreeSet::new(),
            batch: Vec::new(),
            early: Vec::new(),
            started_at: Instant::now(),
            matched_at: None,
        };
        tap.subscribe_to_table()?;
        Ok(tap)
    }

    /// The node that listens.
    #[must_use]
    pub fn node(&self) -> &Node {
        &self.node
    }

    /// Topics that are listened to, by their numbers.
    pub fn topics(&self) -> impl Iterator<Item = &Topic> {
        self.sources.iter().map(|source| &source.topic)
    }

    /// The latest time that the tap's clock has shown [ns].
    #[must_use]
    pub fn now(&self) -> Option<u64> {
        self.timeline.now()
    }

    /// Takes what has come and hands it to the sink in the order of coming; returns the number of messages.
    ///
    /// Where more has come than is taken at once, the node's signal is raised, so that nobody waits for the next sample
    /// before the rest is taken.
    ///
    /// # Errors
    /// Whatever DDS or the sink reports.
    pub fn take_all(&mut self, sink: &mut dyn Sink) -> Result<usize> {
        self.announce(sink)?;
        let mut batch = std::mem::take(&mut self.batch);
        let mut more = false;
        for (number, source) in self.sources.iter_mut().enumerate() {
            more |= source.take_all(number, &mut batch)?;
        }
        if more {
            self.node.signal().raise();
        }
        batch.sort_by_key(Taken::received_ns);
        let taken = batch.len();
        for message in batch.drain(..) {
            self.pass_on(message, sink)?;
        }
        self.batch = batch;
        Ok(taken)
    }

    /// Looks after losses, new topics, and messages that were held in vain; to be called a few times a second.
    ///
    /// # Errors
    /// Whatever DDS or the sink reports.
    pub fn do_chores(&mut self, sink: &mut dyn Sink) -> Result<()> {
        self.timeline
            .set_clock_is_there(self.sources.iter().any(|source| source.is_clock && source.is_matched_at_all()));
        if !self.timeline.awaits_clock() {
            self.pass_on_early(sink)?;
        }
        self.tell_losses(sink);
        let looks = match self.selection.discovery {
            Discovery::Always => true,
            Discovery::AtStart => self.started_at.elapsed() < AT_START,
            Discovery::Never => false,
        };
        if looks {
            self.subscribe_to_discovered()?;
        }
        self.announce(sink)
    }

    /// Hands over what was held, although its time is not known; to be called at the end.
    ///
    /// # Errors
    /// Whatever the sink reports.
    pub fn finish(&mut self, sink: &mut dyn Sink) -> Result<()> {
        self.pass_on_early(sink)?;
        self.tell_losses(sink);
        Ok(())
    }

    /// Whether everything expected is there, and the other sides have had time to know it.
    pub fn is_ready(&mut self) -> bool {
        let expected = &self.selection.expected_nodes;
        if self.matched_at.is_none() && self.sources.iter().all(|source| source.is_matched(expected)) {
            self.matched_at = Some(Instant::now());
        }
        let looked = self.selection.discovery != Discovery::AtStart || self.started_at.elapsed() >= AT_START;
        looked && self.matched_at.is_some_and(|at| expected.is_empty() || at.elapsed() >= SETTLING)
    }

    fn announce(&mut self, sink: &mut dyn Sink) -> Result<()> {
        while let Some(source) = self.sources.get(self.announced) {
            sink.topic(self.announced, &source.topic)?;
            self.announced += 1;
        }
        Ok(())
    }

    /// Hands a message to the sink, or holds it until its time is known.
    fn pass_on(&mut self, message: Taken, sink: &mut dyn Sink) -> Result<()> {
        let source = &self.sources[message.source];
        let stamp = source.stamp_of(message.sample.cdr.as_bytes());
        if source.is_clock && self.timeline.tick(stamp) {
            self.pass_on_early(sink)?;
        }
        match self.timeline.times(stamp, message.received_ns(), message.sample.info.source_time_ns) {
            Some(times) => hand_over(&message, times, sink),
            None => {
                self.early.push(message);
                if self.early.len() >= HELD {
                    self.pass_on_early(sink)?;
                }
                Ok(())
            }
        }
    }

    /// Hands over the messages that were held, at the time known now or else the time of their coming.
    fn pass_on_early(&mut self, sink: &mut dyn Sink) -> Result<()> {
        for message in std::mem::take(&mut self.early) {
            let stamp = self.sources[message.source].stamp_of(message.sample.cdr.as_bytes());
            hand_over(&message, self.timeline.times_anyway(stamp, message.received_ns()), sink)?;
        }
        Ok(())
    }

    fn tell_losses(&mut self, sink: &mut dyn Sink) {
        for (number, source) in self.sources.iter_mut().enumerate() {
            let lost = source.newly_lost();
            if lost > 0 {
                sink.lost(number, lost);
                tracing::warn!("{}: {lost} messages lost", source.topic.name);
            }
        }
    }

    fn subscribe_to_table(&mut self) -> Result<()> {
        for entry in graph::TOPICS {
            let name = self.node.names().resolve(entry.name)?;
            if self.selects(&name) {
                let offered = ros_qos::to_bag(&entry.profile.qos());
                self.subscribe(&name, entry.type_name, offered, Some(entry))?;
            }
        }
        Ok(())
    }

    fn selects(&self, name: &str) -> bool {
        let named = self.selection.topics.names().iter().any(|wanted| wanted == name);
        self.selection.topics.selects(name) && (self.selection.hidden || named || !is_hidden(name))
    }

    /// Subscribes to topics that others write and the table does not have.
    fn subscribe_to_discovered(&mut self) -> Result<()> {
        let mut offers: BTreeMap<(String, String), Vec<_>> = BTreeMap::new();
        let known: BTreeSet<&str> = self.sources.iter().map(|source| source.topic.name.as_str()).collect();
        for writer in self.node.remote_writers() {
            if !known.contains(writer.topic.as_str()) && !self.passed_over.contains(&writer.topic) {
                offers.entry((writer.topic, writer.type_name)).or_default().push(ros_qos::to_bag(&writer.qos));
            }
        }
        for ((name, type_name), offers) in offers {
            let foreign = self.selection.own_mission_only
                && (is_of_a_mission(&name, &type_name) || is_of_another_life(&name, self.node.names().namespace()));
            if foreign || !self.selects(&name) || self.sources.iter().any(|source| source.topic.name == name) {
                self.passed_over.insert(name);
                continue;
            }
            let mut offered = ros_qos::to_bag(&ros_qos::to_read(&offers, 1));
            // Whoever plays it writes with it, while what is read should not be lost for being late.
            let lifespans = offers.iter().map(|offer| offer.lifespan);
            offered.lifespan = lifespans.min_by_key(|it| (it.sec, it.nsec)).unwrap_or(offered.lifespan);
            if let Err(error) = self.subscribe(&name, &type_name, offered, None) {
                tracing::warn!("{name} is not recorded: {}", chain(&error));
                self.passed_over.insert(name);
            }
        }
        Ok(())
    }

    fn subscribe(
        &mut self,
        name: &str,
        type_name: &str,
        offered: QosProfile,
        entry: Option<&'static graph::Entry>,
    ) -> Result<()> {
        let known = swath_msgs::Interface::find(type_name);
        if known.is_none() {
            tracing::warn!("{name}: no schema is known for {type_name}, readers cannot decode its messages");
        }
        let (schema, hash) = known.map_or(("", ""), |k| (k.schema, k.type_hash));
        let topic = Topic::new(name, type_name, schema, hash, vec![offered])?;
        let mut reading = ros_qos::to_read(&[offered], self.selection.depth);
        if let Some(change) = self.selection.qos_overrides.get(name) {
            let mut changed = change.apply(ros_qos::to_bag(&reading));
            if changed.history == History::KeepAll {
                changed.depth = self.selection.depth as u64;
            }
            reading = ros_qos::to_ros(&changed);
        }
        let subscription = self.node.raw_subscription(name, type_name, &reading)?;
        let is_clock =
            name == self.node.names().resolve(graph::CLOCK.entry.name)? && type_name == graph::CLOCK.entry.type_name;
        self.sources.push(Source::new(topic, is_clock, subscription, entry)?);
        Ok(())
    }
}

/// Whether a name has a part that begins with `_`, as ROS 2 names what is not for everybody.
pub(crate) fn is_hidden(topic: &str) -> bool {
    topic.split('/').any(|part| part.starts_with('_'))
}

/// Whether a mission in some namespace has this topic for itself.
fn is_of_a_mission(topic: &str, type_name: &str) -> bool {
    graph::TOPICS.iter().any(|entry| {
        let (own, name) = match entry.name.strip_prefix('/') {
            // Of these, a mission has only its clock for itself, where it has a namespace.
            Some(name) => (entry.name == graph::CLOCK.entry.name, name),
            None => (true, entry.name),
        };
        own && entry.type_name == type_name && topic.strip_suffix(name).is_some_and(|before| before.ends_with('/'))
    })
}

/// Whether the topic tells of the life cycle of a node of a mission in another namespace.
fn is_of_another_life(topic: &str, own: &str) -> bool {
    let node = topic.strip_suffix("/transition_event").and_then(|node| node.rsplit_once('/'));
    node.is_some_and(|(namespace, node)| {
        namespace != own && (graph::MEMBERS.contains(&node) || node == graph::RECORDER)
    })
}

fn hand_over(message: &Taken, times: Times, sink: &mut dyn Sink) -> Result<()> {
    sink.message(&Tapped {
        topic: message.source,
        log_time: times.log,
        publish_time: times.publish,
        cdr: message.sample.cdr.as_bytes(),
    })
}
