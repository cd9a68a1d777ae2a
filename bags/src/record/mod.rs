//! Records topics of a ROS 2 domain: a tap whose sink is a bag, and the services that control it.

mod control;
mod sink;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

pub use sink::BagSink;
use swath_ros::{Node, RosArgs, Shutdown, graph};

use self::control::{Control, Wishes};
use crate::error::{BagError, Result};
use crate::file::source::ReadOptions;
use crate::ops::mend::mend;
use crate::tap::{Selection, Tap};
use crate::writer::{BagOptions, BagSummary, BagWriter, Counter};

/// How long messages gather before they are taken, so that a wake-up serves many [wall time].
const BATCH: Duration = Duration::from_millis(4);
/// How often other things than messages are looked after [wall time].
const CHORES: Duration = Duration::from_millis(250);
/// How long after the end is asked for messages on their way are waited for [wall time].
const LAST_MESSAGES: Duration = Duration::from_millis(200);

/// What is recorded, and how.
#[derive(Debug, Clone, Default)]
pub struct RecordOptions {
    /// Directory of the new bag.
    pub output: PathBuf,
    /// How the bag is stored.
    pub bag: BagOptions,
    /// What is listened to.
    pub selection: Selection,
    /// Metadata records for the bag.
    pub metadata: Vec<(String, BTreeMap<String, String>)>,
    /// Whether recording starts paused.
    pub paused: bool,
}

/// A recorder at work.
pub struct Recorder {
    // Endpoints are dropped before the node that they belong to, which the tap has.
    control: Control,
    tap: Tap,
    sink: BagSink,
    chores_at: Instant,
    /// Whether others have written files of the bag before.
    resumed: bool,
}

impl Recorder {
    /// Starts the node, the bag, and a subscription to each topic that is known already.
    ///
    /// # Errors
    /// [`BagError::Exists`] when the bag is there already; [`BagError::Ros`] when the node cannot
    /// be started.
    pub fn start(options: RecordOptions, args: &RosArgs) -> Result<Self> {
        let resumed = options.bag.resume && options.output.is_dir();
        let writer = BagWriter::create(&options.output, options.bag)?;
        for (name, pairs) in options.metadata {
            writer.add_metadata(&name, pairs);
        }
        let mut sink = BagSink::new(writer);
        sink.paused = options.paused;
        let node = Node::start(graph::RECORDER, args)?;
        let control = Control::new(&node, options.paused)?;
        let tap = Tap::new(node, options.selection)?;
        Ok(Self { control, tap, sink, chores_at: Instant::now(), resumed })
    }

    /// The node's signal, for [`Shutdown::on_signals`].
    pub fn signal(&self) -> &swath_ros::Signal {
        self.tap.node().signal()
    }

    /// A count of the messages recorded, which other threads may watch.
    pub fn counter(&self) -> Counter {
        self.sink.writer().counter()
    }

    /// Records until the end is asked for, or storing fails; closes the bag.
    ///
    /// `ready` is called with the number of topics once every subscription to the graph's topics
    /// exists and the expected nodes are matched.
    ///
    /// # Errors
    /// What stopped the recording; the bag is closed and readable as far as it goes.
    pub fn run(mut self, shutdown: &Shutdown, ready: impl FnOnce(usize)) -> Result<BagSummary> {
        let stopped = self.record(shutdown, ready);
        // Whatever has happened, what was recorded is kept.
        let summary = self.close();
        stopped.and(summary)
    }

    fn record(&mut self, shutdown: &Shutdown, ready: impl FnOnce(usize)) -> Result<()> {
        let mut ready = Some(ready);
        while !shutdown.asked() && !self.sink.writer().has_stopped() {
            self.tap.node().wait(CHORES)?;
            let taken = self.tap.take_all(&mut self.sink)?;
            if ready.is_some()
                && self.tap.is_ready()
                && let Some(ready) = ready.take()
            {
                ready(self.tap.topics().count());
            }
            if self.chores_at.elapsed() >= CHORES && self.do_chores()? {
                break;
            }
            if taken > 0 {
                std::thread::sleep(BATCH);
            }
        }
        self.take_last()
    }

    /// Losses, services, diagnostics, new topics; returns whether the end was asked for.
    fn do_chores(&mut self) -> Result<bool> {
        self.chores_at = Instant::now();
        self.tap.do_chores(&mut self.sink)?;
        self.tap.node().clock().set_ns(self.tap.now().unwrap_or(0));
        let wishes = self.control.wishes()?;
        self.follow(&wishes);
        let topics = self.tap.topics().count();
        self.control.report(self.sink.writer(), topics, self.tap.node().clock().stamp())?;
        Ok(wishes.stop)
    }

    fn follow(&mut self, wishes: &Wishes) {
        self.sink.paused = wishes.paused;
        if wishes.split {
            self.sink.writer().split();
        }
        if wishes.snapshot {
            let messages = self.sink.writer().snapshot();
            tracing::info!("snapshot of {messages} messages stored");
        }
    }

    /// Takes what was sent before the end was asked for.
    fn take_last(&mut self) -> Result<()> {
        let start = Instant::now();
        while start.elapsed() < LAST_MESSAGES {
            self.tap.take_all(&mut self.sink)?;
            std::thread::sleep(BATCH);
        }
        self.tap.finish(&mut self.sink)
    }

    fn close(self) -> Result<BagSummary> {
        let Self { control, tap, sink, resumed, .. } = self;
        let stamp = tap.node().clock().stamp();
        let dir = sink.writer().dir().to_owned();
        let summary = sink.close();
        let summary = match (resumed, summary) {
            (true, Ok(summary)) => whole(&dir, summary),
            (true, Err(error)) => {
                // What went before is not lost with this file.
                whole(&dir, BagSummary::default()).map_or_else(|error| tracing::warn!("{error}"), drop);
                Err(error)
            }
            (false, summary) => summary,
        };
        control.report_end(&summary, stamp);
        drop(control);
        drop(tap);
        summary
    }
}

/// Closes what recorders before have left open, and tells of the whole bag.
fn whole(dir: &Path, summary: BagSummary) -> Result<BagSummary> {
    let (information, faults) = mend(dir, ReadOptions::default())?;
    for fault in faults {
        tracing::warn!("an interrupted recording: {fault}");
    }
    Ok(BagSummary { messages: information.message_count, files: information.files.len(), ..summary })
}

impl From<swath_ros::RosError> for BagError {
    fn from(error: swath_ros::RosError) -> Self {
        Self::Ros(Box::new(error))
    }
}
