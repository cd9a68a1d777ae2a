//! What can be asked over HTTP, as JSON in and out; the page and programs ask the same.

use std::path::PathBuf;

use anyhow::Result as Answer;
use serde::{Deserialize, Serialize};
use swath_mission::orders::cutting::Cutting;
use swath_mission::orders::formats;
use swath_mission::orders::import::{Import, import_features};
use swath_mission::orders::order::Order;
use swath_mission::requests::lifecycle::State;
use swath_msgs::swath_msgs as msg;
use swath_node::orders::request_message;
use swath_sim::config::SimConfig;

use crate::desks::{Counter, call, call_once};
use crate::facts::milliseconds;
use crate::problem::Problem;

/// Requests of one call to the request manager.
const BATCH: usize = 1000;
/// Strips of which opportunities are looked for in one call.
const PREVIEWS: usize = 100;
/// Who acts, as the trail tells it.
const ACTOR: &str = "console";

/// Strips to submit or to preview.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Submission {
    /// Name of the file, or of whatever else they are from.
    name: String,
    /// The strips, as `swath strips submit` takes them.
    geojson: serde_json::Value,
}

/// Requests, and why.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Decided {
    ids: Vec<u64>,
    #[serde(default)]
    reason: String,
    /// `hold`, `release` or `reject`; absent where there is no choice.
    #[serde(default)]
    action: Option<ReviewAction>,
}

/// What is decided on a request.
#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
enum ReviewAction {
    Hold,
    Release,
    Reject,
}

/// What the planner may do by itself.
#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
enum ModeName {
    Autonomous,
    Approve,
    Hold,
}

/// A mode for the planner.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NewMode {
    mode: ModeName,
}

/// A decision on a proposal.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Verdict {
    proposal: u64,
    approve: bool,
}

/// What became of one request.
#[derive(Serialize)]
pub struct Outcome {
    name: String,
    accepted: bool,
    id: u64,
    reason_code: u16,
    reason: String,
}

/// A chance to image a strip.
#[derive(Serialize)]
struct Opportunity {
    open_ms: f64,
    close_ms: f64,
    min_elevation_deg: f64,
    acquire_ticks: u32,
    transition_ticks: Option<u32>,
    conflicts: u32,
    conflict_ids: Vec<u64>,
}

/// When a strip could be imaged.
#[derive(Serialize)]
pub struct Preview {
    name: String,
    reason_code: u16,
    reason: String,
    opportunities: Vec<Opportunity>,
}

/// All that is known of a request.
#[derive(Serialize)]
pub struct Report {
    opportunities: Vec<Opportunity>,
    attempts: Vec<Attempt>,
    history: Vec<Change>,
}

#[derive(Serialize)]
struct Attempt {
    task: u64,
    start: u64,
    end: u64,
    state: u8,
    reason_code: u16,
    max_error: f64,
    min_elevation_deg: f64,
    reward: f64,
}

#[derive(Serialize)]
struct Change {
    sequence: u64,
    t: f64,
    strip: u64,
    state: &'static str,
    reason_code: u16,
    reason: String,
    actor: String,
}

fn outcome(name: String, result: &msg::SubmitResult) -> Outcome {
    Outcome {
        name,
        accepted: result.accepted,
        id: result.id,
        reason_code: result.reason_code,
        reason: result.reason.clone(),
    }
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

/// Reads strips as `swath strips` reads them.
fn orders(submission: &Submission) -> Result<Import, Problem> {
    let stem: String = submission.name.chars().filter(|c| c.is_alphanumeric() || "-_ ".contains(*c)).take(60).collect();
    let stem = if stem.trim().is_empty() { "console".to_owned() } else { stem };
    let path = PathBuf::from(format!("{stem}.geojson"));
    let features = formats::read(submission.geojson.to_string().as_bytes(), &path)
        .map_err(|why| Problem::bad(format!("{} {why}", submission.name)))?;
    let mut import = import_features(features, &path, &Cutting::of(&SimConfig::default()));
    for order in &mut import.orders {
        if order.submitter == swath_mission::orders::order::MISSION {
            ACTOR.clone_into(&mut order.submitter);
        }
    }
    Ok(import)
}

fn features_refused(import: &Import) -> impl Iterator<Item = Outcome> + '_ {
    import.refused.iter().map(|fault| Outcome {
        name: format!("feature {}", fault.feature),
        accepted: false,
        id: 0,
        reason_code: 0,
        reason: fault.reason.clone(),
    })
}

/// Submits strips.
///
/// # Errors
/// When they are no GeoJSON, or the mission does not answer.
pub async fn submit(counter: &Counter, submission: Submission) -> Result<Vec<Outcome>, Problem> {
    let import = orders(&submission)?;
    let mut outcomes: Vec<_> = features_refused(&import).collect();
    let requests = import.orders;
    let answered = counter.ask(move |desks| {
        let mut answered = Vec::new();
        for batch in requests.chunks(BATCH) {
            let call_of = msg::SubmitStripsRequest { requests: batch.iter().map(request_message).collect() };
            let answer = call(&desks.submit, &call_of)?;
            if answer.reason_code != 0 {
                let refused =
                    msg::SubmitResult { reason_code: answer.reason_code, reason: answer.reason, ..Default::default() };
                answered.extend(batch.iter().map(|order| outcome(order.name.clone(), &refused)));
                continue;
            }
            let pairs = batch.iter().zip(&answer.results);
            answered.extend(pairs.map(|(order, result)| outcome(order.name.clone(), result)));
        }
        Ok(answered)
    });
    outcomes.extend(answered.await?);
    Ok(outcomes)
}

/// Says when strips could be imaged, without submitting them.
///
/// # Errors
/// When they are no GeoJSON or too many, or the mission does not answer.
pub async fn preview(counter: &Counter, submission: Submission) -> Result<Vec<Preview>, Problem> {
    let import = orders(&submission)?;
    let count = import.orders.len();
    if count > PREVIEWS {
        return Err(Problem::bad(format!("{count} strips, the limit of a preview is {PREVIEWS}; submit takes more")));
    }
    let refused = features_refused(&import).map(|it| Preview {
        name: it.name,
        reason_code: msg::StripStatus::REASON_CALL,
        reason: it.reason,
        opportunities: Vec::new(),
    });
    let mut previews: Vec<_> = refused.collect();
    let requests: Vec<Order> = import.orders;
    let answered = counter.ask(move |desks| {
        let one = |order: &Order| -> Answer<Preview> {
            let asked = msg::PreviewStripRequest { id: 0, request: request_message(order), horizon_s: 0.0 };
            let answer = call(&desks.preview, &asked)?;
            Ok(Preview {
                name: order.name.clone(),
                reason_code: answer.reason_code,
                reason: answer.reason,
                opportunities: answer.opportunities.iter().map(opportunity).collect(),
            })
        };
        requests.iter().map(one).collect::<Answer<Vec<_>>>()
    });
    previews.extend(answered.await?);
    Ok(previews)
}

fn outcomes(
    ids: &[u64],
    results: &[msg::SubmitResult],
    reason_code: u16,
    reason: String,
) -> Result<Vec<Outcome>, Problem> {
    if reason_code != 0 {
        return Err(Problem::bad(format!("{reason} (reason {reason_code})")));
    }
    let one = |(id, result): (&u64, &msg::SubmitResult)| Outcome { id: *id, ..outcome(String::new(), result) };
    Ok(ids.iter().zip(results).map(one).collect())
}

/// Takes requests back.
///
/// # Errors
/// When the call is refused as a whole, or the mission does not answer.
pub async fn cancel(counter: &Counter, decided: Decided) -> Result<Vec<Outcome>, Problem> {
    let ids = decided.ids.clone();
    let request = msg::CancelStripsRequest { ids: decided.ids, actor: ACTOR.to_owned(), reason: decided.reason };
    let answer =
        counter.ask(move |desks| call_once(&desks.cancel, &msg::CancelStripsRequest::default(), request)).await?;
    outcomes(&ids, &answer.results, answer.reason_code, answer.reason)
}

/// Holds, releases or rejects requests.
///
/// # Errors
/// When no action is given, the call is refused as a whole, or the mission does not answer.
pub async fn review(counter: &Counter, decided: Decided) -> Result<Vec<Outcome>, Problem> {
    let action = match decided.action {
        Some(ReviewAction::Hold) => msg::ReviewStripsRequest::ACTION_HOLD,
        Some(ReviewAction::Release) => msg::ReviewStripsRequest::ACTION_RELEASE,
        Some(ReviewAction::Reject) => msg::ReviewStripsRequest::ACTION_REJECT,
        None => return Err(Problem::bad("action is missing: hold, release or reject")),
    };
    let ids = decided.ids.clone();
    let (actor, reason) = (ACTOR.to_owned(), decided.reason);
    let request = msg::ReviewStripsRequest { ids: decided.ids, action, actor, reason };
    let answer =
        counter.ask(move |desks| call_once(&desks.review, &msg::ReviewStripsRequest::default(), request)).await?;
    outcomes(&ids, &answer.results, answer.reason_code, answer.reason)
}

/// Says what the planner may do by itself.
///
/// # Errors
/// When the planner refuses or does not answer.
pub async fn set_mode(counter: &Counter, new: NewMode) -> Result<serde_json::Value, Problem> {
    let mode = match new.mode {
        ModeName::Autonomous => msg::PlannerStatus::MODE_AUTONOMOUS,
        ModeName::Approve => msg::PlannerStatus::MODE_APPROVE,
        ModeName::Hold => msg::PlannerStatus::MODE_HOLD,
    };
    let request = msg::SetPlannerModeRequest { mode, actor: ACTOR.to_owned() };
    let answer = counter.ask(move |desks| call(&desks.mode, &request)).await?;
    accepted(answer.accepted, answer.reason)
}

/// Approves or rejects what the planner proposes.
///
/// # Errors
/// When there is no such open proposal, or the planner does not answer.
pub async fn decide(counter: &Counter, verdict: Verdict) -> Result<serde_json::Value, Problem> {
    // No proposal has that number.
    let nothing = msg::ReviewProposalRequest { proposal: u64::MAX, ..Default::default() };
    let (proposal, approve, actor) = (verdict.proposal, verdict.approve, ACTOR.to_owned());
    let request = msg::ReviewProposalRequest { proposal, approve, actor };
    let answer = counter.ask(move |desks| call_once(&desks.decide, &nothing, request)).await?;
    accepted(answer.accepted, answer.reason)
}

fn accepted(accepted: bool, reason: String) -> Result<serde_json::Value, Problem> {
    if accepted {
        return Ok(serde_json::json!({ "accepted": true }));
    }
    Err(Problem::new(hyper::StatusCode::CONFLICT, reason))
}

/// All that is known of a request.
///
/// # Errors
/// When there is none of this number, or the mission does not answer.
pub async fn report(counter: &Counter, id: u64) -> Result<Report, Problem> {
    let request = msg::GetStripRequest { id, ..Default::default() };
    let answer = counter.ask(move |desks| call(&desks.get, &request)).await?;
    let Some(report) = answer.report.first() else {
        let detail = format!("{} (reason {})", answer.reason, answer.reason_code);
        return Err(Problem::new(hyper::StatusCode::NOT_FOUND, detail));
    };
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
        state: State::from_number(it.state).map_or("unknown", State::name),
        reason_code: it.reason_code,
        reason: it.reason.clone(),
        actor: it.actor.clone(),
    };
    Ok(Report {
        opportunities: report.opportunities.iter().map(opportunity).collect(),
        attempts: report.attempts.iter().map(attempt).collect(),
        history: report.history.iter().map(change).collect(),
    })
}
