//! STAPI 0.1.0: programs order images, and hear of their orders.

mod filter;
mod groups;
mod links;
mod models;
mod opportunities;
mod orders;
mod status;

use std::sync::Arc;

use axum::extract::State;
use axum::http::HeaderMap;
use serde_json::{Value, json};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use self::links::{Links, known, owned};
use self::models::{
    CONFORMANCE, Conformance, GEOJSON, JSON, Landing, Link, PRODUCT, PRODUCT_CONFORMANCE, Product, Products, Provider,
    VERSION,
};
use crate::extract::{Json, Named};
use crate::problem::Problem;
use crate::server::{Home, Server};

/// Its routes, from its landing page.
pub fn routes() -> OpenApiRouter<Arc<Server>> {
    OpenApiRouter::new()
        .routes(routes!(landing))
        .routes(routes!(conformance))
        .routes(routes!(products))
        .routes(routes!(product))
        .routes(routes!(product_conformance))
        .routes(routes!(queryables))
        .routes(routes!(order_parameters))
        .merge(opportunities::routes())
        .merge(orders::routes())
}

/// The landing page.
#[utoipa::path(get, path = "/", tag = "stapi", responses((status = 200, description = "as asked", body = Landing), Problem))]
async fn landing(State(server): Home, headers: HeaderMap) -> Json<Landing> {
    let links = Links::of(&server, &headers);
    Json(Landing {
        id: "swath".to_owned(),
        conforms_to: owned(&CONFORMANCE),
        title: server.site.title.clone(),
        description: "Images of ground strips by a super-agile satellite. Times are simulated UTC of the mission. \
                      Beyond the specification: orders of several strips, `DELETE` of an order (link `cancel`)."
            .to_owned(),
        links: vec![
            Link::new("self", links.to(""), JSON),
            Link::new("conformance", links.to("/conformance"), JSON),
            Link::new("products", links.to("/products"), JSON),
            Link::new("orders", links.to("/orders"), GEOJSON),
            Link::new("service-desc", links.0.replace("/stapi", "/api/openapi.json"), JSON),
        ],
    })
}

/// What the API conforms to.
#[utoipa::path(get, path = "/conformance", tag = "stapi", responses((status = 200, description = "as asked", body = Conformance), Problem))]
async fn conformance() -> Json<Conformance> {
    Json(Conformance { conforms_to: owned(&CONFORMANCE) })
}

fn strip_product(links: &Links) -> Product {
    Product {
        kind: "Collection".to_owned(),
        stapi_type: "Product".to_owned(),
        stapi_version: VERSION.to_owned(),
        conforms_to: owned(&PRODUCT_CONFORMANCE),
        id: PRODUCT.to_owned(),
        title: "Strips".to_owned(),
        description: "An image along a line, or of an area by parallel strips".to_owned(),
        keywords: owned(&["strip", "agile", "pushbroom"]),
        license: "proprietary".to_owned(),
        providers: vec![Provider {
            name: "Swath".to_owned(),
            roles: owned(&["producer", "host"]),
            url: links.0.replace("/stapi", "/"),
        }],
        links: vec![
            Link::new("self", links.product(""), JSON),
            Link::new("conformance", links.product("/conformance"), JSON),
            Link::new("queryables", links.product("/queryables"), JSON),
            Link::new("order-parameters", links.product("/order-parameters"), JSON),
            Link::post("opportunities", links.product("/opportunities"), GEOJSON, None),
            Link::post("create-order", links.product("/orders"), GEOJSON, None),
        ],
    }
}

/// What can be ordered.
#[utoipa::path(get, path = "/products", tag = "stapi", responses((status = 200, description = "as asked", body = Products), Problem))]
async fn products(State(server): Home, headers: HeaderMap) -> Json<Products> {
    let links = Links::of(&server, &headers);
    let all = vec![Link::new("self", links.to("/products"), JSON)];
    Json(Products { kind: "ProductCollection".to_owned(), products: vec![strip_product(&links)], links: all })
}

/// The product.
#[utoipa::path(get, path = "/products/{product}", tag = "stapi", params(("product" = String, Path, example = "strip")),
    responses((status = 200, description = "as asked", body = Product), Problem))]
async fn product(State(server): Home, headers: HeaderMap, Named(id): Named<String>) -> Result<Json<Product>, Problem> {
    known(&id)?;
    Ok(Json(strip_product(&Links::of(&server, &headers))))
}

/// What the product conforms to.
#[utoipa::path(get, path = "/products/{product}/conformance", tag = "stapi",
    params(("product" = String, Path, example = "strip")), responses((status = 200, description = "as asked", body = Conformance), Problem))]
async fn product_conformance(Named(id): Named<String>) -> Result<Json<Conformance>, Problem> {
    known(&id)?;
    Ok(Json(Conformance { conforms_to: owned(&PRODUCT_CONFORMANCE) }))
}

/// What opportunities can be filtered by, as JSON Schema.
#[utoipa::path(get, path = "/products/{product}/queryables", tag = "stapi",
    params(("product" = String, Path, example = "strip")), responses((status = 200, description = "as asked", body = Value), Problem))]
async fn queryables(Named(id): Named<String>) -> Result<Json<Value>, Problem> {
    known(&id)?;
    let number = |description: &str| json!({ "type": "number", "description": description });
    Ok(Json(json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Queryables",
        "type": "object",
        "properties": {
            "min_elevation_deg": number("least elevation while imaging [deg]"),
            "duration_s": number("acquisition [s]"),
            "transition_s": number("shortest transition from the present attitude [s]"),
            "conflicts": number("other strips that wait for the satellite at the same time"),
        },
        "additionalProperties": false,
    })))
}

/// How an order may be flown, as JSON Schema.
#[utoipa::path(get, path = "/products/{product}/order-parameters", tag = "stapi",
    params(("product" = String, Path, example = "strip")), responses((status = 200, description = "as asked", body = Value), Problem))]
async fn order_parameters(Named(id): Named<String>) -> Result<Json<Value>, Problem> {
    known(&id)?;
    Ok(Json(json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Order parameters",
        "type": "object",
        "properties": {
            "name": { "type": "string", "description": "name for people" },
            "client_ref": { "type": "string", "description": "own reference: the same one again is the same order" },
            "priority": { "type": "number", "minimum": 0, "maximum": 1, "default": 0.5 },
            "acquisition_speed_m_s": { "type": "number", "default": 3000 },
            "bidirectional": { "type": "boolean", "default": false },
            "hold_for_approval": { "type": "boolean", "default": false },
            "max_attempts": { "type": "integer", "minimum": 0, "description": "0 for the mission's own" },
        },
        "additionalProperties": false,
    })))
}
