//! How a player is controlled: the services of `ros2 bag play`, and keys.

use std::time::{Duration, Instant};

use swath_msgs::rosbag2_interfaces::{
    Burst, BurstResponse, GetRate, GetRateResponse, IsPaused, IsPausedResponse, Pause, PlayNext, PlayNextResponse,
    Resume, Seek, SeekResponse, SetRate, SetRateResponse, Stop, TogglePaused,
};
use swath_ros::{Node, RosError, Server, graph};

use super::engine::Engine;
use super::keys::Key;
use crate::error::Result;
use crate::out::say;

/// What a rate key multiplies by.
const RATE_STEP: f64 = 1.1;

/// The services.
pub(super) struct Control {
    pause: Server<Pause>,
    resume: Server<Resume>,
    toggle: Server<TogglePaused>,
    is_paused: Server<IsPaused>,
    get_rate: Server<GetRate>,
    set_rate: Server<SetRate>,
    play_next: Server<PlayNext>,
    burst: Server<Burst>,
    seek: Server<Seek>,
    stop: Server<Stop>,
}

impl Control {
    pub(super) fn new(node: &Node) -> Result<Self, RosError> {
        Ok(Self {
            pause: node.server(&graph::Service::new("~/pause", &[], &[]))?,
            resume: node.server(&graph::Service::new("~/resume", &[], &[]))?,
            toggle: node.server(&graph::Service::new("~/toggle_paused", &[], &[]))?,
            is_paused: node.server(&graph::Service::new("~/is_paused", &[], &[]))?,
            get_rate: node.server(&graph::Service::new("~/get_rate", &[], &[]))?,
            set_rate: node.server(&graph::Service::new("~/set_rate", &[], &[]))?,
            play_next: node.server(&graph::Service::new("~/play_next", &[], &[]))?,
            burst: node.server(&graph::Service::new("~/burst", &[], &[]))?,
            seek: node.server(&graph::Service::new("~/seek", &[], &[]))?,
            stop: node.server(&graph::Service::new("~/stop", &[], &[]))?,
        })
    }

    /// Answers the calls that have come; returns whether the end was asked for.
    pub(super) fn serve(&self, engine: &mut Engine<'_>) -> Result<bool> {
        let now = Instant::now();
        if self.pause.answer_all(|_| Default::default())? > 0 {
            engine.pace.set_paused(true, now);
        }
        if self.resume.answer_all(|_| Default::default())? > 0 {
            engine.pace.set_paused(false, now);
        }
        if self.toggle.answer_all(|_| Default::default())? % 2 == 1 {
            engine.pace.set_paused(!engine.pace.is_paused(), now);
        }
        self.set_rate.answer_all(|request| SetRateResponse { success: set_rate(engine, request.rate) })?;
        while let Some((id, _)) = self.play_next.take()? {
            let success = engine.pace.is_paused() && engine.step()?;
            self.play_next.respond(id, PlayNextResponse { success })?;
        }
        while let Some((id, request)) = self.burst.take()? {
            let actually_burst = if engine.pace.is_paused() { burst(engine, request.num_messages)? } else { 0 };
            self.burst.respond(id, BurstResponse { actually_burst })?;
        }
        while let Some((id, request)) = self.seek.take()? {
            let time = u64::try_from(request.time.sec).map(|s| s * 1_000_000_000 + u64::from(request.time.nanosec));
            let success = match time {
                Ok(time) => engine.seek(time)?,
                Err(_) => false,
            };
            self.seek.respond(id, SeekResponse { success })?;
        }
        let (paused, rate) = (engine.pace.is_paused(), engine.pace.rate());
        self.is_paused.answer_all(|_| IsPausedResponse { paused })?;
        self.get_rate.answer_all(|_| GetRateResponse { rate })?;
        Ok(self.stop.answer_all(|_| Default::default())? > 0)
    }
}

/// Does what a key asks for.
pub(super) fn follow_key(key: Key, engine: &mut Engine<'_>) -> Result<()> {
    let (now, rate) = (Instant::now(), engine.pace.rate());
    match key {
        Key::Space => engine.pace.set_paused(!engine.pace.is_paused(), now),
        Key::Right if engine.pace.is_paused() => {
            engine.step()?;
        }
        Key::Right => {}
        Key::Up => {
            set_rate(engine, rate * RATE_STEP);
        }
        Key::Down => {
            set_rate(engine, rate / RATE_STEP);
        }
    }
    let state = if engine.pace.is_paused() { "paused" } else { "playing" };
    let at = Duration::from_nanos(engine.pace.log_time(now)).as_secs_f64();
    say(&format!("{state} at {at:.3} s, rate {:.3}", engine.pace.rate()));
    Ok(())
}

fn set_rate(engine: &mut Engine<'_>, rate: f64) -> bool {
    let valid = rate > 0.0 && rate.is_finite();
    if valid {
        engine.pace.set_rate(rate, Instant::now());
    }
    valid
}

/// Plays messages at once; 0 stands for all. Returns how many there were.
fn burst(engine: &mut Engine<'_>, wanted: u64) -> Result<u64> {
    let mut played = 0;
    while (wanted == 0 || played < wanted) && engine.step()? {
        played += 1;
    }
    Ok(played)
}
