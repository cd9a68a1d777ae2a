//! Opportunities: when a line or area could be imaged, without an order.

use std::sync::Arc;

use axum::extract::State;
use axum::http::HeaderMap;
use serde_json::{Value, json};
use swath_mission::orders::order::Order;
use swath_mission::time_text;
use swath_msgs::swath_msgs as msg;
use swath_node::stamp::nanoseconds;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use super::filter;
use super::links::{DOOR, Links, known};
use super::models::{GEOJSON, Link, Opportunities, Opportunity, OpportunityPayload, OpportunityProperties, PRODUCT};
use crate::extract::{GeoJson, Json, Named};
use crate::problem::Problem;
use crate::server::{Home, Server};
use crate::shapes::{bbox, line};
use crate::times;
use crate::wishes;

pub(super) fn routes() -> OpenApiRouter<Arc<Server>> {
    OpenApiRouter::new().routes(routes!(search))
}

/// Opportunities of a page, unless more or fewer are wanted.
const LIMIT: u32 = 10;
/// Most opportunities of a page.
const LIMIT_MAX: u32 = 100;

/// Looks for opportunities.
#[utoipa::path(post, path = "/products/{product}/opportunities", tag = "stapi",
    params(("product" = String, Path, example = "strip")), request_body = OpportunityPayload,
    responses((status = 200, description = "as asked", body = Opportunities, content_type = "application/geo+json"), Problem))]
async fn search(
    State(server): Home,
    headers: HeaderMap,
    Named(product): Named<String>,
    Json(asked): Json<OpportunityPayload>,
) -> Result<GeoJson<Opportunities>, Problem> {
    known(&product)?;
    let limit = asked.limit.unwrap_or(LIMIT);
    if !(1..=LIMIT_MAX).contains(&limit) {
        return Err(Problem::bad(format!("limit is {limit}, outside 1 to {LIMIT_MAX}")));
    }
    let from = usize::try_from(asked.next.unwrap_or(0)).unwrap_or(usize::MAX);
    let (start, end) = times::parse(&asked.datetime).map_err(Problem::unfit)?;
    let feature = json!({ "type": "Feature", "properties": {}, "geometry": asked.geometry });
    let import = wishes::read(server.counter()?, "search", &feature, DOOR).await?;
    if let Some(fault) = import.refused.first() {
        return Err(Problem::unfit(fault.reason.clone()));
    }
    let limits = Limits {
        start,
        end,
        filter: asked.filter.as_ref().filter(|it| **it != json!({})),
        period_s: server.site.shared.read(|it| it.tick_s()),
    };
    let answers = wishes::preview(server.counter()?, import.orders.clone()).await?;
    let mut found = Vec::new();
    for (order, answer) in import.orders.iter().zip(&answers) {
        limits.take(order, answer, &mut found)?;
    }
    found.sort_by(|a, b| a.properties.datetime.cmp(&b.properties.datetime));
    let links = Links::of(&server, &headers);
    let (all, page) = (found.len(), found.into_iter().skip(from).take(limit as usize));
    let features: Vec<_> = page.map(|it| with_order(it, &asked, &links)).collect();
    let body = order_body(&asked, &asked.datetime);
    let mut further = vec![Link::post("create-order", links.product("/orders"), GEOJSON, Some(body))];
    let next = from.saturating_add(features.len());
    if next < all {
        let body = OpportunityPayload { next: Some(next as u64), limit: Some(limit), ..asked };
        let body = serde_json::to_value(body).ok();
        further.push(Link::post("next", links.product("/opportunities"), GEOJSON, body));
    }
    Ok(GeoJson(Opportunities { kind: "FeatureCollection".to_owned(), features, links: further }))
}

/// The body of an order for what was asked, between two times.
fn order_body(asked: &OpportunityPayload, datetime: &str) -> Value {
    json!({ "datetime": datetime, "geometry": asked.geometry, "order_parameters": {} })
}

fn with_order(mut found: Opportunity, asked: &OpportunityPayload, links: &Links) -> Opportunity {
    let body = order_body(asked, &found.properties.datetime);
    found.links.push(Link::post("create-order", links.product("/orders"), GEOJSON, Some(body)));
    found
}

/// What is looked for besides the place.
struct Limits<'a> {
    start: u64,
    end: u64,
    filter: Option<&'a Value>,
    /// Length of a tick [s].
    period_s: f64,
}

impl Limits<'_> {
    fn take(
        &self,
        order: &Order,
        answer: &msg::PreviewStripResponse,
        found: &mut Vec<Opportunity>,
    ) -> Result<(), Problem> {
        match answer.reason_code {
            0 | msg::StripStatus::REASON_NO_OPPORTUNITY => {}
            code => return Err(Problem::unfit(format!("{} (reason {code})", answer.reason))),
        }
        for it in &answer.opportunities {
            let (open, close) = (nanoseconds(&it.window_open), nanoseconds(&it.window_close));
            if close < self.start || (self.end != 0 && open > self.end) {
                continue;
            }
            let seconds = |ticks: u32| f64::from(ticks) * self.period_s;
            // An order's interval ends when imaging does.
            let done = close.saturating_add((seconds(it.t_acq_ticks) * 1e9) as u64);
            let properties = OpportunityProperties {
                datetime: format!("{}/{}", time_text::format(open), time_text::format(done)),
                product_id: PRODUCT.to_owned(),
                min_elevation_deg: it.min_elevation.to_degrees(),
                duration_s: seconds(it.t_acq_ticks),
                transition_s: it.transition_found.then(|| seconds(it.transition_ticks)),
                conflicts: it.conflicts,
            };
            if self.lets_through(&properties)? {
                let request = &order.request;
                let ends = [
                    [request.start_longitude_deg, request.start_latitude_deg],
                    [request.end_longitude_deg, request.end_latitude_deg],
                ];
                let kind = "Feature".to_owned();
                let bbox = bbox(&[ends]).to_vec();
                found.push(Opportunity { kind, geometry: line(&ends), bbox, properties, links: Vec::new() });
            }
        }
        Ok(())
    }

    fn lets_through(&self, it: &OpportunityProperties) -> Result<bool, Problem> {
        let value = |name: &str| match name {
            "min_elevation_deg" => Some(Some(it.min_elevation_deg)),
            "duration_s" => Some(Some(it.duration_s)),
            "transition_s" => Some(it.transition_s),
            "conflicts" => Some(Some(f64::from(it.conflicts))),
            _ => None,
        };
        self.filter.map_or(Ok(true), |filter| filter::matches(filter, &value).map_err(Problem::unfit))
    }
}
