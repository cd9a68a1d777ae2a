//! What STAPI's answers and bodies look like (stapi-spec v0.1.0).

use serde::{Deserialize, Serialize};
use serde_json::Value;
use utoipa::ToSchema;

use crate::numbers::{perhaps_small, perhaps_whole};
use crate::schemas::interval;

/// The version of the specification.
pub const VERSION: &str = "0.1.0";
/// The one product: an image of strips.
pub const PRODUCT: &str = "strip";
/// What the whole conforms to, and the product.
pub const CONFORMANCE: [&str; 2] =
    ["https://stapi.example.com/v0.1.0/core", "https://stapi.example.com/v0.1.0/order-statuses"];
/// What the product conforms to.
pub const PRODUCT_CONFORMANCE: [&str; 3] = [
    "https://stapi.example.com/v0.1.0/opportunities",
    "https://geojson.org/schema/LineString.json",
    "https://geojson.org/schema/Polygon.json",
];

/// A link.
#[derive(Clone, Serialize, ToSchema)]
pub struct Link {
    /// Where it leads, as an absolute URL.
    pub href: String,
    /// What is there.
    pub rel: String,
    /// Its media type.
    #[serde(rename = "type")]
    pub media_type: String,
    /// The method, if it is not GET.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub method: Option<String>,
    /// The body, if the method has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body: Option<Value>,
}

/// JSON, and GeoJSON.
pub const JSON: &str = "application/json";
/// Features.
pub const GEOJSON: &str = "application/geo+json";

impl Link {
    /// A link that is followed by GET.
    #[must_use]
    pub fn new(rel: &str, href: String, media_type: &str) -> Self {
        Self { href, rel: rel.to_owned(), media_type: media_type.to_owned(), method: None, body: None }
    }

    /// A link that is followed by POST.
    #[must_use]
    pub fn post(rel: &str, href: String, media_type: &str, body: Option<Value>) -> Self {
        Self { method: Some("POST".to_owned()), body, ..Self::new(rel, href, media_type) }
    }
}

/// The door.
#[derive(Serialize, ToSchema)]
pub struct Landing {
    pub id: String,
    #[serde(rename = "conformsTo")]
    pub conforms_to: Vec<String>,
    pub title: String,
    pub description: String,
    pub links: Vec<Link>,
}

/// What is conformed to.
#[derive(Serialize, ToSchema)]
pub struct Conformance {
    #[serde(rename = "conformsTo")]
    pub conforms_to: Vec<String>,
}

/// What can be ordered.
#[derive(Serialize, ToSchema)]
pub struct Product {
    /// `Collection`.
    #[serde(rename = "type")]
    pub kind: String,
    /// `Product`.
    pub stapi_type: String,
    pub stapi_version: String,
    #[serde(rename = "conformsTo")]
    pub conforms_to: Vec<String>,
    pub id: String,
    pub title: String,
    pub description: String,
    pub keywords: Vec<String>,
    pub license: String,
    pub providers: Vec<Provider>,
    pub links: Vec<Link>,
}

/// Who provides it.
#[derive(Serialize, ToSchema)]
pub struct Provider {
    pub name: String,
    pub roles: Vec<String>,
    pub url: String,
}

/// All that can be ordered.
#[derive(Serialize, ToSchema)]
pub struct Products {
    /// `ProductCollection`.
    #[serde(rename = "type")]
    pub kind: String,
    pub products: Vec<Product>,
    pub links: Vec<Link>,
}

/// A line or an area, longitude before latitude [deg]; other members are passed over.
#[derive(Clone, Debug, Deserialize, Serialize, ToSchema)]
#[serde(tag = "type")]
pub enum Shape {
    /// A line; a longer one than a strip may be, or one that bends, becomes several strips.
    LineString {
        /// Its points.
        #[schema(min_items = 2, example = json!([[10.0, 40.0], [10.4, 41.0]]))]
        coordinates: Vec<Vec<f64>>,
    },
    /// An area, covered by strips.
    Polygon {
        /// Its outer ring and its holes.
        #[schema(min_items = 1)]
        coordinates: Vec<Vec<Vec<f64>>>,
    },
}

/// How an order is to be flown.
#[derive(Clone, Debug, Deserialize, Serialize, ToSchema, Default)]
#[serde(deny_unknown_fields)]
pub struct OrderParameters {
    /// Name for people.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Submitter's own reference: the same one again is the same order.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub client_ref: Option<String>,
    /// Reward for imaging it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 0.0, maximum = 1.0)]
    pub priority: Option<f64>,
    /// Speed of the target along the strip [m/s].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub acquisition_speed_m_s: Option<f64>,
    /// Whether it may be imaged from end to start as well.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bidirectional: Option<bool>,
    /// Whether it waits for an operator's approval.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hold_for_approval: Option<bool>,
    /// Attempts before it fails.
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "perhaps_small")]
    #[schema(minimum = 0)]
    pub max_attempts: Option<u32>,
}

/// An order, as it is placed.
#[derive(Deserialize, ToSchema)]
pub struct OrderPayload {
    /// Simulated times between which it is to be imaged; `..` for an open end.
    #[schema(schema_with = interval)]
    pub datetime: String,
    pub geometry: Shape,
    /// Orders take none: the planner chooses when to image.
    #[serde(default)]
    #[schema(value_type = Option<Object>)]
    pub filter: Option<Value>,
    #[serde(default)]
    pub order_parameters: OrderParameters,
}

/// A search for opportunities.
#[derive(Clone, Deserialize, Serialize, ToSchema)]
pub struct OpportunityPayload {
    /// Simulated times between which imaging may start; `..` for an open end.
    #[schema(schema_with = interval)]
    pub datetime: String,
    pub geometry: Shape,
    /// CQL2-JSON over the queryables: comparisons, `between`, `and`, `or`, `not`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<Object>)]
    pub filter: Option<Value>,
    /// Most opportunities of a page.
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "perhaps_small")]
    #[schema(minimum = 1, maximum = 100)]
    pub limit: Option<u32>,
    /// Where the next page begins, as the page before says.
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "perhaps_whole")]
    #[schema(minimum = 0)]
    pub next: Option<u64>,
}

/// A chance to image a strip.
#[derive(Serialize, ToSchema)]
pub struct Opportunity {
    /// `Feature`.
    #[serde(rename = "type")]
    pub kind: String,
    #[schema(value_type = Object)]
    pub geometry: Value,
    pub bbox: Vec<f64>,
    pub properties: OpportunityProperties,
    pub links: Vec<Link>,
}

/// What is known of a chance.
#[derive(Clone, Serialize, ToSchema)]
pub struct OpportunityProperties {
    /// From the first moment at which imaging may start to the last at which it ends.
    pub datetime: String,
    pub product_id: String,
    /// Least elevation while imaging [deg].
    pub min_elevation_deg: f64,
    /// Acquisition [s].
    pub duration_s: f64,
    /// Shortest transition from the present attitude [s], if one was found.
    pub transition_s: Option<f64>,
    /// Other strips that wait for the satellite at the same time.
    pub conflicts: u32,
}

/// Chances.
#[derive(Serialize, ToSchema)]
pub struct Opportunities {
    /// `FeatureCollection`.
    #[serde(rename = "type")]
    pub kind: String,
    pub features: Vec<Opportunity>,
    pub links: Vec<Link>,
}

/// An order.
#[derive(Serialize, ToSchema)]
pub struct Order {
    /// `Feature`.
    #[serde(rename = "type")]
    pub kind: String,
    /// `Order`.
    pub stapi_type: String,
    pub stapi_version: String,
    pub id: String,
    #[schema(value_type = Object)]
    pub geometry: Value,
    pub bbox: Vec<f64>,
    pub properties: OrderProperties,
    pub links: Vec<Link>,
}

/// What is known of an order.
#[derive(Serialize, ToSchema)]
pub struct OrderProperties {
    pub product_id: String,
    pub created: String,
    pub status: Status,
    pub search_parameters: SearchParameters,
    /// None: no opportunity is promised to an order.
    #[schema(value_type = Object)]
    pub opportunity_properties: Value,
    pub order_parameters: OrderParameters,
    /// Numbers of its strips, as the console and `swath strips` know them.
    pub strips: Vec<u64>,
}

/// What was looked for.
#[derive(Serialize, ToSchema)]
pub struct SearchParameters {
    pub datetime: String,
    #[schema(value_type = Object)]
    pub geometry: Value,
}

/// How an order stands.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
pub struct Status {
    pub timestamp: String,
    pub status_code: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason_code: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason_text: Option<String>,
    #[schema(value_type = Vec<Object>)]
    pub links: Vec<Value>,
}

/// How an order stood, and stands.
#[derive(Serialize, ToSchema)]
pub struct Statuses {
    pub statuses: Vec<Status>,
    pub links: Vec<Link>,
}

/// Orders.
#[derive(Serialize, ToSchema)]
pub struct Orders {
    /// `FeatureCollection`.
    #[serde(rename = "type")]
    pub kind: String,
    pub features: Vec<Order>,
    #[serde(rename = "numberMatched")]
    pub number_matched: usize,
    pub links: Vec<Link>,
}
