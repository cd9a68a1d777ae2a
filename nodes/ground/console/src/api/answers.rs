//! What several parts of the page's API answer.

use axum::http::StatusCode;
use serde::Serialize;
use utoipa::ToSchema;

use crate::extract::Json;
use crate::problem::Problem;

/// The door of those who come this way, as the trail tells it.
pub const DOOR: &str = "console";

/// It is done.
#[derive(Serialize, ToSchema)]
pub struct Done {
    /// Always so: what is refused is a problem.
    pub accepted: bool,
}

/// Whether it is done.
///
/// # Errors
/// With the reason when it is not.
pub fn accepted(accepted: bool, reason: String) -> Result<Json<Done>, Problem> {
    if accepted { Ok(Json(Done { accepted })) } else { Err(Problem::new(StatusCode::CONFLICT, reason)) }
}
