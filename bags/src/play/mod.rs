//! Plays bags: publishes recorded messages at the pace of their log times.

mod control;
mod engine;
mod keys;
mod lateness;
mod pace;

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::time::{Duration, Instant};

use swath_ros::{Node, RawPublisher, RosArgs, Shutdown, graph};

use self::control::{Control, follow_key};
use self::engine::{ClockPublisher, Engine, Outlets};
use self::keys::Keys;
use self::pace::Pace;
use crate::error::{BagError, Result, chain};
use crate::file::source::ReadOptions;
use crate::qos::{Durability, QosOverride, QosProfile};
use crate::reader::{Bag, BagTopic, Filter, TopicPattern};
use crate::ros_qos::to_ros;

/// The topic of simulated time.
const CLOCK: &str = "/clock";
/// Longest time without looking after services and keys [wall time].
const CHORES: Duration = Duration::from_millis(20);
/// Messages that are played at a time when nothing has to be waited for.
const TURN: usize = 256;
/// Least number of samples that a publisher of a topic that is not latched can send again.
const LEAST_DEPTH: u64 = 1024;
/// How long readers may take to acknowledge the last messages unless somebody says otherwise [wall time].
pub const LAST_MESSAGES: Duration = Duration::from_secs(5);
/// How long the publishers stay after that: RustDDS drops what a reader has not yet taken when its
/// writer goes [wall time].
const FAREWELL: Duration = Duration::from_millis(500);

/// What is played, and how.
#[derive(Debug, Clone)]
pub struct PlayOptions {
    /// Bags, which are played as one.
    pub bags: Vec<PathBuf>,
    /// How their files are read.
    pub read: ReadOptions,
    /// Which topics.
    pub topics: TopicPattern,
    /// Log time over wall time; 0 is as fast as it goes.
    pub rate: f64,
    /// Whether playing starts anew at the end.
    pub repeat: bool,
    /// Log time after the bag's start at which playing starts [ns].
    pub start_offset: u64,
    /// Where playing ends.
    pub end: End,
    /// Wait before the first message, so that readers are found [wall time].
    pub delay: Duration,
    /// Whether playing starts paused.
    pub paused: bool,
    /// Publish simulated time so often [1/s of wall time]; the bag's own is left out then.
    pub clock_hz: Option<f64>,
    /// Other names for topics.
    pub remap: BTreeMap<String, String>,
    /// By topic: what differs from the recorded QoS.
    pub qos_overrides: BTreeMap<String, QosOverride>,
    /// Whether keys control the player.
    pub keys: bool,
    /// How long readers may take to acknowledge the last messages; without end when there is none [wall time].
    pub acknowledged: Option<Duration>,
    /// Whether a mission that flies in the domain is no reason not to play.
    pub force: bool,
}

/// Where playing ends; at the bag's end where nothing else is said.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct End {
    /// Log time after the bag's start [ns].
    pub offset: Option<u64>,
    /// Log time after the start of playing [ns]; 0 plays nothing.
    pub duration: Option<u64>,
    /// Log time [ns]; with a duration, the later of both counts, as in rosbag2.
    pub time: Option<u64>,
}

impl End {
    /// The last log time that is played from one on; `None` when nothing is.
    fn until(self, start: u64, from: u64) -> Option<u64> {
        if let Some(offset) = self.offset {
            return Some(start.saturating_add(offset));
        }
        match (self.duration, self.time) {
            (None, None) => Some(u64::MAX),
            (Some(0), None) => None,
            (None | Some(0), Some(time)) => Some(time),
            (Some(duration), time) => Some(from.saturating_add(duration).max(time.unwrap_or(0))),
        }
    }
}

/// How playing went.
#[derive(Debug, Clone, PartialEq)]
pub struct PlaySummary {
    /// Messages published.
    pub published: u64,
    /// Messages that could not be published.
    pub refused: u64,
    /// Wall time from the first message to the last.
    pub wall: Duration,
    /// Lateness that 99 % of the messages do not exceed.
    pub late_p99: Duration,
    /// What of the bags could not be read or played.
    pub faults: Vec<String>,
}

/// A player with its node.
pub struct Player {
    node: Node,
    options: PlayOptions,
}

impl Player {
    /// Starts the node.
    ///
    /// # Errors
    /// [`BagError::Ros`] when the node cannot be started.
    pub fn start(options: PlayOptions, args: &RosArgs) -> Result<Self> {
        let node = Node::start(graph::PLAYER, args)?;
        Ok(Self { node, options })
    }

    /// The node's signal, for [`Shutdown::on_signals`].
    #[must_use]
    pub fn signal(&self) -> &swath_ros::Signal {
        self.node.signal()
    }

    /// Plays until the end, or until it is asked for; `ready` is called when all publishers exist.
    ///
    /// # Errors
    /// Whatever keeps a bag from being read or a publisher from being made.
    pub fn run(self, shutdown: &Shutdown, ready: impl FnOnce(usize)) -> Result<PlaySummary> {
        let bag = Bag::open_all(&self.options.bags, self.options.read)?;
        let (from, filter) = self.span(&bag)?;
        let outlets = self.outlets(&bag)?;
        self.spare_missions(&outlets)?;
        let count = outlets.publishers.len();
        let clock = self.clock()?;
        let control = Control::new(&self.node)?;
        let keys = if self.options.keys { Keys::listen() } else { None };
        let latched = latched_before(&bag, &filter)?;
        let pace = Pace::new(self.options.rate, from, Instant::now(), self.options.paused);
        let mut engine = Engine::new(&bag, filter, outlets, clock, pace, shutdown.clone())?;
        for fault in bag.faults() {
            tracing::warn!("{fault}");
        }
        ready(count);
        self.pause_before_start(shutdown)?;
        engine.publish_latched(latched);
        engine.pace.move_to(from, Instant::now());
        let start = Instant::now();
        self.play(&mut engine, &control, keys.as_ref(), from, shutdown)?;
        let wall = start.elapsed();
        self.await_acknowledgements(&engine, shutdown);
        std::thread::sleep(FAREWELL);
        let mut faults = bag.faults().to_vec();
        faults.extend(engine.faults());
        Ok(PlaySummary {
            published: engine.published,
            refused: engine.refused,
            wall,
            late_p99: engine.lateness.quantile(0.99),
            faults,
        })
    }

    /// Keeps messages off the topics of a mission that flies. Its nodes would not take them for their own, but
    /// everybody else would.
    fn spare_missions(&self, outlets: &Outlets) -> Result<()> {
        if self.options.force {
            return Ok(());
        }
        for node in self.node.nodes() {
            let Some((namespace, name)) = node.rsplit_once('/').filter(|(_, name)| graph::FLIGHT_NODES.contains(name))
            else {
                continue;
            };
            let is_its_own = |topic: &str| topic == CLOCK || topic.starts_with(&format!("{namespace}/"));
            if let Some(topic) = outlets.publishers.iter().map(RawPublisher::topic).find(|topic| is_its_own(topic)) {
                let domain = self.node.environment().domain;
                return Err(BagError::LiveMission {
                    node: format!("{namespace}/{name}"),
                    domain,
                    topic: topic.to_owned(),
                });
            }
        }
        Ok(())
    }

    /// Waits until reliable readers have everything, but not long once the end is asked for.
    fn await_acknowledgements(&self, engine: &Engine<'_>, shutdown: &Shutdown) {
        let start = Instant::now();
        let in_time = || self.options.acknowledged.is_none_or(|limit| start.elapsed() < limit);
        while in_time() && !engine.flush(CHORES) {
            if shutdown.asked() && start.elapsed() > FAREWELL {
                break;
            }
        }
    }

    fn play(
        &self,
        engine: &mut Engine<'_>,
        control: &Control,
        keys: Option<&Keys>,
        from: u64,
        shutdown: &Shutdown,
    ) -> Result<()> {
        let mut chores_at = Instant::now();
        while !shutdown.asked() {
            if chores_at.elapsed() >= CHORES {
                chores_at = Instant::now();
                if control.serve(engine)? {
                    return Ok(());
                }
                while let Some(key) = keys.and_then(Keys::next) {
                    follow_key(key, engine)?;
                }
            }
            if engine.is_over() {
                if !self.options.repeat {
                    return Ok(());
                }
                engine.rewind(from)?;
            }
            match engine.wait(Instant::now()) {
                Some(Duration::ZERO) => {
                    for _ in 0..TURN {
                        // A reader that has stopped makes each message wait.
                        if shutdown.asked() {
                            break;
                        }
                        engine.play_due(Instant::now())?;
                    }
                }
                // The signal ends the wait early when a service is called.
                Some(due) => {
                    self.node.wait(due.min(CHORES))?;
                }
                None => {
                    self.node.wait(CHORES)?;
                }
            }
        }
        Ok(())
    }

    /// Waits the delay out, or until the end is asked for.
    fn pause_before_start(&self, shutdown: &Shutdown) -> Result<()> {
        let start = Instant::now();
        while start.elapsed() < self.options.delay && !shutdown.asked() {
            let left = self.options.delay.saturating_sub(start.elapsed());
            self.node.wait(left.min(CHORES))?;
        }
        Ok(())
    }

    /// The first log time and the messages to play.
    fn span(&self, bag: &Bag) -> Result<(u64, Filter)> {
        let (start, end) = bag.time_range().unwrap_or((0, 0));
        let from = start.saturating_add(self.options.start_offset);
        if from > end {
            let reason = format!("{} ns is past the bag's end at {} ns", self.options.start_offset, end - start);
            return Err(BagError::Option { option: "--start-offset", reason });
        }
        let topics = self.options.topics.clone();
        let filter = match self.options.end.until(start, from) {
            Some(until) => Filter { topics, from, until },
            None => Filter { topics: TopicPattern::only(Vec::new()), from, until: from },
        };
        Ok((from, filter))
    }

    /// A publisher for each topic that is played, however often the bag has its name.
    fn outlets(&self, bag: &Bag) -> Result<Outlets> {
        let known: BTreeSet<&str> = bag.topics().iter().map(|t| t.topic.name.as_str()).collect();
        if let Some(unknown) = self.options.qos_overrides.keys().find(|name| !known.contains(name.as_str())) {
            let reason = format!("the bag has no topic {unknown}");
            return Err(BagError::Option { option: "--qos-profile-overrides-path", reason });
        }
        let mut outlets = Outlets::default();
        let mut places = BTreeMap::new();
        for topic in bag.topics() {
            let key = (topic.topic.name.as_str(), topic.topic.full_type_name());
            let place = match places.get(&key) {
                Some(place) => *place,
                None => self.publisher(topic)?.map(|publisher| {
                    outlets.publishers.push(publisher);
                    outlets.publishers.len() - 1
                }),
            };
            places.insert(key, place);
            outlets.by_topic.push(place);
        }
        Ok(outlets)
    }

    fn publisher(&self, topic: &BagTopic) -> Result<Option<RawPublisher>> {
        let name = &topic.topic.name;
        let own_clock = self.options.clock_hz.is_some() && name == CLOCK;
        if !self.options.topics.selects(name) || own_clock {
            return Ok(None);
        }
        if topic.topic.message_encoding != "cdr" {
            tracing::warn!("{name} is not played: its encoding {:?} is not cdr", topic.topic.message_encoding);
            return Ok(None);
        }
        let mut qos = topic.topic.qos.first().copied().unwrap_or(QosProfile::reliable(LEAST_DEPTH));
        if qos.durability != Durability::TransientLocal {
            // Readers do not see it; a recorder does not learn the depth of others.
            qos.depth = qos.depth.max(LEAST_DEPTH);
        }
        if let Some(change) = self.options.qos_overrides.get(name) {
            qos = change.apply(qos);
        }
        // A name in a bag is a full one, with or without its slash.
        let full = format!("/{}", name.trim_start_matches('/'));
        let renamed = self.options.remap.get(name).or(self.options.remap.get(&full)).unwrap_or(&full);
        match self.node.raw_publisher(renamed, &topic.topic.full_type_name(), &to_ros(&qos)) {
            Ok(publisher) => Ok(Some(publisher)),
            Err(error) => {
                tracing::warn!("{name} is not played: {}", chain(&error));
                Ok(None)
            }
        }
    }

    fn clock(&self) -> Result<Option<ClockPublisher>> {
        let Some(hz) = self.options.clock_hz else { return Ok(None) };
        let publisher = self.node.publisher(&graph::CLOCK)?;
        Ok(Some(ClockPublisher { publisher, period_ns: (1e9 / hz) as u64, last: None }))
    }
}

/// What latched topics held before the span that is played: topic and bytes, in order of time.
fn latched_before(bag: &Bag, filter: &Filter) -> Result<Vec<(usize, Vec<u8>)>> {
    let depth = |topic: &BagTopic| match topic.topic.qos.first() {
        Some(qos) if qos.durability == Durability::TransientLocal => qos.depth.max(1) as usize,
        _ => 0,
    };
    let selected = |t: &&BagTopic| depth(t) > 0 && filter.topics.selects(&t.topic.name);
    let names: Vec<String> = bag.topics().iter().filter(selected).map(|t| t.topic.name.clone()).collect();
    if names.is_empty() || filter.from == 0 {
        return Ok(Vec::new());
    }
    let topics = TopicPattern::new(&names, None, None)?;
    let mut messages = bag.messages(&Filter { topics, from: 0, until: filter.from - 1 })?;
    let mut held: Vec<(usize, Vec<u8>)> = Vec::new();
    loop {
        // What is damaged is told when it is played.
        let Ok(message) = messages.next() else { continue };
        let Some(message) = message else { break };
        let same = |(topic, _): &(usize, Vec<u8>)| *topic == message.topic;
        if held.iter().filter(|held| same(held)).count() >= depth(&bag.topics()[message.topic])
            && let Some(oldest) = held.iter().position(same)
        {
            held.remove(oldest);
        }
        held.push((message.topic, message.data.to_vec()));
    }
    Ok(held)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn where_playing_ends() {
        let until = |offset, duration, time| End { offset, duration, time }.until(100, 110);
        assert_eq!(until(None, None, None), Some(u64::MAX));
        assert_eq!(until(Some(5), None, None), Some(105));
        assert_eq!(until(None, Some(5), None), Some(115));
        assert_eq!(until(None, Some(0), None), None, "nothing is played");
        assert_eq!(until(None, Some(0), Some(7)), Some(7));
        assert_eq!((until(None, Some(5), Some(7)), until(None, Some(5), Some(200))), (Some(115), Some(200)));
    }
}
