//! What every handler has at hand: the facts, the way to the mission, and who is let in.

use std::sync::Arc;

use axum::extract::State;
use axum::http::StatusCode;
use tokio::sync::Semaphore;

use crate::asked::Asked;
use crate::desks::Counter;
use crate::guard::Guard;
use crate::problem::Problem;
use crate::shared::Shared;

/// What the server tells, and what it can ask.
pub struct Site {
    /// The facts.
    pub shared: Shared,
    /// Where commands go; none in a replay.
    pub counter: Option<Counter>,
    /// Name of what is shown.
    pub title: String,
    /// Least elevation of the satellite over a target's horizon [deg].
    pub elevation_min_deg: f64,
    /// Who is let in.
    pub guard: Guard,
}

/// What every handler has.
pub struct Server {
    /// What there is to tell.
    pub site: Site,
    /// Tells one run of the server from another one.
    pub run: String,
    /// The API's description, as JSON.
    pub description: String,
    /// What was asked for, as far as it was looked up.
    pub asked: Asked,
    /// Room for readers of the facts.
    pub readers: Arc<Semaphore>,
}

impl Server {
    /// Where commands go.
    ///
    /// # Errors
    /// In a replay.
    pub fn counter(&self) -> Result<&Counter, Problem> {
        let replay = || Problem::new(StatusCode::CONFLICT, "this is a recording: there is no mission to ask");
        self.site.counter.as_ref().ok_or_else(replay)
    }
}

/// The state of handlers.
pub type Home = State<Arc<Server>>;
