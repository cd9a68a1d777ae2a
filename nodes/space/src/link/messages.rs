//! The radio's messages.

use swath_mission::link::end::Sent;
use swath_msgs::swath_msgs as msg;
use swath_node::error::MessageError;
use swath_node::stamp::{EARTH_FRAME, Stamper};
use swath_sim::time::Tick;

use super::logic::Turn;

/// What an end hears at a tick of the radio.
#[must_use]
pub fn radio_turn(stamper: &Stamper, turn: &Turn) -> msg::RadioTurn {
    let frame = |bytes: &Vec<u8>| msg::RadioFrame { data: bytes.clone(), air_ticks: 0 };
    msg::RadioTurn {
        header: stamper.header(turn.tick, EARTH_FRAME),
        tick: turn.tick.0,
        next: turn.next.0,
        open: turn.open,
        frames: turn.frames.iter().map(frame).collect::<Vec<_>>(),
    }
}

/// What is heard at a tick of the radio of a mission that ends at `horizon`.
///
/// # Errors
/// When a tick lies outside the mission.
pub fn turn(message: &msg::RadioTurn, horizon: Tick) -> Result<Turn, MessageError> {
    let (tick, next, end) = (Tick(message.tick), Tick(message.next), horizon.0);
    if tick > horizon || next <= tick || next > horizon.after(1) {
        return Err(MessageError::Tick { tick: message.next, end });
    }
    Ok(Turn {
        tick,
        next,
        open: message.open,
        frames: message.frames.iter().map(|frame| frame.data.to_vec()).collect(),
    })
}

/// What an end sends at a tick.
#[must_use]
pub fn radio_sent(stamper: &Stamper, tick: Tick, sent: &[Sent]) -> msg::RadioSent {
    let frame = |sent: &Sent| msg::RadioFrame { data: sent.bytes.clone(), air_ticks: sent.air_ticks };
    msg::RadioSent {
        header: stamper.header(tick, EARTH_FRAME),
        tick: tick.0,
        frames: sent.iter().map(frame).collect::<Vec<_>>(),
    }
}

/// Frames that an end has sent.
#[must_use]
pub fn sent(message: &msg::RadioSent) -> Vec<Sent> {
    let frame = |frame: &msg::RadioFrame| Sent { bytes: frame.data.to_vec(), air_ticks: frame.air_ticks };
    message.frames.iter().map(frame).collect()
}
