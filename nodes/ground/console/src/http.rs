//! The server: connections with limits, routes, and what every answer says about itself.

use std::convert::Infallible;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use anyhow::{Context, Result, ensure};
use http_body_util::combinators::BoxBody;
use http_body_util::{BodyExt as _, Full, Limited};
use hyper::body::{Body, Bytes};
use hyper::header::{HeaderName, HeaderValue};
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper::{Method, Request, Response, StatusCode};
use hyper_util::rt::{TokioIo, TokioTimer};
use serde::Serialize;
use serde::de::DeserializeOwned;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;

use crate::api;
use crate::assets::ASSETS;
use crate::desks::Counter;
use crate::guard;
use crate::problem::Problem;
use crate::shared::Shared;
use crate::stream;

/// Connections at a time.
const CONNECTIONS: usize = 256;
/// How long a request's head, and its body, may take to arrive.
const HEAD_TIME: Duration = Duration::from_secs(10);
const BODY_TIME: Duration = Duration::from_secs(30);
/// Largest body [B]: about 100 000 strips.
const BODY_MAX: usize = 20_000_000;
/// Facts of one page of the log.
const PAGE: usize = 10_000;

type Answer = Response<BoxBody<Bytes, Infallible>>;

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
}

struct Server {
    site: Site,
    port: u16,
    /// Tells one run of the server from another one.
    run: String,
}

/// Opens the port.
///
/// # Errors
/// When the address is not this machine's own, or cannot be used.
pub fn listen(address: SocketAddr) -> Result<std::net::TcpListener> {
    ensure!(
        address.ip().is_loopback(),
        "{address} can be reached from other machines, and the console asks nobody who they are: \
         listen on 127.0.0.1 and use `ssh -L`"
    );
    let listener = std::net::TcpListener::bind(address).with_context(|| format!("cannot listen on {address}"))?;
    listener.set_nonblocking(true).context("cannot use the port without waiting")?;
    Ok(listener)
}

/// Answers until the process ends.
///
/// # Errors
/// When the runtime cannot start.
pub fn serve(listener: std::net::TcpListener, site: Site) -> Result<()> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().context("no runtime")?;
    runtime.block_on(async move {
        let port = listener.local_addr().context("the port has no address")?.port();
        let listener = TcpListener::from_std(listener).context("cannot listen")?;
        let run = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_millis()).to_string();
        accept(&listener, Arc::new(Server { site, port, run })).await;
        Ok(())
    })
}

async fn accept(listener: &TcpListener, server: Arc<Server>) {
    let places = Arc::new(Semaphore::new(CONNECTIONS));
    loop {
        // The semaphore is never closed.
        let Ok(place) = Arc::clone(&places).acquire_owned().await else { return };
        match listener.accept().await {
            Ok((stream, _)) => {
                let server = Arc::clone(&server);
                tokio::spawn(async move {
                    converse(stream, server).await;
                    drop(place);
                });
            }
            // Out of file descriptors, for one: others may close theirs.
            Err(error) => {
                tracing::warn!("a connection was not taken: {error}");
                tokio::time::sleep(PAUSE).await;
            }
        }
    }
}

/// How long to wait when connections cannot be taken.
const PAUSE: Duration = Duration::from_millis(100);

async fn converse(stream: TcpStream, server: Arc<Server>) {
    let service = service_fn(move |request| {
        let server = Arc::clone(&server);
        async move { Ok::<_, Infallible>(server.answer(request).await) }
    });
    let conversation = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(HEAD_TIME)
        .serve_connection(TokioIo::new(stream), service);
    if let Err(error) = conversation.await {
        tracing::debug!("a connection has ended: {error}");
    }
}

impl Server {
    async fn answer<B>(&self, request: Request<B>) -> Answer
    where
        B: Body + Send,
        B::Data: Send,
        B::Error: Into<Box<dyn std::error::Error + Send + Sync>>,
    {
        let mut answer = match self.route(request).await {
            Ok(answer) => answer,
            Err(problem) => {
                let body = Full::new(Bytes::from(problem.body())).boxed();
                with(problem.status, "application/problem+json", body)
            }
        };
        for (name, value) in HEADERS {
            answer.headers_mut().insert(HeaderName::from_static(name), HeaderValue::from_static(value));
        }
        answer
    }

    async fn route<B>(&self, request: Request<B>) -> Result<Answer, Problem>
    where
        B: Body + Send,
        B::Data: Send,
        B::Error: Into<Box<dyn std::error::Error + Send + Sync>>,
    {
        guard::check(request.method(), request.headers(), self.port)?;
        let path = request.uri().path().to_owned();
        match *request.method() {
            Method::GET => self.told(&path, &request).await,
            Method::POST => self.asked(&path, request).await,
            _ => Err(Problem::new(StatusCode::METHOD_NOT_ALLOWED, "only GET and POST are known")),
        }
    }

    async fn told<B>(&self, path: &str, request: &Request<B>) -> Result<Answer, Problem> {
        if let Some(asset) = ASSETS.iter().find(|asset| asset.path == path) {
            return Ok(with(StatusCode::OK, asset.media_type, Full::new(Bytes::from_static(asset.bytes)).boxed()));
        }
        match path {
            "/api/info" => json(&serde_json::json!({
                "live": self.site.counter.is_some(),
                "title": self.site.title,
                "run": self.run,
                "elevation_min_deg": self.site.elevation_min_deg,
            })),
            "/api/facts" => {
                let last = request.headers().get("last-event-id").and_then(|value| value.to_str().ok());
                let body = stream::body(self.site.shared.clone(), self.run.clone(), stream::place(last, &self.run));
                Ok(with(StatusCode::OK, "text/event-stream", body.boxed()))
            }
            "/api/log" => {
                let after = number(request.uri().query().unwrap_or_default(), "after")?.unwrap_or(0);
                let (_, facts) = self.site.shared.batch(after, PAGE);
                Ok(with(StatusCode::OK, "application/json", Full::new(Bytes::from(facts)).boxed()))
            }
            _ => {
                let id = path.strip_prefix("/api/strips/").and_then(|id| id.parse().ok());
                let id = id.ok_or_else(|| Problem::new(StatusCode::NOT_FOUND, format!("there is no {path}")))?;
                json(&api::report(self.counter()?, id).await?)
            }
        }
    }

    async fn asked<B>(&self, path: &str, request: Request<B>) -> Result<Answer, Problem>
    where
        B: Body + Send,
        B::Data: Send,
        B::Error: Into<Box<dyn std::error::Error + Send + Sync>>,
    {
        const PATHS: [&str; 7] = [
            "/api/strips",
            "/api/strips/preview",
            "/api/strips/cancel",
            "/api/strips/review",
            "/api/planner/mode",
            "/api/planner/review",
            "/api/alarms/acknowledge",
        ];
        if !PATHS.contains(&path) {
            return Err(Problem::new(StatusCode::NOT_FOUND, format!("there is no {path} to post to")));
        }
        let counter = self.counter()?;
        let body = read(request.into_body()).await?;
        match path {
            "/api/strips" => json(&api::submit(counter, parsed(&body)?).await?),
            "/api/strips/preview" => json(&api::preview(counter, parsed(&body)?).await?),
            "/api/strips/cancel" => json(&api::cancel(counter, parsed(&body)?).await?),
            "/api/strips/review" => json(&api::review(counter, parsed(&body)?).await?),
            "/api/planner/mode" => json(&api::set_mode(counter, parsed(&body)?).await?),
            "/api/planner/review" => json(&api::decide(counter, parsed(&body)?).await?),
            _ => json(&self.acknowledge(&parsed(&body)?)),
        }
    }

    fn counter(&self) -> Result<&Counter, Problem> {
        let replay = || Problem::new(StatusCode::CONFLICT, "this is a recording: there is no mission to ask");
        self.site.counter.as_ref().ok_or_else(replay)
    }

    fn acknowledge(&self, alarms: &Alarms) -> serde_json::Value {
        let seen = self.site.shared.update(|ledger| alarms.ids.iter().filter(|id| ledger.acknowledge(**id)).count());
        serde_json::json!({ "acknowledged": seen })
    }
}

/// Alarms that an operator has seen.
#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Alarms {
    ids: Vec<u64>,
}

/// What every answer says: nothing comes from elsewhere, nothing is kept, nobody shows it in a frame.
const HEADERS: [(&str, &str); 4] = [
    ("content-security-policy", "default-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'"),
    ("x-content-type-options", "nosniff"),
    ("referrer-policy", "no-referrer"),
    ("cache-control", "no-store"),
];

fn with(status: StatusCode, media_type: &'static str, body: BoxBody<Bytes, Infallible>) -> Answer {
    let mut answer = Response::new(body);
    *answer.status_mut() = status;
    answer.headers_mut().insert(hyper::header::CONTENT_TYPE, HeaderValue::from_static(media_type));
    answer
}

fn json(value: &impl Serialize) -> Result<Answer, Problem> {
    let text = serde_json::to_string(value)
        .map_err(|error| Problem::new(StatusCode::INTERNAL_SERVER_ERROR, format!("no JSON: {error}")))?;
    Ok(with(StatusCode::OK, "application/json", Full::new(Bytes::from(text)).boxed()))
}

fn parsed<T: DeserializeOwned>(body: &[u8]) -> Result<T, Problem> {
    serde_json::from_slice(body).map_err(|error| Problem::bad(format!("the body is not what is expected: {error}")))
}

async fn read<B>(body: B) -> Result<Bytes, Problem>
where
    B: Body + Send,
    B::Data: Send,
    B::Error: Into<Box<dyn std::error::Error + Send + Sync>>,
{
    let whole = tokio::time::timeout(BODY_TIME, Limited::new(body, BODY_MAX).collect()).await;
    match whole {
        Ok(Ok(collected)) => Ok(collected.to_bytes()),
        Ok(Err(error)) if error.is::<http_body_util::LengthLimitError>() => {
            let detail = format!("the body is longer than {} MB", BODY_MAX / 1_000_000);
            Err(Problem::new(StatusCode::PAYLOAD_TOO_LARGE, detail))
        }
        Ok(Err(error)) => Err(Problem::bad(format!("the body did not arrive: {error}"))),
        Err(_) => {
            let detail = format!("the body did not arrive in {} s", BODY_TIME.as_secs());
            Err(Problem::new(StatusCode::REQUEST_TIMEOUT, detail))
        }
    }
}

fn number(query: &str, key: &str) -> Result<Option<usize>, Problem> {
    let given = query.split('&').filter_map(|pair| pair.split_once('=')).find(|(name, _)| *name == key);
    let Some((_, value)) = given else { return Ok(None) };
    value.parse().map(Some).map_err(|_| Problem::bad(format!("{key} is {value:?}, expected a number from 0")))
}
