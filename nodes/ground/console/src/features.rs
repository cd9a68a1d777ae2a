//! OGC API Features 1.0: the strips as a collection, so that QGIS and GDAL open them.

use std::sync::Arc;

use axum::extract::State;
use axum::http::HeaderMap;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use swath_mission::requests::lifecycle::State as Stage;
use swath_mission::time_text;
use swath_msgs::swath_msgs as msg;
use swath_node::stamp::nanoseconds;
use utoipa::{IntoParams, ToSchema};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::extract::{GeoJson, Json, Named, Params};
use crate::numbers::perhaps_whole;
use crate::problem::Problem;
use crate::schemas;
use crate::server::{Home, Server};
use crate::shapes::{Ends, bbox, line};

/// Its routes, from its landing page.
pub fn routes() -> OpenApiRouter<Arc<Server>> {
    OpenApiRouter::new()
        .routes(routes!(landing))
        .routes(routes!(conformance))
        .routes(routes!(collections))
        .routes(routes!(collection))
        .routes(routes!(items))
        .routes(routes!(item))
}

/// The one collection.
const STRIPS: &str = "strips";
/// Strips of a page, unless more or fewer are wanted, and at most.
const LIMIT: usize = 100;
const LIMIT_MAX: usize = 10_000;
/// What is conformed to.
const CONFORMANCE: [&str; 2] = [
    "http://www.opengis.net/spec/ogcapi-features-1/1.0/conf/core",
    "http://www.opengis.net/spec/ogcapi-features-1/1.0/conf/geojson",
];

/// Where the landing page is.
fn base(server: &Server, headers: &HeaderMap) -> String {
    format!("{}/features", server.site.guard.base(headers))
}

fn link(rel: &str, href: String, media_type: &str) -> Value {
    json!({ "rel": rel, "href": href, "type": media_type })
}

const JSON: &str = "application/json";
const GEOJSON: &str = "application/geo+json";

/// The landing page.
#[utoipa::path(get, path = "/", tag = "features", responses((status = 200, description = "as asked", body = Value), Problem))]
async fn landing(State(server): Home, headers: HeaderMap) -> Json<Value> {
    let base = base(&server, &headers);
    let description = base.replace("/features", "/api/openapi.json");
    Json(json!({
        "title": server.site.title,
        "description": "Strips of a Swath mission; times are simulated UTC",
        "links": [
            link("self", base.clone(), JSON),
            link("conformance", format!("{base}/conformance"), JSON),
            link("data", format!("{base}/collections"), JSON),
            link("service-desc", description, "application/vnd.oai.openapi+json;version=3.1"),
        ],
    }))
}

/// What the API conforms to.
#[utoipa::path(get, path = "/conformance", tag = "features", responses((status = 200, description = "as asked", body = Value), Problem))]
async fn conformance() -> Json<Value> {
    Json(json!({ "conformsTo": CONFORMANCE }))
}

fn strips(base: &str) -> Value {
    let path = format!("{base}/collections/{STRIPS}");
    json!({
        "id": STRIPS,
        "title": "Strips",
        "description": "Every strip that was requested, with the state that it is in",
        "itemType": "feature",
        "extent": { "spatial": { "bbox": [[-180, -90, 180, 90]], "crs": CRS } },
        "crs": [CRS],
        "links": [link("self", path.clone(), JSON), link("items", format!("{path}/items"), GEOJSON)],
    })
}

const CRS: &str = "http://www.opengis.net/def/crs/OGC/1.3/CRS84";

/// The collections.
#[utoipa::path(get, path = "/collections", tag = "features", responses((status = 200, description = "as asked", body = Value), Problem))]
async fn collections(State(server): Home, headers: HeaderMap) -> Json<Value> {
    let base = base(&server, &headers);
    let links = [link("self", format!("{base}/collections"), JSON)];
    Json(json!({ "collections": [strips(&base)], "links": links }))
}

fn known(collection: &str) -> Result<(), Problem> {
    if collection == STRIPS { Ok(()) } else { Err(Problem::unknown(format!("there is no collection {collection:?}"))) }
}

/// A collection.
#[utoipa::path(get, path = "/collections/{collection}", tag = "features",
    params(("collection" = String, Path, example = "strips")), responses((status = 200, description = "as asked", body = Value), Problem))]
async fn collection(State(server): Home, headers: HeaderMap, Named(id): Named<String>) -> Result<Json<Value>, Problem> {
    known(&id)?;
    Ok(Json(strips(&base(&server, &headers))))
}

/// Which strips.
#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
struct Which {
    /// Most strips of a page; more than 10 000 are 10 000.
    #[param(minimum = 1)]
    limit: Option<usize>,
    /// Only strips with greater numbers.
    #[serde(default, deserialize_with = "perhaps_whole")]
    #[param(minimum = 0)]
    after: Option<u64>,
    /// West, south, east, north [deg].
    #[param(schema_with = schemas::bounding_box)]
    bbox: Option<String>,
    /// Only strips that last changed at this simulated time or in this interval.
    #[param(schema_with = schemas::time_or_interval)]
    datetime: Option<String>,
    /// Only strips in this state.
    #[param(schema_with = schemas::state)]
    state: Option<String>,
}

/// Strips.
#[derive(Serialize, ToSchema)]
struct Features {
    /// `FeatureCollection`.
    #[serde(rename = "type")]
    kind: String,
    #[schema(value_type = Vec<Object>)]
    features: Vec<Value>,
    #[serde(rename = "numberMatched")]
    number_matched: usize,
    #[serde(rename = "numberReturned")]
    number_returned: usize,
    #[schema(value_type = Vec<Object>)]
    links: Vec<Value>,
}

/// What is looked for.
struct Sought {
    area: Option<[f64; 4]>,
    from: u64,
    until: u64,
    state: Option<u8>,
}

impl Sought {
    fn of(which: &Which) -> Result<Self, Problem> {
        let area = which.bbox.as_deref().map(area).transpose()?;
        let (from, until) = match which.datetime.as_deref() {
            None => (0, 0),
            Some(text) if text.contains('/') => crate::times::parse(text).map_err(Problem::bad)?,
            Some(text) => time_text::parse(text).map(|it| (it, it)).map_err(Problem::bad)?,
        };
        let state = which.state.as_deref().map(|name| {
            let found = Stage::ALL.into_iter().find(|state| state.name() == name);
            found.map(|state| state as u8).ok_or_else(|| Problem::bad(format!("there is no state {name:?}")))
        });
        Ok(Self { area, from, until, state: state.transpose()? })
    }

    fn holds(&self, status: &msg::StripStatus) -> bool {
        let at = nanoseconds(&status.header.stamp);
        self.state.is_none_or(|state| status.state == state)
            && at >= self.from
            && (self.until == 0 || at <= self.until)
            && self.area.is_none_or(|area| overlaps(&bbox(&[ends(status)]), &area))
    }
}

/// West, south, east, north; of six numbers the heights are passed over.
fn area(text: &str) -> Result<[f64; 4], Problem> {
    let wrong = || Problem::bad(format!("bbox is {text:?}, expected WEST,SOUTH,EAST,NORTH in degrees"));
    let numbers =
        text.split(',').map(|it| it.trim().parse::<f64>()).collect::<Result<Vec<_>, _>>().map_err(|_| wrong())?;
    let [west, south, east, north] = match numbers[..] {
        [west, south, east, north] | [west, south, _, east, north, _] => [west, south, east, north],
        _ => return Err(wrong()),
    };
    let degrees = [west, east].iter().all(|it| it.abs() <= 180.0) && [south, north].iter().all(|it| it.abs() <= 90.0);
    if !degrees || south > north {
        return Err(wrong());
    }
    Ok([west, south, east, north])
}

/// Whether two boxes have a point in common; west is greater than east across the antimeridian.
fn overlaps(a: &[f64; 4], b: &[f64; 4]) -> bool {
    let spans =
        |it: &[f64; 4]| if it[0] <= it[2] { vec![(it[0], it[2])] } else { vec![(it[0], 180.0), (-180.0, it[2])] };
    let across = spans(a).iter().any(|x| spans(b).iter().any(|y| x.0 <= y.1 && y.0 <= x.1));
    across && a[1] <= b[3] && b[1] <= a[3]
}

fn ends(status: &msg::StripStatus) -> Ends {
    let strip = &status.strip;
    [[strip.start_longitude_deg, strip.start_latitude_deg], [strip.end_longitude_deg, strip.end_latitude_deg]]
}

fn feature(status: &msg::StripStatus) -> Value {
    let time = |ns: u64| (ns != 0).then(|| time_text::format(ns));
    json!({
        "type": "Feature",
        "id": status.strip.id,
        "geometry": line(&ends(status)),
        "properties": {
            "name": status.strip.name,
            "state": Stage::from_number(status.state).map_or("unknown", Stage::name),
            "reason_code": status.reason_code,
            "reason": status.reason,
            "submitter": status.submitter,
            "client_ref": status.client_ref,
            "priority": status.strip.priority,
            "acquisition_speed_m_s": status.strip.acquisition_speed,
            "attempts": status.attempts,
            "reward": status.reward,
            "changed": time(nanoseconds(&status.header.stamp)),
            "changed_by": status.actor,
            "window_open": time(nanoseconds(&status.window_open)),
            "window_close": time(nanoseconds(&status.window_close)),
            "imaging": time(nanoseconds(&status.imaging)),
        },
    })
}

/// Strips, page by page.
#[utoipa::path(get, path = "/collections/{collection}/items", tag = "features",
    params(("collection" = String, Path, example = "strips"), Which),
    responses((status = 200, description = "as asked", body = Features, content_type = "application/geo+json"), Problem))]
async fn items(
    State(server): Home,
    headers: HeaderMap,
    Named(id): Named<String>,
    Params(which): Params<Which>,
) -> Result<GeoJson<Features>, Problem> {
    known(&id)?;
    let limit = which.limit.unwrap_or(LIMIT);
    if limit == 0 {
        return Err(Problem::bad("limit is 0, expected 1 or more"));
    }
    let (limit, after) = (limit.min(LIMIT_MAX), which.after.unwrap_or(0));
    let sought = Sought::of(&which)?;
    let (features, number_matched, last) = server.site.shared.read(|ledger| {
        let found: Vec<_> = ledger.requests().values().filter(|status| sought.holds(status)).collect();
        let begin = found.partition_point(|status| status.strip.id <= after);
        let page = &found[begin..found.len().min(begin.saturating_add(limit))];
        let last = page.last().filter(|_| begin + page.len() < found.len()).map(|status| status.strip.id);
        (page.iter().map(|status| feature(status)).collect::<Vec<_>>(), found.len(), last)
    });
    let path = format!("{}/collections/{STRIPS}/items", base(&server, &headers));
    let mut links = vec![link("self", path.clone(), GEOJSON)];
    if let Some(last) = last {
        let filters = [("bbox", &which.bbox), ("datetime", &which.datetime), ("state", &which.state)];
        let kept =
            filters.iter().filter_map(|(key, value)| value.as_ref().map(|value| format!("&{key}={}", escaped(value))));
        links.push(link("next", format!("{path}?limit={limit}&after={last}{}", kept.collect::<String>()), GEOJSON));
    }
    let number_returned = features.len();
    Ok(GeoJson(Features { kind: "FeatureCollection".to_owned(), features, number_matched, number_returned, links }))
}

/// As it may stand in a query.
fn escaped(text: &str) -> String {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"-._~,:".contains(&byte);
    text.bytes().map(|byte| if plain(byte) { char::from(byte).to_string() } else { format!("%{byte:02X}") }).collect()
}

/// A strip.
#[utoipa::path(get, path = "/collections/{collection}/items/{item}", tag = "features",
    params(("collection" = String, Path, example = "strips"), ("item" = String, Path, example = "1")),
    responses((status = 200, description = "as asked", body = Value, content_type = "application/geo+json"), Problem))]
async fn item(
    State(server): Home,
    headers: HeaderMap,
    Named((collection, id)): Named<(String, String)>,
) -> Result<GeoJson<Value>, Problem> {
    known(&collection)?;
    let number = id.parse::<u64>().ok();
    let found = server.site.shared.read(|ledger| number.and_then(|it| ledger.requests().get(&it).map(feature)));
    let mut found = found.ok_or_else(|| Problem::unknown(format!("there is no strip {id:?}")))?;
    let base = format!("{}/collections/{STRIPS}", base(&server, &headers));
    found["links"] = json!([link("self", format!("{base}/items/{id}"), GEOJSON), link("collection", base, JSON)]);
    Ok(GeoJson(found))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_meet_across_the_antimeridian() {
        let pacific = [170.0, -10.0, -170.0, 10.0];
        assert!(overlaps(&pacific, &[175.0, 0.0, 176.0, 1.0]));
        assert!(overlaps(&[-176.0, 0.0, -175.0, 1.0], &pacific));
        assert!(!overlaps(&pacific, &[0.0, 0.0, 10.0, 1.0]));
        assert!(!overlaps(&pacific, &[175.0, 20.0, 176.0, 21.0]));
    }

    #[test]
    fn areas_are_four_numbers_or_six() {
        assert_eq!(area("1,2,3,4").ok(), Some([1.0, 2.0, 3.0, 4.0]));
        assert_eq!(area("1,2,0,3,4,9").ok(), Some([1.0, 2.0, 3.0, 4.0]));
        for wrong in ["", "1,2,3", "1,2,3,x", "1,4,3,2", "181,0,0,0", "nan,0,0,0"] {
            assert!(area(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn queries_keep_their_meaning_in_links() {
        assert_eq!(escaped("a b&c=ü"), "a%20b%26c%3D%C3%BC");
    }
}
