//! The routes of the page, of its API and of the APIs for programs, and what every answer says about itself.

use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

use axum::Router;
use axum::extract::{Request, State};
use axum::http::header::{CONTENT_TYPE, ETAG, IF_NONE_MATCH};
use axum::http::{HeaderName, HeaderValue, Method, StatusCode, Uri};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use tokio::sync::Semaphore;
use utoipa::openapi::OpenApi as Description;
use utoipa::openapi::path::Operation;
use utoipa::openapi::security::{HttpAuthScheme, HttpBuilder, SecurityScheme};
use utoipa::{Modify, OpenApi};
use utoipa_axum::router::OpenApiRouter;

use crate::api;
use crate::asked::Asked;
use crate::assets::{ASSETS, SOURCES};
use crate::features;
use crate::problem::{Problem, ProblemDetails};
use crate::server::{Home, Server, Site};
use crate::stapi;
use crate::stream;
use crate::tokens::Role;

#[derive(OpenApi)]
#[openapi(
    info(
        title = "Swath console",
        description = "What the ground knows of a mission, and what can be asked of it. Times are simulated UTC.",
    ),
    components(schemas(ProblemDetails)),
    modifiers(&Tokens),
    security((), ("token" = [])),
    tags(
        (name = "console", description = "What the page asks"),
        (name = "stapi", description = "Sensor Tasking API 0.1.0"),
        (name = "features", description = "OGC API Features 1.0"),
    )
)]
struct Whole;

/// How those prove who they are who are asked.
struct Tokens;

impl Modify for Tokens {
    fn modify(&self, description: &mut Description) {
        let bearer = HttpBuilder::new().scheme(HttpAuthScheme::Bearer).description(Some("not asked for on 127.0.0.1"));
        let components = description.components.get_or_insert_default();
        components.add_security_scheme("token", SecurityScheme::Http(bearer.build()));
    }
}

/// What answers, and its description.
fn paths() -> (Router<Arc<Server>>, Description) {
    let router = OpenApiRouter::with_openapi(Whole::openapi())
        .merge(api::routes())
        .nest("/stapi", stapi::routes())
        .nest("/features", features::routes());
    let (router, mut description) = router.split_for_parts();
    for item in description.paths.paths.values_mut() {
        for operation in [&mut item.get, &mut item.post, &mut item.delete].into_iter().flatten() {
            name(operation);
        }
    }
    (router, description)
}

/// Different doors have operations of the same name: each is called by its door, too.
fn name(operation: &mut Operation) {
    let door = operation.tags.iter().flatten().next().cloned().unwrap_or_default();
    operation.operation_id = operation.operation_id.take().map(|id| format!("{door}_{id}"));
}

/// The description of every path.
#[must_use]
pub fn description() -> Description {
    paths().1
}

/// All of it, guarded.
pub fn router(site: Site) -> Router {
    let run = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_millis()).to_string();
    let (router, description) = paths();
    let description = description.to_json().unwrap_or_default();
    let readers = Arc::new(Semaphore::new(stream::READERS));
    let server = Arc::new(Server { site, run, description, asked: Asked::default(), readers });
    router
        .fallback(asset)
        .method_not_allowed_fallback(|method: Method| async move {
            Problem::new(StatusCode::METHOD_NOT_ALLOWED, format!("{method} is not for this path")).into_response()
        })
        .layer(from_fn_with_state(Arc::clone(&server), guarded))
        .with_state(server)
}

/// Files of the page; whatever else nobody answers.
async fn asset(method: Method, uri: Uri, request: Request) -> Result<Response, Problem> {
    let path = uri.path();
    let asset = ASSETS.iter().find(|asset| asset.path == path);
    let asset = asset.ok_or_else(|| Problem::unknown(format!("there is no {path}")))?;
    if method != Method::GET && method != Method::HEAD {
        return Err(Problem::new(StatusCode::METHOD_NOT_ALLOWED, format!("{method} is not for this path")));
    }
    // Its files change together.
    let bundle = format!("\"{}\"", SOURCES.trim());
    if request.headers().get(IF_NONE_MATCH).is_some_and(|known| known == bundle.as_str()) {
        return Ok((StatusCode::NOT_MODIFIED, [(ETAG, bundle)]).into_response());
    }
    Ok(([(CONTENT_TYPE, asset.media_type.to_owned()), (ETAG, bundle)], asset.bytes).into_response())
}

/// What every answer says: nothing comes from elsewhere, nothing is kept without asking, nobody shows it in a frame.
const HEADERS: [(&str, &str); 4] = [
    ("content-security-policy", "default-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'"),
    ("x-content-type-options", "nosniff"),
    ("referrer-policy", "no-referrer"),
    ("cache-control", "no-cache"),
];

/// Paths that do not tell of the mission: the page itself, and the way in.
fn open(path: &str) -> bool {
    ASSETS.iter().any(|asset| asset.path == path) || path == api::LOGIN
}

async fn guarded(State(server): Home, mut request: Request, next: Next) -> Response {
    let guard = &server.site.guard;
    let (method, path) = (request.method().clone(), request.uri().path().to_owned());
    let admitted = guard.check(&method, request.headers()).and_then(|()| {
        if open(&path) {
            return Ok(None);
        }
        let caller = guard.caller(request.headers())?;
        if method != Method::GET && method != Method::HEAD {
            guard.admit(&caller, if api::only_asks(&path) { Role::Viewer } else { Role::Operator })?;
        }
        Ok(Some(caller))
    });
    let mut answer = match admitted {
        Ok(caller) => {
            if let Some(caller) = caller {
                request.extensions_mut().insert(caller);
            }
            next.run(request).await
        }
        Err(problem) => problem.into_response(),
    };
    for (name, value) in HEADERS {
        answer.headers_mut().insert(HeaderName::from_static(name), HeaderValue::from_static(value));
    }
    answer
}
