//! Orders: placed, told of, taken back.

use std::sync::Arc;

use axum::Extension;
use axum::extract::State;
use axum::http::header::LOCATION;
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};
use serde::Deserialize;
use serde_json::{Map, Value, json};
use swath_msgs::swath_msgs as msg;
use swath_node::stamp::nanoseconds;
use utoipa::IntoParams;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use super::groups::{self, Group};
use super::links::{DOOR, Links, known};
use super::models::{
    GEOJSON, JSON, Link, Order, OrderParameters, OrderPayload, OrderProperties, Orders, PRODUCT, SearchParameters,
    Statuses, VERSION,
};
use super::status;
use crate::extract::{GeoJson, Json, Named, Params};
use crate::guard::Caller;
use crate::numbers::perhaps_whole;
use crate::problem::Problem;
use crate::server::{Home, Server};
use crate::shapes::{Ends, bbox, lines};
use crate::times;
use crate::wishes;

pub(super) fn routes() -> OpenApiRouter<Arc<Server>> {
    OpenApiRouter::new()
        .routes(routes!(list, create))
        .routes(routes!(list_all))
        .routes(routes!(get, cancel))
        .routes(routes!(statuses))
}

/// Orders of a page, unless more or fewer are wanted.
const LIMIT: usize = 10;
/// Most orders of a page.
const LIMIT_MAX: usize = 100;
/// Longest reason [characters].
const REASON_MAX: usize = 1000;

/// Which orders.
#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
struct Page {
    /// Most orders of a page.
    #[param(minimum = 1, maximum = 100)]
    limit: Option<usize>,
    /// Where the next page begins, as the page before says.
    #[serde(default, deserialize_with = "perhaps_whole")]
    #[param(minimum = 0)]
    next: Option<u64>,
}

/// Why an order is taken back.
#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
struct Why {
    /// The reason.
    #[param(max_length = 1000)]
    reason: Option<String>,
}

fn ends(strip: &msg::Strip) -> Ends {
    [[strip.start_longitude_deg, strip.start_latitude_deg], [strip.end_longitude_deg, strip.end_latitude_deg]]
}

fn order(group: &Group, period_s: f64, epoch_ns: u64, links: &Links) -> Order {
    let Group { strips, request } = group;
    // A twin is the same strip.
    let firsts: Vec<_> = strips.iter().filter(|it| it.linked_to == 0 || it.strip.id < it.linked_to).collect();
    let places: Vec<_> = firsts.iter().map(|it| ends(&it.strip)).collect();
    let id = strips.first().map_or(0, |it| it.strip.id).to_string();
    let created = strips.first().map_or(0.0, |it| it.created_tick as f64 * period_s);
    let created_ns = epoch_ns.saturating_add((created * 1e9) as u64);
    let end = |time| nanoseconds(time);
    let datetime = times::format(end(&request.valid_from), end(&request.valid_until), created_ns);
    let geometry = lines(&places);
    let parameters = OrderParameters {
        name: Some(request.name.clone()).filter(|it| !it.is_empty()),
        client_ref: Some(request.client_ref.clone()).filter(|it| !it.is_empty()),
        priority: Some(firsts.iter().map(|it| it.strip.priority).sum::<f64>().min(1.0)),
        acquisition_speed_m_s: Some(request.acquisition_speed),
        bidirectional: Some(request.bidirectional),
        hold_for_approval: Some(request.hold_for_approval),
        max_attempts: Some(request.max_attempts),
    };
    let mut further = vec![
        Link::new("self", links.to(&format!("/orders/{id}")), GEOJSON),
        Link::new("monitor", links.to(&format!("/orders/{id}/statuses")), JSON),
        Link { method: Some("DELETE".to_owned()), ..Link::new("cancel", links.to(&format!("/orders/{id}")), GEOJSON) },
    ];
    for (rel, other) in
        strips.iter().flat_map(|it| [("successor-version", it.superseded_by), ("predecessor-version", it.supersedes)])
    {
        if other != 0 {
            further.push(Link::new(rel, links.to(&format!("/orders/{other}")), GEOJSON));
        }
    }
    Order {
        kind: "Feature".to_owned(),
        stapi_type: "Order".to_owned(),
        stapi_version: VERSION.to_owned(),
        id,
        bbox: bbox(&places).to_vec(),
        geometry: geometry.clone(),
        properties: OrderProperties {
            product_id: PRODUCT.to_owned(),
            created: swath_mission::time_text::format(created_ns),
            status: status::of_all(&strips.iter().collect::<Vec<_>>()),
            search_parameters: SearchParameters { datetime, geometry },
            opportunity_properties: json!({}),
            order_parameters: parameters,
            strips: strips.iter().map(|it| it.strip.id).collect(),
        },
        links: further,
    }
}

async fn told(server: &Server, ids: &[u64], links: &Links) -> Result<Order, Problem> {
    let group = groups::load(server, ids).await?;
    let (period_s, epoch_ns) = server.site.shared.read(|ledger| (ledger.tick_s(), ledger.epoch_ns()));
    Ok(order(&group, period_s, epoch_ns, links))
}

async fn page(server: &Server, asked: Page, path: String, links: &Links) -> Result<GeoJson<Orders>, Problem> {
    server.counter()?;
    let limit = asked.limit.unwrap_or(LIMIT);
    if !(1..=LIMIT_MAX).contains(&limit) {
        return Err(Problem::bad(format!("limit is {limit}, outside 1 to {LIMIT_MAX}")));
    }
    let after = asked.next.unwrap_or(0);
    let all = groups::all(server);
    let number_matched = all.len();
    let begin = all.partition_point(|ids| ids.first().is_none_or(|first| *first <= after));
    let mut features = Vec::new();
    for ids in all.iter().skip(begin).take(limit) {
        features.push(told(server, ids, links).await?);
    }
    let mut further = vec![Link::new("self", path.clone(), GEOJSON)];
    if let Some(last) = features.last().filter(|_| begin + limit < number_matched) {
        further.push(Link::new("next", format!("{path}?limit={limit}&next={}", last.id), GEOJSON));
    }
    Ok(GeoJson(Orders { kind: "FeatureCollection".to_owned(), features, number_matched, links: further }))
}

/// Orders, page by page.
#[utoipa::path(get, path = "/orders", tag = "stapi", params(Page),
    responses((status = 200, description = "as asked", body = Orders, content_type = "application/geo+json"), Problem))]
async fn list_all(
    State(server): Home,
    headers: HeaderMap,
    Params(asked): Params<Page>,
) -> Result<GeoJson<Orders>, Problem> {
    let links = Links::of(&server, &headers);
    page(&server, asked, links.to("/orders"), &links).await
}

/// Orders of the product, page by page.
#[utoipa::path(get, path = "/products/{product}/orders", tag = "stapi",
    params(("product" = String, Path, example = "strip"), Page),
    responses((status = 200, description = "as asked", body = Orders, content_type = "application/geo+json"), Problem))]
async fn list(
    State(server): Home,
    headers: HeaderMap,
    Named(product): Named<String>,
    Params(asked): Params<Page>,
) -> Result<GeoJson<Orders>, Problem> {
    known(&product)?;
    let links = Links::of(&server, &headers);
    page(&server, asked, links.product("/orders"), &links).await
}

/// The order as a feature, as files have it.
fn feature(payload: &OrderPayload) -> Result<Value, Problem> {
    let (start, end) = times::parse(&payload.datetime).map_err(Problem::unfit)?;
    if payload.filter.as_ref().is_some_and(|it| !it.is_null() && *it != json!({})) {
        return Err(Problem::unfit("an order takes no filter: the planner chooses when to image"));
    }
    let Ok(Value::Object(mut properties)) = serde_json::to_value(&payload.order_parameters) else {
        return Err(Problem::bad("no order parameters"));
    };
    let bound = |key: &str, ns: u64, properties: &mut Map<String, Value>| {
        if ns != 0 {
            properties.insert(key.to_owned(), swath_mission::time_text::format(ns).into());
        }
    };
    bound("valid_from", start, &mut properties);
    bound("valid_until", end, &mut properties);
    Ok(json!({ "type": "Feature", "properties": properties, "geometry": payload.geometry }))
}

/// Places an order.
#[utoipa::path(post, path = "/products/{product}/orders", tag = "stapi",
    params(("product" = String, Path, example = "strip")), request_body = OrderPayload,
    responses(
        (status = 201, description = "as asked", body = Order, content_type = "application/geo+json",
            headers(("Location" = String, description = "where the order is"))),
        Problem))]
async fn create(
    State(server): Home,
    Extension(caller): Extension<Caller>,
    headers: HeaderMap,
    Named(product): Named<String>,
    Json(payload): Json<OrderPayload>,
) -> Result<Response, Problem> {
    known(&product)?;
    let feature = feature(&payload)?;
    let import = wishes::read(server.counter()?, "order", &feature, &caller.actor(DOOR)).await?;
    if let Some(fault) = import.refused.first() {
        return Err(Problem::unfit(fault.reason.clone()));
    }
    let results = wishes::submit(server.counter()?, import.orders).await?;
    let taken: Vec<u64> = results.iter().filter(|it| it.accepted).map(|it| it.id).collect();
    let Some(first) = taken.iter().min() else {
        let why = results.into_iter().next().unwrap_or_default();
        let known = [msg::StripStatus::REASON_DUPLICATE, msg::StripStatus::REASON_SAME_STRIP];
        let status =
            if known.contains(&why.reason_code) { StatusCode::CONFLICT } else { StatusCode::UNPROCESSABLE_ENTITY };
        return Err(Problem::new(status, format!("{} (reason {})", why.reason, why.reason_code)));
    };
    // A twin has the next number.
    groups::fetch(&server, &taken.iter().flat_map(|id| [*id, id + 1]).collect::<Vec<_>>()).await?;
    let ids = groups::all(&server).into_iter().find(|ids| ids.contains(first));
    let ids = ids.ok_or_else(|| Problem::unknown("the order is not known yet"))?;
    let links = Links::of(&server, &headers);
    let order = told(&server, &ids, &links).await?;
    let location = links.to(&format!("/orders/{}", order.id));
    Ok((StatusCode::CREATED, [(LOCATION, location)], GeoJson(order)).into_response())
}

/// An order.
#[utoipa::path(get, path = "/orders/{order}", tag = "stapi", params(("order" = String, Path)),
    responses((status = 200, description = "as asked", body = Order, content_type = "application/geo+json"), Problem))]
async fn get(State(server): Home, headers: HeaderMap, Named(id): Named<String>) -> Result<GeoJson<Order>, Problem> {
    server.counter()?;
    let ids = groups::one(&server, &id)?;
    Ok(GeoJson(told(&server, &ids, &Links::of(&server, &headers)).await?))
}

/// Takes an order back (not in the specification).
#[utoipa::path(delete, path = "/orders/{order}", tag = "stapi", params(("order" = String, Path), Why),
    responses((status = 200, description = "as asked", body = Order, content_type = "application/geo+json"), Problem))]
async fn cancel(
    State(server): Home,
    Extension(caller): Extension<Caller>,
    headers: HeaderMap,
    Named(id): Named<String>,
    Params(Why { reason }): Params<Why>,
) -> Result<GeoJson<Order>, Problem> {
    let reason = reason.unwrap_or_default();
    if reason.chars().count() > REASON_MAX {
        return Err(Problem::bad(format!("the reason is longer than {REASON_MAX} characters")));
    }
    let counter = server.counter()?;
    let ids = groups::one(&server, &id)?;
    let results = wishes::cancel(counter, ids.clone(), caller.actor(DOOR), reason).await?;
    if results.iter().all(|it| !it.accepted) {
        let why = results.into_iter().next().unwrap_or_default();
        return Err(Problem::new(StatusCode::CONFLICT, format!("{} (reason {})", why.reason, why.reason_code)));
    }
    groups::fetch(&server, &ids).await?;
    Ok(GeoJson(told(&server, &ids, &Links::of(&server, &headers)).await?))
}

/// How an order stood, and stands.
#[utoipa::path(get, path = "/orders/{order}/statuses", tag = "stapi", params(("order" = String, Path)),
    responses((status = 200, description = "as asked", body = Statuses), Problem))]
async fn statuses(
    State(server): Home,
    headers: HeaderMap,
    Named(id): Named<String>,
) -> Result<Json<Statuses>, Problem> {
    let counter = server.counter()?;
    let ids = groups::one(&server, &id)?;
    let mut entries = Vec::new();
    for id in &ids {
        entries.extend(wishes::get(counter, *id).await?.history);
    }
    // Histories of replaced requests begin their successors'.
    entries.sort_by_key(|entry| entry.sequence);
    entries.dedup_by_key(|entry| entry.sequence);
    let one = |it: &msg::HistoryEntry| status::status(it.state, it.reason_code, &it.reason, nanoseconds(&it.stamp));
    let links = Links::of(&server, &headers);
    let links = vec![Link::new("self", links.to(&format!("/orders/{id}/statuses")), JSON)];
    Ok(Json(Statuses { statuses: entries.iter().map(one).collect(), links }))
}
