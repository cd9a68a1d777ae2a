//! Alarms: what operators have seen, and what they do not want to see for a while.

use std::sync::Arc;

use axum::Extension;
use axum::extract::State;
use serde::{Deserialize, Serialize};
use swath_msgs::swath_msgs as msg;
use utoipa::ToSchema;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use super::answers::DOOR;
use crate::desks::call;
use crate::extract::Json;
use crate::guard::Caller;
use crate::numbers::{small, wholes};
use crate::problem::Problem;
use crate::server::{Home, Server};

pub(super) fn routes() -> OpenApiRouter<Arc<Server>> {
    OpenApiRouter::new().routes(routes!(acknowledge)).routes(routes!(shelve))
}

/// Alarms that an operator has seen.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
struct Seen {
    /// Their numbers.
    #[serde(deserialize_with = "wholes")]
    ids: Vec<u64>,
}

/// Alarms that are put aside.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
struct Aside {
    /// Their numbers.
    #[serde(deserialize_with = "wholes")]
    ids: Vec<u64>,
    /// For how long, in simulated time [min].
    #[serde(deserialize_with = "small")]
    #[schema(minimum = 1, maximum = 43_200)]
    minutes: u32,
    /// Why.
    #[serde(default)]
    #[schema(max_length = 1000)]
    reason: String,
}

/// How many alarms it counted for.
#[derive(Serialize, ToSchema)]
struct Count {
    count: usize,
}

/// Longest time for which alarms are put aside [min], thirty days, and longest reason [characters].
const MINUTES_MAX: u32 = 43_200;
const REASON_MAX: usize = 1000;

/// Says that alarms have been seen, in every browser.
#[utoipa::path(post, path = "/api/alarms/acknowledge", tag = "console", request_body = Seen,
    responses((status = 200, description = "as asked", body = Count), Problem))]
async fn acknowledge(
    State(server): Home,
    Extension(caller): Extension<Caller>,
    Json(seen): Json<Seen>,
) -> Result<Json<Count>, Problem> {
    let (counter, actor) = (server.counter()?, caller.actor(DOOR));
    let mut count = 0;
    for id in seen.ids {
        let Some((node, name)) = server.site.shared.read(|ledger| ledger.kept_alarm(id)) else {
            count += usize::from(server.site.shared.update(|ledger| ledger.acknowledge(id, &actor)));
            continue;
        };
        let request = msg::AcknowledgeAlarmRequest { node, name, actor: actor.clone(), comment: String::new() };
        // Said twice, the second time is refused.
        let answer = counter.ask(move |desks| call(&desks.acknowledge, &request)).await?;
        count += usize::from(answer.accepted);
    }
    Ok(Json(Count { count }))
}

/// Puts alarms aside for a while: raised again, they do not count until then.
#[utoipa::path(post, path = "/api/alarms/shelve", tag = "console", request_body = Aside,
    responses((status = 200, description = "as asked", body = Count), Problem))]
async fn shelve(
    State(server): Home,
    Extension(caller): Extension<Caller>,
    Json(aside): Json<Aside>,
) -> Result<Json<Count>, Problem> {
    let counter = server.counter()?;
    if !(1..=MINUTES_MAX).contains(&aside.minutes) || aside.reason.chars().count() > REASON_MAX {
        return Err(Problem::bad(format!("minutes must be 1 to {MINUTES_MAX}, reason up to {REASON_MAX} characters")));
    }
    let (actor, minutes) = (caller.actor(DOOR), aside.minutes);
    let mut count = 0;
    for id in aside.ids {
        let Some((node, name)) = server.site.shared.read(|ledger| ledger.kept_alarm(id)) else {
            let put = server.site.shared.update(|ledger| ledger.shelve(id, minutes, &actor, &aside.reason));
            count += usize::from(put);
            continue;
        };
        let (duration_s, comment) = (f64::from(minutes) * 60.0, aside.reason.clone());
        let request = msg::ShelveAlarmRequest { node, name, duration_s, actor: actor.clone(), comment };
        let answer = counter.ask(move |desks| call(&desks.shelve, &request)).await?;
        count += usize::from(answer.accepted);
    }
    Ok(Json(Count { count }))
}
