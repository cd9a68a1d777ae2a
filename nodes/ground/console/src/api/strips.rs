//! Strips: submitted, previewed, taken back, decided on, replaced, told of.

use std::sync::Arc;

use axum::Extension;
use axum::extract::State;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use swath_mission::orders::found::{Fault, Import};
use swath_mission::requests::lifecycle::State as Stage;
use swath_msgs::swath_msgs as msg;
use utoipa::ToSchema;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use super::answers::DOOR;
use crate::extract::{Json, Named};
use crate::guard::Caller;
use crate::numbers::wholes;
use crate::problem::Problem;
use crate::server::{Home, Server};
use crate::ticks::milliseconds;
use crate::wishes;

pub(super) fn routes() -> OpenApiRouter<Arc<Server>> {
    OpenApiRouter::new()
        .routes(routes!(submit))
        .routes(routes!(preview))
        .routes(routes!(cancel))
        .routes(routes!(review))
        .routes(routes!(replace))
        .routes(routes!(report))
}

/// Strips to submit, to preview or to put in the place of another one.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
struct Submission {
    /// Name of the file, or of whatever else they are from.
    #[schema(example = "wishes.geojson")]
    name: String,
    /// The strips: lines and areas, as `swath strips submit` takes them.
    #[schema(value_type = Object, example = json!({ "type": "Feature", "properties": { "name": "coast" },
        "geometry": { "type": "LineString", "coordinates": [[10.0, 40.0], [10.4, 41.0]] } }))]
    geojson: Value,
}

/// Requests, and why.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
struct Cancellation {
    /// Numbers of the requests.
    #[serde(deserialize_with = "wholes")]
    ids: Vec<u64>,
    /// Why.
    #[serde(default)]
    reason: String,
}

/// Requests, what is decided on them, and why.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
struct Review {
    /// Numbers of the requests.
    #[serde(deserialize_with = "wholes")]
    ids: Vec<u64>,
    action: ReviewAction,
    /// Why.
    #[serde(default)]
    reason: String,
}

/// What is decided on requests.
#[derive(Clone, Copy, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
enum ReviewAction {
    Hold,
    Release,
    Reject,
}

/// What became of one request.
#[derive(Serialize, ToSchema)]
struct Outcome {
    /// Name for people; empty where the request goes by number.
    name: String,
    /// Whether it was done.
    accepted: bool,
    /// Number of the request, 0 if it has none.
    id: u64,
    /// A REASON constant of `swath_msgs/msg/StripStatus`.
    reason_code: u16,
    /// The reason in words.
    reason: String,
}

/// A chance to image a strip.
#[derive(Serialize, ToSchema)]
#[schema(as = Chance)]
struct Opportunity {
    /// When imaging may start at the earliest [ms since 1970-01-01 UTC].
    open_ms: f64,
    /// When imaging may start at the latest [ms since 1970-01-01 UTC].
    close_ms: f64,
    /// Least elevation while imaging [deg].
    min_elevation_deg: f64,
    /// Acquisition [ticks].
    acquire_ticks: u32,
    /// Shortest transition from the present attitude [ticks], if one was found.
    transition_ticks: Option<u32>,
    /// Other strips that wait for the satellite at the same time.
    conflicts: u32,
    /// Numbers of those of the greatest priorities.
    conflict_ids: Vec<u64>,
}

/// When a strip could be imaged.
#[derive(Serialize, ToSchema)]
struct Preview {
    name: String,
    /// Why it would be refused: a REASON constant of `swath_msgs/msg/StripStatus`, 0 if it would not.
    reason_code: u16,
    reason: String,
    opportunities: Vec<Opportunity>,
}

/// All that is known of a request.
#[derive(Serialize, ToSchema)]
struct Report {
    opportunities: Vec<Opportunity>,
    attempts: Vec<Attempt>,
    history: Vec<Change>,
}

/// A task that was flown for a request.
#[derive(Serialize, ToSchema)]
struct Attempt {
    task: u64,
    /// Ticks at which it started and ended.
    start: u64,
    end: u64,
    /// A STATE constant of `swath_msgs/msg/Attempt`.
    state: u8,
    reason_code: u16,
    /// Greatest norm of sigma_br while imaging.
    max_error: f64,
    min_elevation_deg: f64,
    reward: f64,
}

/// A change of a request, as it was written down.
#[derive(Serialize, ToSchema)]
struct Change {
    /// Its number in the request manager's store.
    sequence: u64,
    /// Simulated time [ms since 1970-01-01 UTC].
    t: f64,
    strip: u64,
    state: String,
    reason_code: u16,
    reason: String,
    /// Who made it.
    actor: String,
}

fn outcome(name: String, result: &msg::SubmitResult) -> Outcome {
    let msg::SubmitResult { accepted, id, reason_code, ref reason, .. } = *result;
    Outcome { name, accepted, id, reason_code, reason: reason.clone() }
}

fn refused(fault: &Fault) -> (String, String) {
    let part = fault.part.map_or_else(String::new, |part| format!(", part {part}"));
    (format!("feature {}{part}", fault.feature), fault.reason.clone())
}

fn opportunity(it: &msg::Opportunity) -> Opportunity {
    Opportunity {
        open_ms: milliseconds(&it.window_open),
        close_ms: milliseconds(&it.window_close),
        min_elevation_deg: it.min_elevation.to_degrees(),
        acquire_ticks: it.t_acq_ticks,
        transition_ticks: it.transition_found.then_some(it.transition_ticks),
        conflicts: it.conflicts,
        conflict_ids: it.conflict_ids.to_vec(),
    }
}

async fn read(server: &Server, caller: &Caller, submission: &Submission) -> Result<Import, Problem> {
    wishes::read(server.counter()?, &submission.name, &submission.geojson, &caller.actor(DOOR)).await
}

/// Submits strips; what is wrong costs itself alone.
#[utoipa::path(post, path = "/api/strips", tag = "console", request_body = Submission,
    responses((status = 200, description = "as asked", body = Vec<Outcome>), Problem))]
async fn submit(
    State(server): Home,
    Extension(caller): Extension<Caller>,
    Json(submission): Json<Submission>,
) -> Result<Json<Vec<Outcome>>, Problem> {
    let import = read(&server, &caller, &submission).await?;
    let faults = import.refused.iter().map(refused);
    let mut outcomes: Vec<_> = faults
        .map(|(name, reason)| Outcome {
            name,
            accepted: false,
            id: 0,
            reason_code: msg::StripStatus::REASON_CALL,
            reason,
        })
        .collect();
    let names: Vec<_> = import.orders.iter().map(|order| order.name.clone()).collect();
    let answered = wishes::submit(server.counter()?, import.orders).await?;
    outcomes.extend(names.into_iter().zip(&answered).map(|(name, result)| outcome(name, result)));
    Ok(Json(outcomes))
}

/// Says when strips could be imaged, without submitting them.
#[utoipa::path(post, path = "/api/strips/preview", tag = "console", request_body = Submission,
    responses((status = 200, description = "as asked", body = Vec<Preview>), Problem))]
async fn preview(
    State(server): Home,
    Extension(caller): Extension<Caller>,
    Json(submission): Json<Submission>,
) -> Result<Json<Vec<Preview>>, Problem> {
    let import = read(&server, &caller, &submission).await?;
    let faults = import.refused.iter().map(refused);
    let reason_code = msg::StripStatus::REASON_CALL;
    let mut previews: Vec<_> =
        faults.map(|(name, reason)| Preview { name, reason_code, reason, opportunities: Vec::new() }).collect();
    let names: Vec<_> = import.orders.iter().map(|order| order.name.clone()).collect();
    let answered = wishes::preview(server.counter()?, import.orders).await?;
    previews.extend(names.into_iter().zip(answered).map(|(name, answer)| Preview {
        name,
        reason_code: answer.reason_code,
        reason: answer.reason,
        opportunities: answer.opportunities.iter().map(opportunity).collect(),
    }));
    Ok(Json(previews))
}

fn by_number(ids: &[u64], results: &[msg::SubmitResult]) -> Json<Vec<Outcome>> {
    let one = |(id, result): (&u64, &msg::SubmitResult)| Outcome { id: *id, ..outcome(String::new(), result) };
    Json(ids.iter().zip(results).map(one).collect())
}

/// Takes requests back.
#[utoipa::path(post, path = "/api/strips/cancel", tag = "console", request_body = Cancellation,
    responses((status = 200, description = "as asked", body = Vec<Outcome>), Problem))]
async fn cancel(
    State(server): Home,
    Extension(caller): Extension<Caller>,
    Json(Cancellation { ids, reason }): Json<Cancellation>,
) -> Result<Json<Vec<Outcome>>, Problem> {
    let results = wishes::cancel(server.counter()?, ids.clone(), caller.actor(DOOR), reason).await?;
    Ok(by_number(&ids, &results))
}

/// Holds, releases or rejects requests.
#[utoipa::path(post, path = "/api/strips/review", tag = "console", request_body = Review,
    responses((status = 200, description = "as asked", body = Vec<Outcome>), Problem))]
async fn review(
    State(server): Home,
    Extension(caller): Extension<Caller>,
    Json(Review { ids, action, reason }): Json<Review>,
) -> Result<Json<Vec<Outcome>>, Problem> {
    let action = match action {
        ReviewAction::Hold => msg::ReviewStripsRequest::ACTION_HOLD,
        ReviewAction::Release => msg::ReviewStripsRequest::ACTION_RELEASE,
        ReviewAction::Reject => msg::ReviewStripsRequest::ACTION_REJECT,
    };
    let request = msg::ReviewStripsRequest { ids: ids.clone(), action, actor: caller.actor(DOOR), reason };
    let results = wishes::review(server.counter()?, request).await?;
    Ok(by_number(&ids, &results))
}

/// Replaces a request by another one; the history of both stays together.
#[utoipa::path(post, path = "/api/strips/{id}/replace", tag = "console", params(("id" = u64, Path)),
    request_body = Submission, responses((status = 200, description = "as asked", body = Outcome), Problem))]
async fn replace(
    State(server): Home,
    Extension(caller): Extension<Caller>,
    Named(id): Named<u64>,
    Json(submission): Json<Submission>,
) -> Result<Json<Outcome>, Problem> {
    let import = read(&server, &caller, &submission).await?;
    let [order] = &import.orders[..] else {
        return Err(Problem::unfit(format!("{} strips: one is needed to replace one", import.orders.len())));
    };
    let result = wishes::replace(server.counter()?, id, order).await?;
    Ok(Json(outcome(order.name.clone(), &result)))
}

/// All that is known of a request.
#[utoipa::path(get, path = "/api/strips/{id}", tag = "console", params(("id" = u64, Path)),
    responses((status = 200, description = "as asked", body = Report), Problem))]
async fn report(State(server): Home, Named(id): Named<u64>) -> Result<Json<Report>, Problem> {
    let report = wishes::get(server.counter()?, id).await?;
    let attempt = |it: &msg::Attempt| Attempt {
        task: it.task,
        start: it.start_tick,
        end: it.end_tick,
        state: it.state,
        reason_code: it.reason_code,
        max_error: it.max_attitude_error,
        min_elevation_deg: it.min_elevation.to_degrees(),
        reward: it.reward,
    };
    let change = |it: &msg::HistoryEntry| Change {
        sequence: it.sequence,
        t: milliseconds(&it.stamp),
        strip: it.strip_id,
        state: Stage::from_number(it.state).map_or("unknown", Stage::name).to_owned(),
        reason_code: it.reason_code,
        reason: it.reason.clone(),
        actor: it.actor.clone(),
    };
    Ok(Json(Report {
        opportunities: report.opportunities.iter().map(opportunity).collect(),
        attempts: report.attempts.iter().map(attempt).collect(),
        history: report.history.iter().map(change).collect(),
    }))
}
