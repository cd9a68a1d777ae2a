//! A bag: played, paused and moved through as clients wish.

use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use anyhow::Result;
use foxglove::WebSocketServerHandle;
use foxglove::websocket::{PlaybackCommand, PlaybackControlRequest, PlaybackState, PlaybackStatus};
use swath_bags::{Bag, Filter, Messages, TopicPattern};
use swath_ros::{Shutdown, Signal};

use crate::channels::Channels;
use crate::listener::Wish;

/// Longest wait for a wish [wall time].
const IDLE: Duration = Duration::from_millis(50);
/// Messages that are played before wishes are looked at again.
const TURN: usize = 1000;
/// How often strips are told of [ns of log time].
const STRIPS: u64 = 1_000_000_000;
/// Slowest and fastest playing, as a factor of real time.
const SPEEDS: (f32, f32) = (0.001, 10_000.0);

/// Where playing is.
struct Head {
    playing: bool,
    speed: f32,
    /// Log time [ns] that is due at `since`.
    position: u64,
    since: Instant,
}

impl Head {
    /// Log time that is due now [ns].
    fn due(&self) -> u64 {
        let passed = self.since.elapsed().as_secs_f64() * f64::from(self.speed) * 1e9;
        if self.playing { self.position.saturating_add(passed as u64) } else { self.position }
    }

    /// Begins to count from a log time.
    fn put(&mut self, position: u64) {
        self.position = position;
        self.since = Instant::now();
    }
}

/// Plays until a signal ends it, paused at first.
///
/// # Errors
/// When the bag cannot be read.
pub fn run(
    bag: &Bag,
    mut channels: Channels,
    server: &WebSocketServerHandle,
    wishes: &Receiver<Wish>,
    topics: TopicPattern,
) -> Result<()> {
    let shutdown = Shutdown::on_signals(&Signal::new())?;
    for topic in bag.topics() {
        channels.open(&topic.topic)?;
    }
    let (first, last) = bag.time_range().unwrap_or_default();
    let mut player = Player { bag, topics, server, channels, last, strips_at: 0, ended: false };
    let mut head = Head { playing: false, speed: 1.0, position: first, since: Instant::now() };
    let mut messages = player.seek(&head)?;
    player.tell(&head, false, None);
    while !shutdown.asked() {
        let wait = if head.playing && !player.ended { Duration::from_millis(5) } else { IDLE };
        match wishes.recv_timeout(wait) {
            Ok(Wish::Playback(request)) => {
                let moved = player.follow(&mut head, &request);
                if moved {
                    messages = player.seek(&head)?;
                }
                player.tell(&head, moved, Some(request.request_id));
            }
            Ok(_) | Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => break,
        }
        if head.playing && !player.ended {
            player.play(&mut messages, &mut head)?;
        }
    }
    Ok(())
}

struct Player<'a> {
    bag: &'a Bag,
    topics: TopicPattern,
    server: &'a WebSocketServerHandle,
    channels: Channels,
    /// Log time of the last message [ns].
    last: u64,
    strips_at: u64,
    ended: bool,
}

impl<'a> Player<'a> {
    /// Sends what is due; what waits in the bag waits at most a turn.
    fn play(&mut self, messages: &mut Ahead<'a>, head: &mut Head) -> Result<()> {
        let due = head.due();
        for _ in 0..TURN {
            let Some(time) = messages.time()? else {
                self.ended = true;
                head.playing = false;
                head.put(self.last);
                self.channels.strips.tell(self.last);
                self.tell(head, false, None);
                return Ok(());
            };
            if time > due {
                break;
            }
            messages.send(&mut self.channels);
        }
        if due.saturating_sub(self.strips_at) >= STRIPS {
            self.strips_at = due;
            self.channels.strips.tell(due);
        }
        self.server.broadcast_time(due.min(self.last));
        Ok(())
    }

    /// Follows a request; whether another time is wanted.
    fn follow(&mut self, head: &mut Head, request: &PlaybackControlRequest) -> bool {
        let now = head.due().min(self.last);
        if request.playback_speed.is_finite() && request.playback_speed > 0.0 {
            head.speed = request.playback_speed.clamp(SPEEDS.0, SPEEDS.1);
        }
        head.put(request.seek_time.map_or(now, |time| time.min(self.last)));
        head.playing = request.playback_command == PlaybackCommand::Play;
        request.seek_time.is_some()
    }

    /// The messages from a time on; first what was latched by then, and how strips stood.
    fn seek(&mut self, head: &Head) -> Result<Ahead<'a>> {
        let position = head.position;
        self.ended = false;
        self.strips_at = position;
        self.channels.begin_anew();
        let telling: Vec<String> = (0..self.bag.topics().len())
            .filter(|topic| self.channels.is_latched(*topic) || self.channels.tells_of_strips(*topic))
            .map(|topic| self.bag.topics()[topic].topic.name.clone())
            .filter(|name| self.topics.selects(name))
            .collect();
        if let Some(until) = position.checked_sub(1).filter(|_| !telling.is_empty()) {
            let topics = TopicPattern::new(&telling, None, None)?;
            let mut past = Ahead::new(self.bag.messages(&Filter { topics, from: 0, until })?);
            while past.time()?.is_some() {
                past.send(&mut self.channels);
            }
        }
        self.channels.strips.tell(position);
        self.server.broadcast_time(position);
        let filter = Filter { topics: self.topics.clone(), from: position, until: u64::MAX };
        Ok(Ahead::new(self.bag.messages(&filter)?))
    }

    fn tell(&self, head: &Head, did_seek: bool, request_id: Option<String>) {
        let status = match (self.ended, head.playing) {
            (true, _) => PlaybackStatus::Ended,
            (false, true) => PlaybackStatus::Playing,
            (false, false) => PlaybackStatus::Paused,
        };
        self.server.broadcast_playback_state(PlaybackState {
            status,
            current_time: head.due().min(self.last),
            playback_speed: head.speed,
            did_seek,
            request_id,
        });
    }
}

/// Messages of a bag, of which the next one's time is known.
struct Ahead<'a> {
    messages: Messages<'a>,
    next: Option<(usize, u64, Vec<u8>)>,
}

impl<'a> Ahead<'a> {
    fn new(messages: Messages<'a>) -> Self {
        Self { messages, next: None }
    }

    /// Log time of the next message [ns]; none at the end. What is damaged is passed over and told.
    fn time(&mut self) -> Result<Option<u64>> {
        while self.next.is_none() {
            match self.messages.next() {
                Ok(None) => return Ok(None),
                Ok(Some(message)) => self.next = Some((message.topic, message.log_time, message.data.to_vec())),
                Err(error @ swath_bags::BagError::Corrupt { .. }) => tracing::warn!("{error}"),
                Err(error) => return Err(error.into()),
            }
        }
        Ok(self.next.as_ref().map(|(_, time, _)| *time))
    }

    fn send(&mut self, channels: &mut Channels) {
        if let Some((topic, time, data)) = self.next.take() {
            channels.send(topic, time, &data);
        }
    }
}
