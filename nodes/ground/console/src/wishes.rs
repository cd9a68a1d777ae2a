//! What callers wish of the request manager, whichever door they come by.

use std::path::PathBuf;

use anyhow::{Result as Answer, ensure};
use serde_json::Value;
use swath_mission::orders::formats::{self, Source};
use swath_mission::orders::found::Import;
use swath_mission::orders::import::import_features;
use swath_mission::orders::order::{MISSION, Order};
use swath_msgs::swath_msgs as msg;
use swath_node::orders::{cutting_of, request_message};

use crate::desks::{Counter, call, call_once};
use crate::problem::Problem;

/// Requests of one call to the request manager.
const BATCH: usize = 1000;
/// Strips of which opportunities are looked for in one call.
pub const PREVIEWS: usize = 100;

/// Reads strips as `swath strips` reads them, cut by the limits of the mission.
///
/// # Errors
/// When they are no GeoJSON, or the mission does not answer.
pub async fn read(counter: &Counter, name: &str, geojson: &Value, submitter: &str) -> Result<Import, Problem> {
    let stem: String = name.chars().filter(|c| c.is_alphanumeric() || "-_ ".contains(*c)).take(60).collect();
    let stem = if stem.trim().is_empty() { submitter.to_owned() } else { stem };
    let path = PathBuf::from(format!("{stem}.geojson"));
    let features = formats::read(&Source::alone(&path, geojson.to_string()))
        .map_err(|why| Problem::unfit(format!("{name:?} {why}")))?;
    let limits = counter.ask(|desks| call(&desks.limits, &msg::GetLimitsRequest::default())).await?;
    let cutting = cutting_of(&limits);
    // Areas take time to cover, and others wait for answers on this thread.
    let cut = tokio::task::spawn_blocking(move || import_features(features, &path, &cutting)).await;
    let mut import = cut.map_err(|_| Problem::unfit("the strips could not be cut"))?;
    for order in &mut import.orders {
        if order.submitter == MISSION {
            submitter.clone_into(&mut order.submitter);
        }
    }
    Ok(import)
}

/// Submits orders; an answer for each, in their order.
///
/// # Errors
/// When the mission does not answer.
pub async fn submit(counter: &Counter, orders: Vec<Order>) -> Result<Vec<msg::SubmitResult>, Problem> {
    let answered = counter.ask(move |desks| {
        let mut answered = Vec::new();
        for batch in orders.chunks(BATCH) {
            let requests = batch.iter().map(request_message).collect();
            let answer = call(&desks.submit, &msg::SubmitStripsRequest { requests })?;
            if answer.reason_code == 0 {
                ensure!(answer.results.len() == batch.len(), "the mission has not answered for every strip");
                answered.extend(answer.results);
                continue;
            }
            let (reason_code, reason) = (answer.reason_code, answer.reason);
            let refused = msg::SubmitResult { reason_code, reason, ..Default::default() };
            answered.extend(std::iter::repeat_n(refused, batch.len()));
        }
        Ok(answered)
    });
    Ok(answered.await?)
}

/// Looks for opportunities; an answer for each order.
///
/// # Errors
/// When there are too many, or the mission does not answer.
pub async fn preview(counter: &Counter, orders: Vec<Order>) -> Result<Vec<msg::PreviewStripResponse>, Problem> {
    let count = orders.len();
    if count > PREVIEWS {
        return Err(Problem::unfit(format!("{count} strips, the limit of a preview is {PREVIEWS}; submit takes more")));
    }
    let answered = counter.ask(move |desks| {
        let one = |order: &Order| -> Answer<msg::PreviewStripResponse> {
            call(&desks.preview, &msg::PreviewStripRequest { id: 0, request: request_message(order), horizon_s: 0.0 })
        };
        orders.iter().map(one).collect::<Answer<Vec<_>>>()
    });
    Ok(answered.await?)
}

/// Takes requests back; an answer for each.
///
/// # Errors
/// When the call is refused as a whole, or the mission does not answer.
pub async fn cancel(
    counter: &Counter,
    ids: Vec<u64>,
    actor: String,
    reason: String,
) -> Result<Vec<msg::SubmitResult>, Problem> {
    let request = msg::CancelStripsRequest { ids, actor, reason };
    let answer = counter.ask(move |desks| call_once(&desks.cancel, &Default::default(), request)).await?;
    whole(answer.results, answer.reason_code, &answer.reason)
}

/// Holds, releases or rejects requests; an answer for each.
///
/// # Errors
/// When the call is refused as a whole, or the mission does not answer.
pub async fn review(counter: &Counter, request: msg::ReviewStripsRequest) -> Result<Vec<msg::SubmitResult>, Problem> {
    let answer = counter.ask(move |desks| call_once(&desks.review, &Default::default(), request)).await?;
    whole(answer.results, answer.reason_code, &answer.reason)
}

/// Replaces a request by an order.
///
/// # Errors
/// When the mission does not answer.
pub async fn replace(counter: &Counter, id: u64, order: &Order) -> Result<msg::SubmitResult, Problem> {
    let request = msg::ReplaceStripRequest { id, request: request_message(order) };
    Ok(counter.ask(move |desks| call(&desks.replace, &request)).await?.result)
}

/// All that is known of a request.
///
/// # Errors
/// When there is none of this number, or the mission does not answer.
pub async fn get(counter: &Counter, id: u64) -> Result<msg::StripReport, Problem> {
    let request = msg::GetStripRequest { id, ..Default::default() };
    let answer = counter.ask(move |desks| call(&desks.get, &request)).await?;
    let unknown = || Problem::unknown(format!("{} (reason {})", answer.reason, answer.reason_code));
    answer.report.first().cloned().ok_or_else(unknown)
}

fn whole(results: Vec<msg::SubmitResult>, reason_code: u16, reason: &str) -> Result<Vec<msg::SubmitResult>, Problem> {
    match reason_code {
        0 => Ok(results),
        _ => Err(Problem::unfit(format!("{reason} (reason {reason_code})"))),
    }
}
