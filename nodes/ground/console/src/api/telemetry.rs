//! What was told last of the radio, of the ground's plan and of resources.

use std::sync::Arc;

use axum::extract::State;
use serde::Serialize;
use utoipa::ToSchema;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::extract::Json;
use crate::problem::Problem;
use crate::server::{Home, Server};
use crate::telemetry::{Link, Plan, Resources};

pub(super) fn routes() -> OpenApiRouter<Arc<Server>> {
    OpenApiRouter::new().routes(routes!(link)).routes(routes!(plan)).routes(routes!(resources))
}

/// How the radio stood when it was told of last.
#[derive(Serialize, ToSchema)]
struct LinkNow {
    /// When [ms].
    t: f64,
    link: Link,
}

/// The newest plan of the ground.
#[derive(Serialize, ToSchema)]
struct PlanNow {
    /// When it was made [ms].
    t: f64,
    plan: Plan,
}

/// How power, data and momentum stood last.
#[derive(Serialize, ToSchema)]
struct ResourcesNow {
    /// When [ms].
    t: f64,
    resources: Resources,
}

/// The radio, as the ground knows it.
#[utoipa::path(get, path = "/api/link", tag = "console",
    responses((status = 200, description = "as asked", body = LinkNow), Problem))]
async fn link(State(server): Home) -> Result<Json<LinkNow>, Problem> {
    let newest = server.site.shared.read(|ledger| ledger.newest().link.clone());
    let (t, link) = newest.ok_or_else(|| Problem::unknown("nothing has been told of a radio"))?;
    Ok(Json(LinkNow { t, link }))
}

/// What the satellite is going to do, as the ground predicts it.
#[utoipa::path(get, path = "/api/plan", tag = "console",
    responses((status = 200, description = "as asked", body = PlanNow), Problem))]
async fn plan(State(server): Home) -> Result<Json<PlanNow>, Problem> {
    let newest = server.site.shared.read(|ledger| ledger.newest().plan.clone());
    let (t, plan) = newest.ok_or_else(|| Problem::unknown("nothing has been predicted"))?;
    Ok(Json(PlanNow { t, plan }))
}

/// Power, data and momentum as the simulator has them.
#[utoipa::path(get, path = "/api/resources", tag = "console",
    responses((status = 200, description = "as asked", body = ResourcesNow), Problem))]
async fn resources(State(server): Home) -> Result<Json<ResourcesNow>, Problem> {
    let newest = server.site.shared.read(|ledger| ledger.newest().resources.clone());
    let (t, resources) = newest.ok_or_else(|| Problem::unknown("nothing has been told of resources"))?;
    Ok(Json(ResourcesNow { t, resources }))
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    #[test]
    fn what_is_told_of_radio_and_resources_is_described() {
        let described = serde_json::to_value(crate::description()).unwrap();
        for (path, answer, of, field) in [
            ("/api/link", "LinkNow", "RadioLink", "passes"),
            ("/api/plan", "PlanNow", "PredictedPlan", "tasks"),
            ("/api/resources", "ResourcesNow", "Resources", "battery"),
        ] {
            let answers = &described["paths"][path]["get"]["responses"];
            let body = &answers["200"]["content"]["application/json"]["schema"]["$ref"];
            assert_eq!(body, &Value::from(format!("#/components/schemas/{answer}")), "{path}");
            assert!(described["components"]["schemas"][of]["properties"][field].is_object(), "{of}");
        }
    }
}
