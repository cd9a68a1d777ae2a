//! The on-board catalogue's messages.

use swath_mission::requests::journal::InFlight;
use swath_msgs::swath_msgs as msg;
use swath_node::error::MessageError;
use swath_node::messages::decision_point::situation;
use swath_node::messages::task_result::task_record;
use swath_node::stamp::{BODY_FRAME, Stamper};
use swath_sim::time::Tick;
use swath_sim::world::strip::StripId;

use super::logic::{Heard, Point, Reached};

/// How far guidance has flown.
#[must_use]
pub fn reached(message: &msg::GuidanceReached) -> Reached {
    let flown = InFlight {
        task: message.task,
        id: StripId(message.strip_id),
        start: Tick(message.start_tick),
        t_pre: message.t_pre_ticks,
        t_acq: message.t_acq_ticks,
    };
    Reached { tick: Tick(message.tick), flown: message.has_strip.then_some(flown) }
}

/// How far guidance has flown, and with which task that images a strip.
#[must_use]
pub fn guidance_reached(stamper: &Stamper, tick: Tick, flown: Option<InFlight>) -> msg::GuidanceReached {
    let header = stamper.header(tick, BODY_FRAME);
    match flown {
        None => msg::GuidanceReached { header, tick: tick.0, ..msg::GuidanceReached::default() },
        Some(InFlight { task, id, start, t_pre, t_acq }) => msg::GuidanceReached {
            header,
            tick: tick.0,
            task,
            has_strip: true,
            strip_id: id.0,
            start_tick: start.0,
            t_pre_ticks: t_pre,
            t_acq_ticks: t_acq,
        },
    }
}

/// A task is wanted.
///
/// # Errors
/// When a number is not finite or absurd, or a constant is unknown.
pub fn point(message: &msg::DecisionPoint) -> Result<Point, MessageError> {
    let results = message.last_imaging.iter().chain(&message.result).map(task_record);
    Ok(Point { task: message.task, situation: situation(message)?, results: results.collect::<Result<_, _>>()? })
}

/// What guidance must know of what was heard.
#[must_use]
pub fn catalogue_heard(stamper: &Stamper, heard: &Heard) -> msg::CatalogueHeard {
    let (abort_task, reason) = heard.abort.clone().unwrap_or_default();
    msg::CatalogueHeard {
        header: stamper.header(heard.through, BODY_FRAME),
        through: heard.through.0,
        abort: heard.abort.is_some(),
        abort_task,
        reason,
        hold: heard.hold.is_some(),
        hold_task: heard.hold.unwrap_or_default(),
    }
}
