//! Who may ask: pages of this server, and programs on this machine; no page of another one.

use hyper::header::{CONTENT_TYPE, HOST, HeaderName, ORIGIN};
use hyper::{HeaderMap, Method, StatusCode};

use crate::problem::Problem;

/// Names of this machine that a browser does not look up elsewhere.
const LOOPBACK: [&str; 3] = ["localhost", "127.0.0.1", "[::1]"];

/// Looks whether a request comes from where it may.
///
/// A name in `Host` that is not the machine's own may be another server's that was made to point here (DNS rebinding).
/// A command's `Origin` is its page's server; programs send none. JSON cannot be sent by another server's page without
/// a question first, which nobody answers here.
///
/// # Errors
/// With what is wrong.
pub fn check(method: &Method, headers: &HeaderMap, port: u16) -> Result<(), Problem> {
    let host = text(headers, &HOST).unwrap_or_default();
    let (name, given) = host.rsplit_once(':').filter(|(_, port)| !port.ends_with(']')).unwrap_or((host, "80"));
    if !LOOPBACK.contains(&name) || given.parse() != Ok(port) {
        let detail = format!("host {host:?} is not this server, expected 127.0.0.1:{port} or localhost:{port}");
        return Err(Problem::new(StatusCode::MISDIRECTED_REQUEST, detail));
    }
    if method == Method::GET || method == Method::HEAD {
        return Ok(());
    }
    if headers.contains_key(ORIGIN) && text(headers, &ORIGIN) != Some(format!("http://{host}").as_str()) {
        return Err(Problem::new(StatusCode::FORBIDDEN, "commands come from this server's own page or from programs"));
    }
    let media_type = text(headers, &CONTENT_TYPE).unwrap_or_default();
    if media_type.split(';').next().map(str::trim) != Some("application/json") {
        let detail = format!("content type is {media_type:?}, expected application/json");
        return Err(Problem::new(StatusCode::UNSUPPORTED_MEDIA_TYPE, detail));
    }
    Ok(())
}

fn text<'a>(headers: &'a HeaderMap, name: &HeaderName) -> Option<&'a str> {
    headers.get(name).and_then(|value| value.to_str().ok())
}

#[cfg(test)]
mod tests {
    use hyper::header::HeaderValue;

    use super::*;

    fn asked(method: Method, headers: &[(HeaderName, &'static str)]) -> Option<u16> {
        let headers = headers.iter().map(|(name, value)| (name.clone(), HeaderValue::from_static(value))).collect();
        check(&method, &headers, 8080).err().map(|problem| problem.status.as_u16())
    }

    #[test]
    fn only_this_machine_s_names_are_answered() {
        for host in ["localhost:8080", "127.0.0.1:8080", "[::1]:8080"] {
            assert_eq!(asked(Method::GET, &[(HOST, host)]), None, "{host}");
        }
        for host in ["evil.example:8080", "localhost:81", "localhost", "localhost.evil.example:8080", ""] {
            assert_eq!(asked(Method::GET, &[(HOST, host)]), Some(421), "{host}");
        }
        assert_eq!(asked(Method::GET, &[]), Some(421));
    }

    #[test]
    fn commands_of_other_pages_are_refused() {
        let (host, json) = ((HOST, "localhost:8080"), (CONTENT_TYPE, "application/json"));
        let post = |more: &[(HeaderName, &'static str)]| asked(Method::POST, more);
        assert_eq!(post(&[host.clone(), json.clone()]), None);
        assert_eq!(post(&[host.clone(), json.clone(), (ORIGIN, "http://localhost:8080")]), None);
        for origin in ["http://evil.example", "http://localhost:9090", "https://localhost:8080", "null"] {
            assert_eq!(post(&[host.clone(), json.clone(), (ORIGIN, origin)]), Some(403), "{origin}");
        }
        assert_eq!(post(&[host.clone(), (CONTENT_TYPE, "text/plain")]), Some(415));
        assert_eq!(post(&[host]), Some(415));
    }
}
