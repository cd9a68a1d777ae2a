//! What the page asks over HTTP, and programs as well: JSON in and out.

mod alarms;
mod answers;
mod planner;
mod strips;
mod telemetry;

use std::sync::Arc;

use axum::Extension;
use axum::body::Body;
use axum::extract::State;
use axum::http::header::{CONTENT_TYPE, SET_COOKIE};
use axum::http::{HeaderMap, HeaderValue, StatusCode};
use axum::response::{IntoResponse, Response};
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use self::answers::Done;
use crate::extract::{Json, Params};
use crate::guard::{COOKIE_NAME, Caller};
use crate::guests::Guest;
use crate::numbers::whole;
use crate::problem::Problem;
use crate::server::{Home, Server};
use crate::stream::{self, Reader};
use crate::tokens::Role;

/// Where a browser hands in its token.
pub const LOGIN: &str = "/api/login";
/// Facts of one page of the log.
const PAGE: usize = 10_000;

/// Its routes.
pub fn routes() -> OpenApiRouter<Arc<Server>> {
    OpenApiRouter::new()
        .routes(routes!(info))
        .routes(routes!(facts))
        .routes(routes!(log))
        .routes(routes!(description))
        .routes(routes!(login))
        .merge(strips::routes())
        .merge(planner::routes())
        .merge(alarms::routes())
        .merge(telemetry::routes())
}

/// Whether what is sent to a path changes nothing, so that viewers may.
#[must_use]
pub fn only_asks(path: &str) -> bool {
    path == "/api/strips/preview" || (path.starts_with("/stapi/") && path.ends_with("/opportunities"))
}

/// What is shown.
#[derive(Serialize, ToSchema)]
struct Info {
    /// Whether it is a mission that flies, and not a recording.
    live: bool,
    /// Name of the mission.
    title: String,
    /// Tells one start of the server from another.
    run: String,
    /// Least elevation of the satellite over a target's horizon [deg].
    elevation_min_deg: f64,
    /// Name of the caller's token; none on this machine.
    caller: Option<String>,
    /// Whether the caller may command.
    commands: bool,
}

/// What is shown, and who is looking.
#[utoipa::path(get, path = "/api/info", tag = "console", responses((status = 200, description = "as asked", body = Info), Problem))]
async fn info(State(server): Home, Extension(caller): Extension<Caller>) -> Json<Info> {
    let site = &server.site;
    let live = site.counter.is_some();
    Json(Info {
        live,
        title: site.title.clone(),
        run: server.run.clone(),
        elevation_min_deg: site.elevation_min_deg,
        commands: live && caller.role >= Role::Operator,
        caller: caller.name,
    })
}

/// An event of the stream.
#[derive(ToSchema)]
#[expect(dead_code, reason = "it is written by hand")]
struct Event {
    /// `facts` or `restart`.
    event: String,
    /// Where the reader is: RUN.NUMBER.
    id: Option<String>,
    /// A JSON array of facts.
    data: String,
}

/// Facts as server-sent events: `facts` holds an array, its id is RUN.NUMBER, `restart` says that numbers begin anew.
#[utoipa::path(get, path = "/api/facts", tag = "console",
    params(("Last-Event-ID" = Option<String>, Header, description = "where a reader was")),
    responses((status = 200, description = "events", content_type = "text/event-stream", body = Event), Problem))]
async fn facts(
    State(server): Home,
    guest: Option<Extension<Arc<Guest>>>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let room = Arc::clone(&server.readers).try_acquire_owned();
    let room = room.map_err(|_| {
        let detail = format!("{} others read the facts already; /api/log tells them page by page", stream::READERS);
        Problem::new(StatusCode::SERVICE_UNAVAILABLE, detail)
    })?;
    let last = headers.get("last-event-id").and_then(|value| value.to_str().ok());
    let place = stream::place(last, &server.run);
    let (shared, run, guest) = (server.site.shared.clone(), server.run.clone(), guest.map(|it| it.0));
    let admitted = Box::new(move || server.site.guard.caller(&headers).is_ok());
    let body = stream::body(shared, run, place, Reader { room, guest, admitted });
    Ok(([(CONTENT_TYPE, stream::MEDIA_TYPE)], Body::new(body)).into_response())
}

#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
struct After {
    /// Only facts with greater numbers.
    #[serde(default, deserialize_with = "whole")]
    #[param(minimum = 0)]
    after: u64,
}

/// Facts, page by page.
#[utoipa::path(get, path = "/api/log", tag = "console", params(After),
    responses((status = 200, description = "as asked", body = Vec<serde_json::Value>), Problem))]
async fn log(State(server): Home, Params(After { after }): Params<After>) -> Response {
    let (_, facts) = server.site.shared.batch(usize::try_from(after).unwrap_or(usize::MAX), PAGE);
    ([(CONTENT_TYPE, "application/json")], facts).into_response()
}

/// This description.
#[utoipa::path(get, path = "/api/openapi.json", tag = "console",
    responses((status = 200, description = "as asked", body = serde_json::Value), Problem))]
async fn description(State(server): Home) -> Response {
    ([(CONTENT_TYPE, "application/json")], server.description.clone()).into_response()
}

/// A token, as a browser hands it in.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
struct Login {
    /// The token's secret.
    token: String,
}

/// A token becomes the browser's cookie: events cannot carry another header.
#[utoipa::path(post, path = "/api/login", tag = "console", request_body = Login,
    responses((status = 200, description = "as asked", body = Done), Problem))]
async fn login(State(server): Home, Json(login): Json<Login>) -> Result<Response, Problem> {
    let guard = &server.site.guard;
    let bearer = HeaderValue::try_from(format!("Bearer {}", login.token.trim()))
        .map_err(|_| Problem::new(StatusCode::UNAUTHORIZED, "the token holds characters that no token has"))?;
    guard.caller(&HeaderMap::from_iter([(axum::http::header::AUTHORIZATION, bearer)]))?;
    let secure = if guard.secure() { "; Secure" } else { "" };
    let token = login.token.trim();
    // Without a guard that wants tokens anything is let in: nothing of it goes into a header.
    let token = if token.chars().all(|c| c.is_ascii_hexdigit()) { token } else { "" };
    let cookie = format!("{COOKIE_NAME}={token}; Path=/; HttpOnly; SameSite=Strict; Max-Age=2592000{secure}");
    Ok(([(SET_COOKIE, cookie)], Json(Done { accepted: true })).into_response())
}
