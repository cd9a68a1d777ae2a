//! Messages about strip requests: values that come in are checked by the request manager, each with its reason.

use swath_mission::orders::action::Review;
use swath_mission::orders::feature_strips::Cutting;
use swath_mission::requests::index::Area;
use swath_mission::requests::journal::{Attempt, Change, InFlight, Outcome};
use swath_mission::requests::lifecycle::State;
use swath_mission::requests::logic::{Abort, RequestLogic};
use swath_mission::requests::query::{Filter, Opportunity};
use swath_mission::requests::reason_number::Reason;
use swath_mission::requests::refusal::Refusal;
use swath_mission::requests::request::{Request, Stored};
use swath_msgs::builtin_interfaces::Time;
use swath_msgs::swath_msgs as msg;
use swath_node::orders::strip;
use swath_node::stamp::{EARTH_FRAME, Stamper};
use swath_sim::time::Tick;
use swath_sim::world::strip::StripId;
use swath_sim::world::windows::Window;

use super::store::HistoryLine;

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
    let order = (call.order_id != 0).then_some(StripId(call.order_id));
    Ok(Filter { order, states, area, between })
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

/// Where a request stands now.
#[must_use]
pub fn strip_status(stamper: &Stamper, logic: &RequestLogic, id: StripId, request: &Request) -> msg::StripStatus {
    let listed = logic.strip(id);
    let windows = listed.map_or(&[][..], |listed| listed.windows_after(logic.now()));
    let linked = listed.and_then(|listed| listed.linked);
    let served_by = number(logic.served_by(id));
    msg::StripStatus { served_by, ..status(stamper, id, request, windows.first(), linked) }
}

/// Where a request of a store stands.
#[must_use]
pub fn stored_status(stamper: &Stamper, now: Tick, id: StripId, stored: &Stored) -> msg::StripStatus {
    let window = stored.windows.iter().find(|window| window.close > now);
    status(stamper, id, &stored.request, window, stored.linked)
}

fn status(
    stamper: &Stamper,
    id: StripId,
    request: &Request,
    window: Option<&Window>,
    linked: Option<StripId>,
) -> msg::StripStatus {
    let window = window.filter(|_| !request.state.is_final());
    let standing = &request.standing;
    let part = request.order.part.as_ref();
    msg::StripStatus {
        header: stamper.header(request.changed, EARTH_FRAME),
        strip: strip(id.0, &request.order),
        client_ref: request.order.client_ref.clone(),
        submitter: request.order.submitter.clone(),
        state: request.state.number(),
        reason_code: request.reason.0.number(),
        reason: request.reason.1.clone(),
        actor: request.actor.clone(),
        tick: request.changed.0,
        created_tick: request.created.0,
        attempts: standing.attempts,
        reward: standing.reward,
        window_open: window.map_or_else(Time::default, |window| stamper.time(window.open)),
        window_close: window.map_or_else(Time::default, |window| stamper.time(window.close)),
        imaging: time_unless_zero(stamper, standing.imaging),
        linked_to: number(linked),
        supersedes: number(request.supersedes),
        superseded_by: number(standing.superseded_by),
        order_id: request.order_id.0,
        order_ref: part.map_or_else(String::new, |part| part.order_ref.clone()),
        part: part.map_or(0, |part| part.number),
        parts: part.map_or(0, |part| part.of),
        share: part.map_or(1.0, |part| part.share),
        served_by: 0,
    }
}

/// A change, with what else is known of its request now.
#[must_use]
pub fn change(stamper: &Stamper, logic: &RequestLogic, change: &Change) -> msg::StripStatus {
    let known = logic.request(change.id).map(|request| strip_status(stamper, logic, change.id, request));
    let status = known.unwrap_or_else(|| {
        change.refused.as_ref().map_or_else(msg::StripStatus::default, |order| msg::StripStatus {
            strip: strip(0, order),
            client_ref: order.client_ref.clone(),
            submitter: order.submitter.clone(),
            created_tick: change.tick.0,
            ..msg::StripStatus::default()
        })
    });
    msg::StripStatus {
        header: stamper.header(change.tick, EARTH_FRAME),
        state: change.state.number(),
        reason_code: change.reason.0.number(),
        reason: change.reason.1.clone(),
        actor: change.actor.clone(),
        tick: change.tick.0,
        attempts: change.standing.attempts,
        reward: change.standing.reward,
        imaging: time_unless_zero(stamper, change.standing.imaging),
        superseded_by: number(change.standing.superseded_by),
        ..status
    }
}

fn time_unless_zero(stamper: &Stamper, tick: Tick) -> Time {
    if tick == Tick(0) { Time::default() } else { stamper.time(tick) }
}

fn number(id: Option<StripId>) -> u64 {
    id.map_or(0, |id| id.0)
}

/// What became of a request or of what was asked of it; `known` before it was asked.
#[must_use]
pub fn submit_result(logic: &RequestLogic, known: bool, result: Result<StripId, Refusal>) -> msg::SubmitResult {
    match result {
        Ok(id) => {
            let state = logic.state(id).map_or(0, State::number);
            msg::SubmitResult { accepted: true, id: id.0, known, state, ..msg::SubmitResult::default() }
        }
        Err(refusal) => msg::SubmitResult {
            reason_code: refusal.code(),
            reason: refusal.to_string(),
            state: State::Rejected.number(),
            ..msg::SubmitResult::default()
        },
    }
}

/// How many requests are in which state.
#[must_use]
pub fn request_summary(stamper: &Stamper, logic: &RequestLogic) -> msg::RequestSummary {
    let count = |state| logic.count(state) as u64;
    let now = logic.now();
    msg::RequestSummary {
        header: stamper.header(now, EARTH_FRAME),
        tick: now.0,
        received: count(State::Received),
        rejected: count(State::Rejected),
        held: count(State::Held),
        accepted: count(State::Accepted),
        scheduled: count(State::Scheduled),
        executing: count(State::Executing),
        completed: count(State::Completed),
        cancelled_by_user: count(State::CancelledByUser),
        cancelled_by_system: count(State::CancelledBySystem),
        expired: count(State::Expired),
        failed: count(State::Failed),
        superseded: count(State::Superseded),
        fulfilled_by_link: count(State::FulfilledByLink),
        reward: logic.reward(),
    }
}

/// What strips may be.
#[must_use]
pub fn limits(cutting: &Cutting) -> msg::GetLimitsResponse {
    msg::GetLimitsResponse {
        length_min_km: cutting.shortest_km,
        length_max_km: cutting.longest_km,
        swath_km: cutting.swath_km,
        earth_radius: cutting.radius_m,
        inclination_deg: cutting.passes.inclination.to_degrees(),
        mean_motion: cutting.passes.mean_motion,
        earth_rotation: cutting.passes.earth_rotation,
    }
}

/// A chance to image a strip.
#[must_use]
pub fn opportunity(stamper: &Stamper, opportunity: &Opportunity) -> msg::Opportunity {
    msg::Opportunity {
        window_open_tick: opportunity.window.open.0,
        window_close_tick: opportunity.window.close.0,
        window_open: stamper.time(opportunity.window.open),
        window_close: stamper.time(opportunity.window.close),
        t_acq_ticks: opportunity.t_acq,
        t_acq_s: stamper.seconds(opportunity.t_acq),
        min_elevation: opportunity.min_elevation,
        transition_found: opportunity.transition.is_some(),
        transition_ticks: opportunity.transition.unwrap_or(0),
        transition_s: stamper.seconds(opportunity.transition.unwrap_or(0)),
        conflicts: u32::try_from(opportunity.conflicts).unwrap_or(u32::MAX),
        conflict_ids: opportunity.conflict_ids.iter().map(|id| id.0).collect::<Vec<_>>(),
    }
}

/// An attempt that has ended.
#[must_use]
pub fn attempt(stamper: &Stamper, attempt: &Attempt) -> msg::Attempt {
    let (state, reason_code) = match attempt.outcome {
        Outcome::Succeeded => (msg::Attempt::STATE_SUCCEEDED, 0),
        Outcome::Cancelled => (msg::Attempt::STATE_CANCELLED, 0),
        Outcome::Failed(failure) => (msg::Attempt::STATE_FAILED, Reason::from(failure).number()),
    };
    msg::Attempt {
        strip_id: attempt.id.0,
        task: attempt.task,
        start_tick: attempt.start.0,
        end_tick: attempt.end.0,
        start: stamper.time(attempt.start),
        end: stamper.time(attempt.end),
        t_pre_ticks: attempt.t_pre,
        t_acq_ticks: attempt.t_acq,
        state,
        reason_code,
        max_attitude_error: attempt.max_attitude_error,
        min_elevation: attempt.min_elevation,
        reward: attempt.reward,
    }
}

/// The attempt that is under way for a strip.
#[must_use]
pub fn attempt_under_way(stamper: &Stamper, logic: &RequestLogic, id: StripId) -> Option<msg::Attempt> {
    let flown = logic.progress().in_flight.filter(|flown| flown.id == id)?;
    let state = match (logic.state(id)?, logic.now() < flown.start) {
        (State::Executing, _) => msg::Attempt::STATE_ACQUIRING,
        (_, true) => msg::Attempt::STATE_PLANNED,
        (_, false) => msg::Attempt::STATE_TRANSITIONING,
    };
    Some(msg::Attempt {
        strip_id: id.0,
        task: flown.task,
        start_tick: flown.start.0,
        start: stamper.time(flown.start),
        t_pre_ticks: flown.t_pre,
        t_acq_ticks: flown.t_acq,
        state,
        ..msg::Attempt::default()
    })
}

/// A line of the audit trail.
#[must_use]
pub fn history_entry(stamper: &Stamper, line: &HistoryLine) -> msg::HistoryEntry {
    msg::HistoryEntry {
        sequence: line.sequence,
        strip_id: line.id.0,
        client_ref: line.client_ref.clone(),
        name: line.name.clone(),
        stamp: stamper.time(line.tick),
        tick: line.tick.0,
        state: line.state.number(),
        reason_code: line.reason.0,
        reason: line.reason.1.clone(),
        actor: line.actor.clone(),
    }
}

/// A task that is no longer wanted.
#[must_use]
pub fn task_abort(stamper: &Stamper, now: Tick, abort: Abort, reason: String) -> msg::TaskAbort {
    msg::TaskAbort { header: stamper.header(now, EARTH_FRAME), task: abort.task, strip_id: abort.id.0, reason }
}
