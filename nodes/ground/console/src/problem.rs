//! What is answered when something is not done: problem details (RFC 9457).

use std::collections::BTreeMap;

use axum::http::StatusCode;
use axum::http::header::CONTENT_TYPE;
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use utoipa::openapi::{ContentBuilder, Ref, RefOr, Response as Described, ResponseBuilder};
use utoipa::{IntoResponses, ToSchema};

/// Why something is not done.
#[derive(Debug)]
pub struct Problem {
    /// Status of the answer.
    pub status: StatusCode,
    /// Why, in words.
    pub detail: String,
}

/// A problem as it is sent.
#[derive(Serialize, ToSchema)]
pub struct ProblemDetails {
    /// What the status means.
    title: String,
    /// Status of the answer.
    #[schema(minimum = 400, maximum = 599)]
    status: u16,
    /// What is wrong with this request.
    detail: String,
}

impl Problem {
    /// A problem with a status.
    pub fn new(status: StatusCode, detail: impl Into<String>) -> Self {
        Self { status, detail: detail.into() }
    }

    /// What was sent is not what is expected.
    pub fn bad(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::BAD_REQUEST, detail)
    }

    /// What was sent is well-formed, and cannot be done.
    pub fn unfit(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::UNPROCESSABLE_ENTITY, detail)
    }

    /// There is no such thing.
    pub fn unknown(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::NOT_FOUND, detail)
    }
}

/// The media type of problems.
pub const PROBLEM: &str = "application/problem+json";

impl IntoResponse for Problem {
    fn into_response(self) -> Response {
        let title = self.status.canonical_reason().unwrap_or("problem").to_owned();
        let details = ProblemDetails { title, status: self.status.as_u16(), detail: self.detail };
        // Three texts always have a form in JSON.
        let body = serde_json::to_string(&details).unwrap_or_default();
        (self.status, [(CONTENT_TYPE, PROBLEM)], body).into_response()
    }
}

/// The mission does not answer.
impl From<anyhow::Error> for Problem {
    fn from(error: anyhow::Error) -> Self {
        Self::new(StatusCode::BAD_GATEWAY, format!("{error:#}"))
    }
}

/// In the description of the API: what may be answered instead of what was asked for.
impl IntoResponses for Problem {
    fn responses() -> BTreeMap<String, RefOr<Described>> {
        let statuses = [400, 401, 403, 404, 405, 408, 409, 411, 413, 415, 421, 422, 429, 502, 503];
        let one = |status: u16| {
            let meaning = StatusCode::from_u16(status).ok().and_then(|it| it.canonical_reason()).unwrap_or_default();
            let details = ContentBuilder::new().schema(Some(Ref::from_schema_name("ProblemDetails"))).build();
            let response = ResponseBuilder::new().description(meaning).content(PROBLEM, details).build();
            (status.to_string(), RefOr::T(response))
        };
        statuses.into_iter().map(one).collect()
    }
}
