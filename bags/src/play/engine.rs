//! What plays: the next message, its publisher, and when it is due.

use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, Instant};

use swath_msgs::builtin_interfaces::Time;
use swath_msgs::rosgraph_msgs::Clock;
use swath_ros::qos::SEND_TIMEOUT;
use swath_ros::{Cdr, Publisher, RawPublisher, Shutdown, stamp};

use super::lateness::Lateness;
use super::pace::Pace;
use crate::error::{Result, chain};
use crate::reader::{Bag, Filter, Messages};
use crate::schema::{Schema, is_sendable, to_little_endian};

/// Publishers, and which of them a topic of the bag has.
#[derive(Default)]
pub(super) struct Outlets {
    pub publishers: Vec<RawPublisher>,
    /// By topic of the bag: index into `publishers`.
    pub by_topic: Vec<Option<usize>>,
}

/// A message that is next.
struct Pending {
    topic: usize,
    log_time: u64,
    cdr: Cdr,
}

/// Faults that are told one by one.
const MOST_FAULTS: usize = 100;

/// Message bytes that may be under way at a time when nothing sets a pace: less than a reader's socket holds, CycloneDDS's
/// by default as well. RustDDS repairs what was dropped there with 8 KiB in 10 ms.
const UNDER_WAY_BYTES: usize = 256 << 10;

/// Publishes simulated time while it plays.
pub(super) struct ClockPublisher {
    pub publisher: Publisher<Clock>,
    /// Log time between two messages at rate 1 [ns].
    pub period_ns: u64,
    /// Log time of the last message.
    pub last: Option<u64>,
}

/// A bag being played.
pub(super) struct Engine<'a> {
    bag: &'a Bag,
    filter: Filter,
    messages: Messages<'a>,
    pending: Option<Pending>,
    outlets: Outlets,
    /// Schemas of topics that have messages in another form than is sent.
    schemas: BTreeMap<usize, Option<Schema>>,
    /// Chunks and messages that could not be read, or not be brought into the form that is sent.
    faults: BTreeSet<String>,
    /// Bytes published since all were last known to be acknowledged.
    under_way: usize,
    clock: Option<ClockPublisher>,
    pub pace: Pace,
    pub published: u64,
    pub refused: u64,
    pub lateness: Lateness,
    shutdown: Shutdown,
}

impl<'a> Engine<'a> {
    /// Reads the first message; nothing is published yet.
    pub(super) fn new(
        bag: &'a Bag,
        filter: Filter,
        outlets: Outlets,
        clock: Option<ClockPublisher>,
        pace: Pace,
        shutdown: Shutdown,
    ) -> Result<Self> {
        let messages = bag.messages(&filter)?;
        let mut engine = Self {
            bag,
            filter,
            messages,
            pending: None,
            outlets,
            schemas: BTreeMap::new(),
            faults: BTreeSet::new(),
            under_way: 0,
            clock,
            pace,
            published: 0,
            refused: 0,
            lateness: Lateness::default(),
            shutdown,
        };
        engine.load()?;
        Ok(engine)
    }

    /// Reads the next message that can be; what is damaged is passed over, and told.
    fn load(&mut self) -> Result<()> {
        loop {
            match self.messages.next() {
                Ok(None) => {
                    self.pending = None;
                    return Ok(());
                }
                Ok(Some(m)) => {
                    let (topic, log_time) = (m.topic, m.log_time);
                    match sendable(self.bag, &mut self.schemas, topic, m.data) {
                        Ok(cdr) => {
                            self.pending = Some(Pending { topic, log_time, cdr: Cdr::from_bytes(cdr) });
                            return Ok(());
                        }
                        Err(reason) => self.refuse(topic, &reason),
                    }
                }
                Err(error) => self.note(chain(&error)),
            }
        }
    }

    /// Counts a message that cannot be played.
    fn refuse(&mut self, topic: usize, reason: &str) {
        self.refused += 1;
        self.note(format!("{} is not played whole: {reason}", self.bag.topics()[topic].topic.name));
    }

    /// Tells a fault once, even if playing starts anew.
    fn note(&mut self, fault: String) {
        if self.faults.len() < MOST_FAULTS && !self.faults.contains(&fault) {
            tracing::warn!("{fault}");
            self.faults.insert(fault);
        }
    }

    /// What could not be played.
    pub(super) fn faults(&self) -> impl Iterator<Item = String> {
        self.faults.iter().cloned()
    }

    /// Publishes what latched topics held before the first message.
    pub(super) fn publish_latched(&mut self, held: Vec<(usize, Vec<u8>)>) {
        for (topic, data) in held {
            match sendable(self.bag, &mut self.schemas, topic, &data) {
                Ok(data) => self.publish(topic, Cdr::from_bytes(data)),
                Err(reason) => self.refuse(topic, &reason),
            }
        }
    }

    /// Whether nothing is left to play.
    pub(super) fn is_over(&self) -> bool {
        self.pending.is_none()
    }

    /// How long until the next message or clock is due; `None` while paused or at the end.
    pub(super) fn wait(&self, now: Instant) -> Option<Duration> {
        let next = self.pending.as_ref()?.log_time;
        let next = self.next_clock().map_or(next, |clock| clock.min(next));
        self.pace.wait(next, now)
    }

    /// Publishes clock and message if they are due.
    pub(super) fn play_due(&mut self, now: Instant) -> Result<()> {
        if let Some(time) = self.next_clock().filter(|time| self.pace.wait(*time, now) == Some(Duration::ZERO)) {
            // At rate 0 the clock is that of the message that comes.
            let next = self.pending.as_ref().map_or(time, |pending| pending.log_time);
            let time = if self.pace.rate() == 0.0 { next } else { self.pace.log_time(now).min(next) };
            self.publish_clock(time)?;
        }
        let Some(pending) = &self.pending else { return Ok(()) };
        if self.pace.wait(pending.log_time, now) != Some(Duration::ZERO) {
            return Ok(());
        }
        if self.pace.rate() > 0.0 {
            let late = self.pace.log_time(now).saturating_sub(pending.log_time) as f64 / self.pace.rate();
            self.lateness.note(Duration::from_nanos(late as u64));
        }
        self.play_next().map(|_| ())
    }

    /// Publishes the next message, due or not; `false` at the end.
    pub(super) fn play_next(&mut self) -> Result<bool> {
        let Some(pending) = self.pending.take() else { return Ok(false) };
        self.publish(pending.topic, pending.cdr);
        self.load()?;
        Ok(true)
    }

    fn publish(&mut self, topic: usize, cdr: Cdr) {
        if self.pace.rate() == 0.0 {
            self.make_room(cdr.as_bytes().len());
        }
        let Some(publisher) = self.outlets.by_topic[topic].map(|place| &self.outlets.publishers[place]) else { return };
        match publisher.publish(cdr) {
            Ok(()) => self.published += 1,
            Err(error) => {
                // One warning is enough; the count is in the summary.
                if self.refused == 0 {
                    tracing::warn!("{}", chain(&error));
                }
                self.refused += 1;
            }
        }
    }

    /// Waits until readers have what they were sent: without pace, messages are read from the bag faster than any reader
    /// takes them.
    fn make_room(&mut self, bytes: usize) {
        self.under_way += bytes;
        if self.under_way > UNDER_WAY_BYTES {
            self.flush(SEND_TIMEOUT);
            self.under_way = bytes;
        }
    }

    /// Publishes one message while paused; time moves to it.
    pub(super) fn step(&mut self) -> Result<bool> {
        let Some(time) = self.pending.as_ref().map(|pending| pending.log_time) else { return Ok(false) };
        if self.shutdown.asked() {
            return Ok(false);
        }
        self.pace.move_to(time, Instant::now());
        if self.clock.is_some() {
            self.publish_clock(time)?;
        }
        self.play_next()
    }

    /// Goes on with the messages from a log time on [ns]; `false` if the bag does not reach there.
    pub(super) fn seek(&mut self, log_time: u64) -> Result<bool> {
        let inside = |(start, end): (u64, u64)| (start..=end).contains(&log_time);
        if !self.bag.time_range().is_some_and(inside) || log_time > self.filter.until {
            return Ok(false);
        }
        self.messages = self.bag.messages(&Filter { from: log_time, ..self.filter.clone() })?;
        self.pace.move_to(log_time, Instant::now());
        if let Some(clock) = &mut self.clock {
            clock.last = None;
        }
        self.load()?;
        Ok(true)
    }

    /// Starts anew from a log time [ns].
    pub(super) fn rewind(&mut self, log_time: u64) -> Result<()> {
        self.messages = self.bag.messages(&self.filter)?;
        self.pace.move_to(log_time, Instant::now());
        if let Some(clock) = &mut self.clock {
            clock.last = None;
        }
        self.load()
    }

    /// Waits until reliable readers have everything; whether they have.
    pub(super) fn flush(&self, timeout: Duration) -> bool {
        let deadline = Instant::now() + timeout;
        let mut all = true;
        for publisher in &self.outlets.publishers {
            all &= publisher.flush(deadline.saturating_duration_since(Instant::now()));
        }
        all
    }

    /// The log time at which the next clock message is due [ns].
    fn next_clock(&self) -> Option<u64> {
        let clock = self.clock.as_ref()?;
        // The frequency is one of wall time: a higher rate makes longer steps of log time.
        let rate = if self.pace.rate() == 0.0 { 1.0 } else { self.pace.rate() };
        Some(clock.last.map_or(0, |last| last.saturating_add((clock.period_ns as f64 * rate) as u64)))
    }

    fn publish_clock(&mut self, log_time: u64) -> Result<()> {
        if let Some(clock) = &mut self.clock {
            clock.last = Some(log_time);
            let time: Time = stamp(log_time);
            clock.publisher.publish(&Clock { clock: time })?;
        }
        Ok(())
    }
}

/// A message in the form that is sent.
fn sendable(
    bag: &Bag,
    schemas: &mut BTreeMap<usize, Option<Schema>>,
    topic: usize,
    data: &[u8],
) -> Result<Vec<u8>, String> {
    if is_sendable(data) {
        return Ok(data.to_vec());
    }
    let schema = schemas.entry(topic).or_insert_with(|| bag.topics()[topic].parse_schema().ok());
    let schema =
        schema.as_ref().ok_or("a message is not little-endian CDR, and no schema tells how to turn it over")?;
    to_little_endian(schema, data).map_err(|error| chain(&error))
}
