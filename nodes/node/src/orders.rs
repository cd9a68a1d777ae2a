//! Orders and actions as messages.

use swath_mission::approval::Mode;
use swath_mission::orders::action::Review;
use swath_mission::orders::action::{Act, Action};
use swath_mission::orders::feature_strips::{Cutting, SWATH_KM};
use swath_mission::orders::order::{Order, Part};
use swath_mission::orders::rows::Passes;
use swath_msgs::builtin_interfaces::Time;
use swath_msgs::swath_msgs as msg;
use swath_sim::config::SimConfig;
use swath_sim::time::Tick;
use swath_sim::world::strip::{StripId, StripRequest};

use crate::error::MessageError;
use crate::stamp::{EARTH_FRAME, Stamper, nanoseconds};

/// A request as the request manager takes it; its values are checked there, each with its reason.
#[must_use]
pub fn order_of(message: &msg::StripRequest) -> Order {
    let unset = |time: &Time| *time == Time::default();
    // A time before 1970 is not the same as none.
    let end = |time: &Time| if unset(time) { 0 } else { nanoseconds(time).max(1) };
    Order {
        client_ref: message.client_ref.clone(),
        submitter: message.submitter.clone(),
        name: message.name.clone(),
        request: StripRequest {
            start_latitude_deg: message.start_latitude_deg,
            start_longitude_deg: message.start_longitude_deg,
            end_latitude_deg: message.end_latitude_deg,
            end_longitude_deg: message.end_longitude_deg,
            priority: message.priority,
            acquisition_speed_m_s: message.acquisition_speed,
            bidirectional: message.bidirectional,
        },
        valid_from_ns: nanoseconds(&message.valid_from),
        valid_until_ns: end(&message.valid_until),
        hold_for_approval: message.hold_for_approval,
        max_attempts: message.max_attempts,
        part: part_of(message),
    }
}

/// How lines and areas become strips in the mission that told its limits.
#[must_use]
pub fn cutting_of(limits: &msg::GetLimitsResponse) -> Cutting {
    let swath_km = if limits.swath_km > 0.0 { limits.swath_km } else { SWATH_KM };
    let usual = Cutting::of(&SimConfig::default());
    let passes = Passes {
        inclination: limits.inclination_deg.to_radians(),
        mean_motion: limits.mean_motion,
        earth_rotation: limits.earth_rotation,
    };
    Cutting {
        shortest_km: limits.length_min_km,
        longest_km: limits.length_max_km,
        swath_km,
        tolerance_km: 0.5 * swath_km,
        // A mission of before does not tell its orbit.
        passes: if limits.mean_motion > 0.0 { passes } else { usual.passes },
        radius_m: limits.earth_radius,
        ..usual
    }
}

fn part_of(message: &msg::StripRequest) -> Option<Part> {
    let msg::StripRequest { order_ref, part, parts, share, .. } = message;
    let alone = order_ref.is_empty() && *part == 0 && *parts == 0;
    (!alone).then(|| Part { order_ref: order_ref.clone(), number: *part, of: *parts, share: *share })
}

/// A request as an operator submits it.
#[must_use]
pub fn request_message(order: &Order) -> msg::StripRequest {
    let request = &order.request;
    let part = order.part.as_ref();
    let time = |ns: u64| if ns == 0 { Time::default() } else { swath_ros::stamp(ns) };
    msg::StripRequest {
        client_ref: order.client_ref.clone(),
        submitter: order.submitter.clone(),
        name: order.name.clone(),
        start_latitude_deg: request.start_latitude_deg,
        start_longitude_deg: request.start_longitude_deg,
        end_latitude_deg: request.end_latitude_deg,
        end_longitude_deg: request.end_longitude_deg,
        priority: request.priority,
        acquisition_speed: request.acquisition_speed_m_s,
        bidirectional: request.bidirectional,
        valid_from: time(order.valid_from_ns),
        valid_until: time(order.valid_until_ns),
        hold_for_approval: order.hold_for_approval,
        max_attempts: order.max_attempts,
        order_ref: part.map_or_else(String::new, |part| part.order_ref.clone()),
        part: part.map_or(0, |part| part.number),
        parts: part.map_or(0, |part| part.of),
        share: part.map_or(0.0, |part| part.share),
    }
}

/// The strip of an order, in its own degrees.
#[must_use]
pub fn strip(id: u64, order: &Order) -> msg::Strip {
    let request = &order.request;
    msg::Strip {
        id,
        name: order.name.clone(),
        start_latitude_deg: request.start_latitude_deg,
        start_longitude_deg: request.start_longitude_deg,
        end_latitude_deg: request.end_latitude_deg,
        end_longitude_deg: request.end_longitude_deg,
        priority: request.priority,
        acquisition_speed: request.acquisition_speed_m_s,
    }
}

/// What a strip asks for.
#[must_use]
pub fn request_of_strip(strip: &msg::Strip) -> StripRequest {
    StripRequest {
        start_latitude_deg: strip.start_latitude_deg,
        start_longitude_deg: strip.start_longitude_deg,
        end_latitude_deg: strip.end_latitude_deg,
        end_longitude_deg: strip.end_longitude_deg,
        priority: strip.priority,
        acquisition_speed_m_s: strip.acquisition_speed,
        bidirectional: false,
    }
}

/// What the planner may do by itself, as a MODE constant of `PlannerStatus`.
#[must_use]
pub fn mode_number(mode: Mode) -> u8 {
    match mode {
        Mode::Autonomous => msg::PlannerStatus::MODE_AUTONOMOUS,
        Mode::Approve => msg::PlannerStatus::MODE_APPROVE,
        Mode::Hold => msg::PlannerStatus::MODE_HOLD,
    }
}

/// What the planner may do by itself.
///
/// # Errors
/// When the mode is none of the constants.
pub fn planner_mode(mode: u8) -> Result<Mode, MessageError> {
    match mode {
        msg::PlannerStatus::MODE_AUTONOMOUS => Ok(Mode::Autonomous),
        msg::PlannerStatus::MODE_APPROVE => Ok(Mode::Approve),
        msg::PlannerStatus::MODE_HOLD => Ok(Mode::Hold),
        value => Err(MessageError::Constant { field: "mode", value }),
    }
}

/// Something that was asked for and taken.
#[must_use]
pub fn operator_action(stamper: &Stamper, action: &Action) -> msg::OperatorAction {
    use msg::OperatorAction as To;
    let mut message = To {
        header: stamper.header(action.at, EARTH_FRAME),
        tick: action.at.0,
        initial: action.initial,
        actor: action.actor.clone(),
        reason: action.reason.clone(),
        ..To::default()
    };
    match &action.act {
        Act::Submit(id, order) | Act::Replace(id, order) => {
            let submitted = matches!(action.act, Act::Submit(..));
            message.action = if submitted { To::ACTION_SUBMIT } else { To::ACTION_REPLACE };
            message.strip_id = id.0;
            message.request = vec![request_message(order)];
        }
        Act::Cancel(id) => (message.action, message.strip_id) = (To::ACTION_CANCEL, id.0),
        Act::Review(id, review) => {
            message.strip_id = id.0;
            message.action = match review {
                Review::Release => To::ACTION_RELEASE,
                Review::Reject => To::ACTION_REJECT,
                Review::Hold => To::ACTION_HOLD,
            };
        }
        Act::SetMode(mode) => (message.action, message.mode) = (To::ACTION_SET_MODE, mode_number(*mode)),
        Act::Decide { proposal, approve } => {
            message.action = if *approve { To::ACTION_APPROVE } else { To::ACTION_DISAPPROVE };
            message.proposal = *proposal;
        }
    }
    message
}

/// Something that was asked for and taken.
///
/// # Errors
/// When its kind or its mode is unknown, or what was asked for is missing.
pub fn action(message: &msg::OperatorAction) -> Result<Action, MessageError> {
    use msg::OperatorAction as From;
    let id = StripId(message.strip_id);
    let request = || {
        let request = message.request.first().ok_or(MessageError::Constant { field: "request", value: 0 })?;
        Ok(Box::new(order_of(request)))
    };
    let act = match message.action {
        From::ACTION_SUBMIT => Act::Submit(id, request()?),
        From::ACTION_REPLACE => Act::Replace(id, request()?),
        From::ACTION_CANCEL => Act::Cancel(id),
        From::ACTION_RELEASE => Act::Review(id, Review::Release),
        From::ACTION_REJECT => Act::Review(id, Review::Reject),
        From::ACTION_HOLD => Act::Review(id, Review::Hold),
        From::ACTION_SET_MODE => Act::SetMode(planner_mode(message.mode)?),
        From::ACTION_APPROVE => Act::Decide { proposal: message.proposal, approve: true },
        From::ACTION_DISAPPROVE => Act::Decide { proposal: message.proposal, approve: false },
        value => return Err(MessageError::Constant { field: "action", value }),
    };
    let (actor, reason) = (message.actor.clone(), message.reason.clone());
    Ok(Action { at: Tick(message.tick), initial: message.initial, actor, reason, act })
}
