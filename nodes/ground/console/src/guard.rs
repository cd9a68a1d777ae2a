//! Who may ask: pages of this server and programs, on this machine or with a token; no page of another server.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};
use std::time::{Instant, SystemTime};

use axum::http::header::{AUTHORIZATION, CONTENT_TYPE, COOKIE, HOST, HeaderName, ORIGIN};
use axum::http::{HeaderMap, Method, StatusCode};

use crate::problem::Problem;
use crate::tokens::{Role, Tokens, now_ns};

/// Names of this machine that a browser does not look up elsewhere.
const LOOPBACK: [&str; 3] = ["localhost", "127.0.0.1", "[::1]"];
/// Commands of one caller: so many at once, and so many a second in the long run.
const BURST: f64 = 500.0;
const RATE: f64 = 100.0;
/// The cookie in which a browser keeps its token.
pub const COOKIE_NAME: &str = "swath_token";

/// Who asks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Caller {
    /// Name of the token; none on this machine.
    pub name: Option<String>,
    /// What they may do.
    pub role: Role,
}

impl Caller {
    /// Who acts, as the trail tells it: the door they came by, and who they are.
    #[must_use]
    pub fn actor(&self, door: &str) -> String {
        self.name.as_ref().map_or_else(|| door.to_owned(), |name| format!("{door}:{name}"))
    }
}

/// What is looked at in every request.
pub struct Guard {
    /// `http` or `https`.
    scheme: &'static str,
    /// Names and addresses under which the server is known.
    hosts: Vec<String>,
    port: u16,
    tokens: Option<TokenFile>,
    /// What is left of each caller's commands, and since when.
    budgets: Mutex<BTreeMap<String, (f64, Instant)>>,
}

/// Tokens, read again when their file has changed: what is revoked ends at once.
struct TokenFile {
    path: PathBuf,
    read: Mutex<(Option<SystemTime>, Tokens)>,
}

impl TokenFile {
    fn caller(&self, secret: &str) -> Option<Caller> {
        let changed = std::fs::metadata(&self.path).and_then(|it| it.modified()).ok();
        let mut read = self.read.lock().unwrap_or_else(PoisonError::into_inner);
        if read.0 != changed || changed.is_none() {
            // A file that cannot be read lets nobody in.
            let tokens = Tokens::read(&self.path).unwrap_or_else(|error| {
                tracing::error!("nobody is let in: {error:#}");
                Tokens::default()
            });
            *read = (changed, tokens);
        }
        let token = read.1.of(secret, now_ns())?;
        Some(Caller { name: Some(token.name.clone()), role: token.role })
    }
}

impl Guard {
    /// For a server that only this machine reaches.
    #[must_use]
    pub fn of_this_machine(port: u16) -> Self {
        let hosts = LOOPBACK.map(str::to_owned).to_vec();
        Self { scheme: "http", hosts, port, tokens: None, budgets: Mutex::default() }
    }

    /// For a server with TLS under names of its own, which wants tokens.
    #[must_use]
    pub fn of_the_network(names: &[String], port: u16, tokens: PathBuf) -> Self {
        let tokens = TokenFile { path: tokens, read: Mutex::default() };
        let hosts = names.iter().map(|name| name.to_ascii_lowercase()).collect();
        Self { scheme: "https", hosts, port, tokens: Some(tokens), budgets: Mutex::default() }
    }

    /// Where the server is, as a caller knows it.
    #[must_use]
    pub fn base(&self, headers: &HeaderMap) -> String {
        format!("{}://{}", self.scheme, text(headers, &HOST).unwrap_or_default())
    }

    /// Whether the cookie of a token may only go over TLS.
    #[must_use]
    pub fn secure(&self) -> bool {
        self.scheme == "https"
    }

    /// Looks whether a request comes from where it may.
    ///
    /// A name in `Host` that is not the server's own may be another server's that was made to point here (DNS
    /// rebinding). A command's `Origin` is its page's server; programs send none. JSON cannot be sent by another
    /// server's page without a question first, which nobody answers here.
    ///
    /// # Errors
    /// With what is wrong.
    pub fn check(&self, method: &Method, headers: &HeaderMap) -> Result<(), Problem> {
        let host = text(headers, &HOST).unwrap_or_default();
        let usual = if self.secure() { "443" } else { "80" };
        let (name, given) = host.rsplit_once(':').filter(|(_, port)| !port.ends_with(']')).unwrap_or((host, usual));
        if !self.hosts.contains(&name.to_ascii_lowercase()) || given.parse() != Ok(self.port) {
            let expected = self.hosts.iter().map(|name| format!("{name}:{}", self.port)).collect::<Vec<_>>().join(", ");
            let detail = format!("host {host:?} is not this server, expected {expected}");
            return Err(Problem::new(StatusCode::MISDIRECTED_REQUEST, detail));
        }
        if method == Method::GET || method == Method::HEAD {
            return Ok(());
        }
        if headers.contains_key(ORIGIN) && text(headers, &ORIGIN) != Some(self.base(headers).as_str()) {
            let detail = "commands come from this server's own page or from programs";
            return Err(Problem::new(StatusCode::FORBIDDEN, detail));
        }
        Ok(())
    }

    /// Who asks.
    ///
    /// # Errors
    /// When they have no token that is valid, and need one.
    pub fn caller(&self, headers: &HeaderMap) -> Result<Caller, Problem> {
        let Some(tokens) = &self.tokens else { return Ok(Caller { name: None, role: Role::Operator }) };
        let bearer = text(headers, &AUTHORIZATION).and_then(|it| it.strip_prefix("Bearer "));
        let cookies = headers.get_all(COOKIE).iter().filter_map(|value| value.to_str().ok());
        let mut pairs = cookies.flat_map(|it| it.split(';')).filter_map(|pair| pair.trim().split_once('='));
        let secret = bearer.or_else(|| pairs.find(|(name, _)| *name == COOKIE_NAME).map(|(_, value)| value));
        let refused = |detail: &str| Problem::new(StatusCode::UNAUTHORIZED, detail);
        let secret = secret.ok_or_else(|| refused("a token is needed: `Authorization: Bearer TOKEN`"))?;
        tokens.caller(secret.trim()).ok_or_else(|| refused("this token is unknown, revoked or has ended"))
    }

    /// Lets a caller ask for what takes a role, and not too often.
    ///
    /// # Errors
    /// When they have less, or ask too much.
    pub fn admit(&self, caller: &Caller, needs: Role) -> Result<(), Problem> {
        if caller.role < needs {
            let name = caller.name.as_deref().unwrap_or_default();
            return Err(Problem::new(StatusCode::FORBIDDEN, format!("{name} may look, not command")));
        }
        let mut budgets = self.budgets.lock().unwrap_or_else(PoisonError::into_inner);
        let now = Instant::now();
        let (left, since) = budgets.entry(caller.actor("")).or_insert((BURST, now));
        *left = BURST.min(*left + RATE * now.duration_since(*since).as_secs_f64()) - 1.0;
        *since = now;
        if *left < 0.0 {
            *left += 1.0;
            let detail = format!("more than {BURST} commands at once, or {RATE} a second");
            return Err(Problem::new(StatusCode::TOO_MANY_REQUESTS, detail));
        }
        Ok(())
    }
}

/// Looks whether a body is of a type.
///
/// # Errors
/// When it is of another one.
pub fn media_type(headers: &HeaderMap, expected: &[&str]) -> Result<(), Problem> {
    let given = text(headers, &CONTENT_TYPE).unwrap_or_default();
    let bare = given.split(';').next().unwrap_or_default().trim();
    if expected.iter().any(|it| bare.eq_ignore_ascii_case(it)) {
        return Ok(());
    }
    let detail = format!("content type is {given:?}, expected {}", expected.join(" or "));
    Err(Problem::new(StatusCode::UNSUPPORTED_MEDIA_TYPE, detail))
}

fn text<'a>(headers: &'a HeaderMap, name: &HeaderName) -> Option<&'a str> {
    headers.get(name).and_then(|value| value.to_str().ok())
}

#[cfg(test)]
mod tests {
    use axum::http::header::HeaderValue;

    use super::*;

    fn headers(of: &[(HeaderName, &str)]) -> HeaderMap {
        of.iter().map(|(name, value)| (name.clone(), HeaderValue::from_str(value).unwrap())).collect()
    }

    fn asked(guard: &Guard, method: &Method, of: &[(HeaderName, &str)]) -> Option<u16> {
        guard.check(method, &headers(of)).err().map(|problem| problem.status.as_u16())
    }

    #[test]
    fn only_this_machine_s_names_are_answered() {
        let guard = Guard::of_this_machine(8080);
        for host in ["localhost:8080", "127.0.0.1:8080", "[::1]:8080"] {
            assert_eq!(asked(&guard, &Method::GET, &[(HOST, host)]), None, "{host}");
        }
        for host in ["evil.example:8080", "localhost:81", "localhost", "localhost.evil.example:8080", ""] {
            assert_eq!(asked(&guard, &Method::GET, &[(HOST, host)]), Some(421), "{host}");
        }
        assert_eq!(asked(&guard, &Method::GET, &[]), Some(421));
    }

    #[test]
    fn commands_of_other_pages_are_refused() {
        let guard = Guard::of_this_machine(8080);
        let (host, json) = ((HOST, "localhost:8080"), (CONTENT_TYPE, "application/json"));
        let post = |more: &[(HeaderName, &str)]| {
            let wrong = guard.check(&Method::POST, &headers(more));
            wrong.and_then(|()| media_type(&headers(more), &["application/json"])).err().map(|it| it.status.as_u16())
        };
        assert_eq!(post(&[host.clone(), json.clone()]), None);
        assert_eq!(post(&[host.clone(), json.clone(), (ORIGIN, "http://localhost:8080")]), None);
        for origin in ["http://evil.example", "http://localhost:9090", "https://localhost:8080", "null"] {
            assert_eq!(post(&[host.clone(), json.clone(), (ORIGIN, origin)]), Some(403), "{origin}");
        }
        assert_eq!(post(&[host.clone(), (CONTENT_TYPE, "text/plain")]), Some(415));
        assert_eq!(post(&[host]), Some(415));
    }

    #[test]
    fn tokens_let_in_whom_they_name_for_what_they_may_do() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("tokens.toml");
        let mut tokens = Tokens::default();
        let operator = tokens.add("alice", Role::Operator, u64::MAX / 2).unwrap();
        let viewer = tokens.add("bob", Role::Viewer, u64::MAX / 2).unwrap();
        let ended = tokens.add("carol", Role::Operator, 1_000_000_000).unwrap();
        tokens.write(&path).unwrap();
        let guard = Guard::of_the_network(&["Swath.example".to_owned()], 443, path.clone());
        assert_eq!(asked(&guard, &Method::GET, &[(HOST, "swath.example")]), None);
        assert_eq!(asked(&guard, &Method::GET, &[(HOST, "localhost")]), Some(421));
        let let_in = |headers: &HeaderMap| {
            let caller = guard.caller(headers).map_err(|problem| problem.status.as_u16())?;
            guard.admit(&caller, Role::Operator).map_err(|problem| problem.status.as_u16())?;
            Ok(caller.actor("console"))
        };
        let bearer = |secret: &str| headers(&[(AUTHORIZATION, &format!("Bearer {secret}"))]);
        assert_eq!(let_in(&bearer(&operator)), Ok("console:alice".to_owned()));
        assert_eq!(
            let_in(&headers(&[(COOKIE, &format!("a=b; {COOKIE_NAME}={operator}"))])),
            Ok("console:alice".to_owned())
        );
        assert_eq!(let_in(&bearer(&viewer)), Err(403));
        assert_eq!(let_in(&bearer(&ended)), Err(401));
        assert_eq!(let_in(&bearer("guess")), Err(401));
        assert_eq!(let_in(&HeaderMap::new()), Err(401));
        tokens.revoke("alice").unwrap();
        // Two writes within the clock of the file system would look like one.
        std::fs::remove_file(&path).unwrap();
        assert_eq!(let_in(&bearer(&operator)), Err(401), "without its file there are no tokens");
    }

    #[test]
    fn a_flood_of_commands_is_held_back() {
        let guard = Guard::of_this_machine(8080);
        let caller = guard.caller(&HeaderMap::new()).unwrap();
        let refused = (0..1000).filter(|_| guard.admit(&caller, Role::Viewer).is_err()).count();
        assert!((300..=500).contains(&refused), "{refused}");
    }
}
