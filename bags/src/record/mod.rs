//! Records topics of a ROS 2 domain: CDR bytes from DDS into a bag, as they come.

mod control;
mod source;
mod stamp;

use std::{
    collections::{BTreeMap, BTreeSet},
    path::PathBuf,
    time::{Duration, Instant},
};

use swath_ros::{Node, RosArgs, Shutdown, graph};

use self::{
    control::{Control, Wishes},
    source::{Source, Taken},
};
use crate::{
    error::{BagError, Result},
    reader::TopicPattern,
    ros_qos,
    topic::Topic,
    writer::{BagOptions, BagSummary, BagWriter, Counter},
};

/// How long messages gather before they are taken, so that a wake-up serves many [wall time].
const BATCH: Duration = Duration::from_millis(4);
/// How often other things than messages are looked after [wall time].
const CHORES: Duration = Duration::from_millis(250);
/// How long after a match the other side may still not send [wall time].
const SETTLING: Duration = Duration::from_millis(300);
/// Messages that are held because their time is not known yet; more are given the time of their coming.
const HELD: usize = 10_000;
/// How long after the end is asked for messages on their way are waited for [wall time].
const LAST_MESSAGES: Duration = Duration::from_millis(200);

/// Which clock gives messages their time in the bag.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum RecordClock {
    /// The stamp with which a message begins; for one that has none, the latest `/clock`, and
    /// where nobody publishes that, the time of its coming.
    #[default]
    Simulated,
    /// As [`RecordClock::Simulated`], and somebody will publish `/clock`: messages without a stamp
    /// that come before the first one are held until then.
    SimulatedLater,
    /// When the message came in.
    Wall,
}

/// What is recorded, and how.
#[derive(Debug, Clone, Default)]
pub struct RecordOptions {
    /// Directory of the new bag.
    pub output: PathBuf,
    /// How the bag is stored.
    pub bag: BagOptions,
    /// Which topics.
    pub topics: TopicPattern,
    /// Whether topics are looked for that the graph table does not have.
    pub discover: bool,
    /// Messages' time in the bag.
    pub clock: RecordClock,
    /// Messages that a subscription keeps until they are taken; more at once are lost.
    pub depth: usize,
    /// Metadata records for the bag.
    pub metadata: Vec<(String, BTreeMap<String, String>)>,
    /// Whether recording starts paused.
    pub paused: bool,
    /// Nodes of the graph table whose topics must be matched before the recorder is ready.
    pub expected_nodes: Vec<String>,
}

/// A recorder at work.
pub struct Recorder {
    // Endpoints are dropped before the node that they belong to.
    sources: Vec<Source>,
    control: Control,
    node: Node,
    writer: BagWriter,
    options: RecordOptions,
    /// Latest simulated time known [ns].
    now: Option<u64>,
    paused: bool,
    /// Topics that were seen and are not recorded.
    passed_over: BTreeSet<String>,
    batch: Vec<Taken>,
    /// Messages without a stamp that came before the first `/clock`.
    early: Vec<Taken>,
    chores_at: Instant,
    matched_at: Option<Instant>,
}

impl Recorder {
    /// Starts the node, the bag, and a subscription to each topic that is known already.
    ///
    /// # Errors
    /// [`BagError::Exists`] when the bag is there already; [`BagError::Ros`] when the node cannot
    /// be started.
    pub fn start(options: RecordOptions, args: &RosArgs) -> Result<Self> {
        let writer = BagWriter::create(&options.output, options.bag.clone())?;
        for (name, pairs) in &options.metadata {
            writer.add_metadata(name, pairs.clone());
        }
        let node = Node::start(graph::RECORDER, args)?;
        let mut recorder = Self {
            sources: Vec::new(),
            control: Control::new(&node)?,
            node,
            writer,
            now: None,
            paused: options.paused,
            passed_over: BTreeSet::new(),
            batch: Vec::new(),
            early: Vec::new(),
            chores_at: Instant::now(),
            matched_at: None,
            options,
        };
        recorder.subscribe_to_table()?;
        Ok(recorder)
    }

    /// The node's signal, for [`Shutdown::on_signals`].
    pub fn signal(&self) -> &swath_ros::Signal {
        self.node.signal()
    }

    /// A count of the messages recorded, which other threads may watch.
    pub fn counter(&self) -> Counter {
        self.writer.counter()
    }

    /// Records until the end is asked for, or storing fails; closes the bag.
    ///
    /// `ready` is called with the number of topics once every subscription to the graph's topics
    /// exists and the expected nodes are matched.
    ///
    /// # Errors
    /// What stopped the recording; the bag is closed and readable as far as it goes.
    pub fn run(mut self, shutdown: &Shutdown, ready: impl FnOnce(usize)) -> Result<BagSummary> {
        let mut ready = Some(ready);
        while !shutdown.asked() && !self.writer.has_stopped() {
            self.node.wait(CHORES)?;
            let taken = self.take_all()?;
            if ready.is_some()
                && self.is_ready()
                && let Some(ready) = ready.take()
            {
                ready(self.sources.len());
            }
            if self.chores_at.elapsed() >= CHORES && self.do_chores()? {
                break;
            }
            if taken > 0 {
                std::thread::sleep(BATCH);
            }
        }
        self.take_last()?;
        self.close()
    }

    /// Takes what has come and stores it in the order of coming; returns the number of messages.
    fn take_all(&mut self) -> Result<usize> {
        let mut batch = std::mem::take(&mut self.batch);
        for (number, source) in self.sources.iter_mut().enumerate() {
            source.take_all(number, &mut batch)?;
        }
        batch.sort_by_key(|taken| taken.received_ns());
        let taken = batch.len();
        for message in batch.drain(..) {
            self.store(message);
        }
        self.batch = batch;
        Ok(taken)
    }

    /// Stores a message, or holds it until its time is known.
    fn store(&mut self, message: Taken) {
        let source = &self.sources[message.source];
        let stamp = source.stamp_of(message.sample.cdr.as_bytes());
        let first_clock = stamp.is_some() && self.now.is_none();
        if let Some(stamp) = stamp {
            self.now = if source.is_clock { Some(stamp) } else { self.now.max(Some(stamp)) };
        }
        if first_clock {
            self.store_early();
        }
        if self.paused {
            return;
        }
        let received = message.received_ns();
        if self.options.clock == RecordClock::Wall {
            let published = message.sample.info.source_time_ns.unwrap_or(received);
            self.write(&message, received, published);
        } else if let Some(time) = stamp.or(self.now) {
            self.write(&message, time, time);
        } else {
            self.early.push(message);
            if self.early.len() >= HELD {
                self.store_early();
            }
        }
    }

    /// Stores the messages that were held, at the time known now or else the time of their coming.
    fn store_early(&mut self) {
        for message in std::mem::take(&mut self.early) {
            let time = self.now.unwrap_or_else(|| message.received_ns());
            self.write(&message, time, time);
        }
    }

    fn write(&mut self, message: &Taken, log_time: u64, publish_time: u64) {
        let topic = self.sources[message.source].topic;
        if self.writer.write(topic, log_time, publish_time, message.sample.cdr.as_bytes()).is_err() {
            // The writer has stopped: this one message is lost beyond those that it counts itself.
            self.writer.count_lost(topic, 1);
        }
    }

    /// Whether everything expected is there, and the other sides have had time to know it.
    fn is_ready(&mut self) -> bool {
        let expected = &self.options.expected_nodes;
        if self.matched_at.is_none() && self.sources.iter().all(|source| source.is_matched(expected)) {
            self.matched_at = Some(Instant::now());
        }
        self.matched_at.is_some_and(|at| expected.is_empty() || at.elapsed() >= SETTLING)
    }

    /// Losses, services, diagnostics, new topics; returns whether the end was asked for.
    fn do_chores(&mut self) -> Result<bool> {
        self.chores_at = Instant::now();
        let has_clock = || self.sources.iter().any(|source| source.is_clock && source.is_matched_at_all());
        if self.options.clock == RecordClock::Simulated && !self.early.is_empty() && !has_clock() {
            self.store_early();
        }
        self.node.clock().set_ns(self.now.unwrap_or(0));
        self.count_losses();
        let wishes = self.control.wishes(self.paused)?;
        self.follow(&wishes);
        if self.options.discover {
            self.subscribe_to_discovered()?;
        }
        self.control.report(&self.writer, self.sources.len(), self.node.clock().stamp())?;
        Ok(wishes.stop)
    }

    fn follow(&mut self, wishes: &Wishes) {
        self.paused = wishes.paused;
        if wishes.split {
            self.writer.split();
        }
        if wishes.snapshot {
            let messages = self.writer.snapshot();
            tracing::info!("snapshot of {messages} messages stored");
        }
    }

    fn count_losses(&mut self) {
        for source in &mut self.sources {
            let lost = source.newly_lost();
            if lost > 0 {
                self.writer.count_lost(source.topic, lost);
                tracing::warn!("{}: {lost} messages lost", source.name);
            }
        }
    }

    /// Takes what was sent before the end was asked for.
    fn take_last(&mut self) -> Result<()> {
        let start = Instant::now();
        while start.elapsed() < LAST_MESSAGES {
            self.take_all()?;
            std::thread::sleep(BATCH);
        }
        self.store_early();
        self.count_losses();
        Ok(())
    }

    fn close(self) -> Result<BagSummary> {
        let Self { sources, control, node, writer, .. } = self;
        let stamp = node.clock().stamp();
        let summary = writer.close();
        control.report_end(&summary, stamp);
        drop((sources, control));
        drop(node);
        summary
    }

    fn subscribe_to_table(&mut self) -> Result<()> {
        for entry in graph::TOPICS {
            let name = self.node.names().resolve(entry.name)?;
            if self.options.topics.selects(&name) {
                let offered = ros_qos::to_bag(&entry.profile.qos());
                self.subscribe(&name, entry.type_name, offered, Some(entry))?;
            }
        }
        Ok(())
    }

    /// Subscribes to topics that others write and the table does not have.
    fn subscribe_to_discovered(&mut self) -> Result<()> {
        let mut offers: BTreeMap<(String, String), Vec<_>> = BTreeMap::new();
        for writer in self.node.remote_writers() {
            let known = self.sources.iter().any(|source| source.name == writer.topic);
            if !known && !self.passed_over.contains(&writer.topic) {
                offers.entry((writer.topic, writer.type_name)).or_default().push(ros_qos::to_bag(&writer.qos));
            }
        }
        for ((name, type_name), offers) in offers {
            let selected = self.options.topics.selects(&name);
            if !selected || self.sources.iter().any(|source| source.name == name) {
                self.passed_over.insert(name);
                continue;
            }
            let offered = ros_qos::to_bag(&ros_qos::to_read(&offers, 1));
            if let Err(error) = self.subscribe(&name, &type_name, offered, None) {
                tracing::warn!("{name} is not recorded: {}", crate::error::chain(&error));
                self.passed_over.insert(name);
            }
        }
        Ok(())
    }

    fn subscribe(
        &mut self,
        name: &str,
        type_name: &str,
        offered: crate::qos::QosProfile,
        entry: Option<&'static graph::Entry>,
    ) -> Result<()> {
        let known = swath_msgs::Interface::find(type_name);
        if known.is_none() {
            tracing::warn!("{name}: no schema is known for {type_name}, readers cannot decode its messages");
        }
        let (schema, hash) = known.map_or(("", ""), |k| (k.schema, k.type_hash));
        let topic = Topic::new(name, type_name, schema, hash, vec![offered])?;
        let reading = ros_qos::to_read(&[offered], self.options.depth);
        let subscription = self.node.raw_subscription(name, type_name, &reading)?;
        let id = self.writer.add_topic(&topic)?;
        self.sources.push(Source::new(&topic, id, subscription, entry)?);
        Ok(())
    }
}

impl From<swath_ros::RosError> for BagError {
    fn from(error: swath_ros::RosError) -> Self {
        Self::Ros(Box::new(error))
    }
}
