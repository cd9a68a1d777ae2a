//! Calls to the request manager.

use swath_msgs::builtin_interfaces::Time;
use swath_msgs::swath_msgs as msg;
use swath_sim::strip::{StripId, StripRequest};
use swath_sim::time::Tick;

use crate::requests::index::Area;
use crate::requests::journal::InFlight;
use crate::requests::lifecycle::State;
use crate::requests::logic::Review;
use crate::requests::query::Filter;
use crate::requests::refusal::Refusal;
use crate::requests_file::NamedRequest;
use crate::to_msg::{Stamper, nanoseconds};

/// A request as the request manager takes it; its values are checked there, each with its reason.
#[must_use]
pub fn named_request(message: &msg::StripRequest) -> NamedRequest {
    let unset = |time: &Time| *time == Time::default();
    // A time before 1970 is not the same as none.
    let end = |time: &Time| if unset(time) { 0 } else { nanoseconds(time).max(1) };
    NamedRequest {
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
    }
}

/// A task that images a strip; `None` for a wait.
#[must_use]
pub fn in_flight(task: &msg::ImagingTask) -> Option<InFlight> {
    (task.kind == msg::ImagingTask::KIND_IMAGE).then_some(InFlight {
        task: task.task,
        id: StripId(task.strip.id),
        start: Tick(task.start_tick),
        t_pre: task.t_pre_ticks,
        t_acq: task.t_acq_ticks,
    })
}

/// What is decided on a request.
///
/// # Errors
/// When the action is none of the constants.
pub fn review(action: u8) -> Result<Review, Refusal> {
    use msg::ReviewStripsRequest as Call;
    match action {
        Call::ACTION_RELEASE => Ok(Review::Release),
        Call::ACTION_REJECT => Ok(Review::Reject),
        Call::ACTION_HOLD => Ok(Review::Hold),
        other => Err(Refusal::Call { field: "action", value: f64::from(other), limits: "0 to 2" }),
    }
}

/// Which requests are listed.
///
/// # Errors
/// When a state is unknown or the area makes no sense.
pub fn filter(stamper: &Stamper, call: &msg::ListStripsRequest) -> Result<Filter, Refusal> {
    let state = |&number: &u8| {
        State::from_number(number).ok_or(Refusal::Call { field: "state", value: f64::from(number), limits: "0 to 12" })
    };
    let states = call.states.iter().map(state).collect::<Result<_, _>>()?;
    let area = if call.in_area { Some(area(call)?) } else { None };
    let none = Time::default();
    let between = if call.opportunity_from == none && call.opportunity_until == none {
        None
    } else {
        let until =
            if call.opportunity_until == none { Tick(u64::MAX) } else { stamper.tick_from(&call.opportunity_until) };
        Some((stamper.tick_from(&call.opportunity_from), until))
    };
    Ok(Filter { states, area, between })
}

fn area(call: &msg::ListStripsRequest) -> Result<Area, Refusal> {
    for (field, value, limit, limits) in [
        ("south_deg", call.south_deg, 90.0, "-90 to 90"),
        ("north_deg", call.north_deg, 90.0, "-90 to 90"),
        ("west_deg", call.west_deg, 180.0, "-180 to 180"),
        ("east_deg", call.east_deg, 180.0, "-180 to 180"),
    ] {
        if !(-limit..=limit).contains(&value) {
            return Err(Refusal::Call { field, value, limits });
        }
    }
    if call.south_deg > call.north_deg {
        return Err(Refusal::Call { field: "south_deg", value: call.south_deg, limits: "-90 to north_deg" });
    }
    let (south_deg, north_deg) = (call.south_deg, call.north_deg);
    Ok(Area { south_deg, north_deg, west_deg: call.west_deg, east_deg: call.east_deg })
}
