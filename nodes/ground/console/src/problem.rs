//! What is answered when something is not done: problem details (RFC 9457).

use hyper::StatusCode;
use serde_json::json;

/// Why something is not done.
#[derive(Debug)]
pub struct Problem {
    /// Status of the answer.
    pub status: StatusCode,
    /// Why, in words.
    pub detail: String,
}

impl Problem {
    /// A problem with a status.
    pub fn new(status: StatusCode, detail: impl Into<String>) -> Self {
        Self { status, detail: detail.into() }
    }

    /// What was sent cannot be used.
    pub fn bad(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::BAD_REQUEST, detail)
    }

    /// The answer's body.
    #[must_use]
    pub fn body(&self) -> String {
        let title = self.status.canonical_reason().unwrap_or("problem");
        json!({ "title": title, "status": self.status.as_u16(), "detail": self.detail }).to_string()
    }
}

/// The mission does not answer.
impl From<anyhow::Error> for Problem {
    fn from(error: anyhow::Error) -> Self {
        Self::new(StatusCode::BAD_GATEWAY, format!("{error:#}"))
    }
}
