//! The planner: what it may do by itself, and decisions on what it proposes.

use std::sync::Arc;

use axum::Extension;
use axum::extract::State;
use serde::Deserialize;
use swath_msgs::swath_msgs as msg;
use utoipa::ToSchema;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use super::answers::{DOOR, Done, accepted};
use crate::desks::{call, call_once};
use crate::extract::Json;
use crate::guard::Caller;
use crate::numbers::whole;
use crate::problem::Problem;
use crate::server::{Home, Server};

pub(super) fn routes() -> OpenApiRouter<Arc<Server>> {
    OpenApiRouter::new().routes(routes!(set_mode)).routes(routes!(decide))
}

/// What the planner may do by itself.
#[derive(Clone, Copy, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
enum ModeName {
    Autonomous,
    Approve,
    Hold,
}

/// A mode for the planner.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
struct NewMode {
    mode: ModeName,
}

/// A decision on a proposal.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
struct Verdict {
    /// Number of the proposal.
    #[serde(deserialize_with = "whole")]
    #[schema(minimum = 0)]
    proposal: u64,
    /// Whether it is flown.
    approve: bool,
}

/// Says what the planner may do by itself.
#[utoipa::path(post, path = "/api/planner/mode", tag = "console", request_body = NewMode,
    responses((status = 200, description = "as asked", body = Done), Problem))]
async fn set_mode(
    State(server): Home,
    Extension(caller): Extension<Caller>,
    Json(new): Json<NewMode>,
) -> Result<Json<Done>, Problem> {
    let mode = match new.mode {
        ModeName::Autonomous => msg::PlannerStatus::MODE_AUTONOMOUS,
        ModeName::Approve => msg::PlannerStatus::MODE_APPROVE,
        ModeName::Hold => msg::PlannerStatus::MODE_HOLD,
    };
    let request = msg::SetPlannerModeRequest { mode, actor: caller.actor(DOOR) };
    let answer = server.counter()?.ask(move |desks| call(&desks.mode, &request)).await?;
    accepted(answer.accepted, answer.reason)
}

/// Approves or rejects what the planner proposes.
#[utoipa::path(post, path = "/api/planner/review", tag = "console", request_body = Verdict,
    responses((status = 200, description = "as asked", body = Done), Problem))]
async fn decide(
    State(server): Home,
    Extension(caller): Extension<Caller>,
    Json(verdict): Json<Verdict>,
) -> Result<Json<Done>, Problem> {
    // No proposal has that number.
    let nothing = msg::ReviewProposalRequest { proposal: u64::MAX, ..Default::default() };
    let Verdict { proposal, approve } = verdict;
    let request = msg::ReviewProposalRequest { proposal, approve, actor: caller.actor(DOOR) };
    let answer = server.counter()?.ask(move |desks| call_once(&desks.decide, &nothing, request)).await?;
    accepted(answer.accepted, answer.reason)
}
