//! Messages about strip requests.

use swath_msgs::builtin_interfaces::Time;
use swath_msgs::swath_msgs as msg;
use swath_sim::strip::StripId;
use swath_sim::time::Tick;

use super::{EARTH_FRAME, Stamper, strip};
use crate::requests::journal::{Attempt, Change, Outcome, failure_reason};
use crate::requests::lifecycle::State;
use crate::requests::logic::{Abort, Request, RequestLogic};
use crate::requests::query::Opportunity;
use crate::requests::refusal::Refusal;
use crate::requests::store::HistoryLine;
use crate::requests_file::NamedRequest;

/// A request as an operator submits it.
#[must_use]
pub fn strip_request(named: &NamedRequest) -> msg::StripRequest {
    let request = &named.request;
    let time = |ns: u64| if ns == 0 { Time::default() } else { swath_ros::stamp(ns) };
    msg::StripRequest {
        client_ref: named.client_ref.clone(),
        submitter: named.submitter.clone(),
        name: named.name.clone(),
        start_latitude_deg: request.start_latitude_deg,
        start_longitude_deg: request.start_longitude_deg,
        end_latitude_deg: request.end_latitude_deg,
        end_longitude_deg: request.end_longitude_deg,
        priority: request.priority,
        acquisition_speed: request.acquisition_speed_m_s,
        bidirectional: request.bidirectional,
        valid_from: time(named.valid_from_ns),
        valid_until: time(named.valid_until_ns),
        hold_for_approval: named.hold_for_approval,
        max_attempts: named.max_attempts,
    }
}

/// Where a request stands now.
#[must_use]
pub fn strip_status(stamper: &Stamper, logic: &RequestLogic, id: StripId, request: &Request) -> msg::StripStatus {
    let listed = logic.strip(id);
    let window = listed
        .filter(|_| !request.state.is_final())
        .and_then(|listed| listed.windows_after(logic.now()).first().copied());
    let standing = &request.standing;
    msg::StripStatus {
        header: stamper.header(request.changed, EARTH_FRAME),
        strip: strip(id.0, &request.named),
        client_ref: request.named.client_ref.clone(),
        submitter: request.named.submitter.clone(),
        state: request.state.number(),
        reason_code: request.reason.0,
        reason: request.reason.1.clone(),
        actor: request.actor.clone(),
        tick: request.changed.0,
        created_tick: request.created.0,
        attempts: standing.attempts,
        reward: standing.reward,
        window_open: window.map_or_else(Time::default, |window| stamper.time(window.open)),
        window_close: window.map_or_else(Time::default, |window| stamper.time(window.close)),
        imaging: time_unless_zero(stamper, standing.imaging),
        linked_to: number(listed.and_then(|listed| listed.linked)),
        supersedes: number(request.supersedes),
        superseded_by: number(standing.superseded_by),
    }
}

/// A change, with what else is known of its request now.
#[must_use]
pub fn change(stamper: &Stamper, logic: &RequestLogic, change: &Change) -> msg::StripStatus {
    let known = logic.request(change.id).map(|request| strip_status(stamper, logic, change.id, request));
    let status = known.unwrap_or_else(|| {
        change.refused.as_ref().map_or_else(msg::StripStatus::default, |named| msg::StripStatus {
            strip: strip(0, named),
            client_ref: named.client_ref.clone(),
            submitter: named.submitter.clone(),
            created_tick: change.tick.0,
            ..msg::StripStatus::default()
        })
    });
    msg::StripStatus {
        header: stamper.header(change.tick, EARTH_FRAME),
        state: change.state.number(),
        reason_code: change.reason.0,
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

/// What became of a request or of what was asked of it.
#[must_use]
pub fn submit_result(result: Result<StripId, Refusal>) -> msg::SubmitResult {
    match result {
        Ok(id) => msg::SubmitResult { accepted: true, id: id.0, ..msg::SubmitResult::default() },
        Err(refusal) => {
            msg::SubmitResult { accepted: false, id: 0, reason_code: refusal.code(), reason: refusal.to_string() }
        }
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

/// A chance to image a strip.
#[must_use]
pub fn opportunity(stamper: &Stamper, opportunity: &Opportunity) -> msg::Opportunity {
    msg::Opportunity {
        window_open_tick: opportunity.window.open.0,
        window_close_tick: opportunity.window.close.0,
        window_open: stamper.time(opportunity.window.open),
        window_close: stamper.time(opportunity.window.close),
        t_acq_ticks: opportunity.t_acq,
        min_elevation: opportunity.min_elevation,
        transition_found: opportunity.transition.is_some(),
        transition_ticks: opportunity.transition.unwrap_or(0),
        conflicts: u32::try_from(opportunity.conflicts).unwrap_or(u32::MAX),
        conflict_ids: opportunity.conflict_ids.iter().map(|id| id.0).collect::<Vec<_>>(),
    }
}

/// An attempt that has ended.
#[must_use]
pub fn attempt(attempt: &Attempt) -> msg::Attempt {
    let (state, reason_code) = match attempt.outcome {
        Outcome::Succeeded => (msg::Attempt::STATE_SUCCEEDED, 0),
        Outcome::Cancelled => (msg::Attempt::STATE_CANCELLED, 0),
        Outcome::Failed(failure) => (msg::Attempt::STATE_FAILED, failure_reason(failure).0),
    };
    msg::Attempt {
        strip_id: attempt.id.0,
        task: attempt.task,
        start_tick: attempt.start.0,
        end_tick: attempt.end.0,
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
pub fn attempt_under_way(logic: &RequestLogic, id: StripId) -> Option<msg::Attempt> {
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
