//! Who is let in by whom: every path for every kind of caller, TLS, and callers who mean no good.

use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::path::Path;
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use rustls::pki_types::{CertificateDer, ServerName};
use rustls::{ClientConfig, ClientConnection, RootCertStore, StreamOwned};
use swath_console::{Guard, Role, Tokens, description, listen, serve, tls};

use super::server::{ask, recorded, replay};

/// A server behind TLS for `localhost`, the tokens of a viewer, an operator and one that has ended.
struct Doors {
    address: SocketAddr,
    client: Arc<ClientConfig>,
    viewer: String,
    operator: String,
    ended: String,
}

fn doors() -> &'static Doors {
    static DOORS: OnceLock<Doors> = OnceLock::new();
    DOORS.get_or_init(|| {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("doors");
        std::fs::create_dir_all(&folder).unwrap();
        let of = |name: &str| folder.join(name);
        let made = rcgen::generate_simple_self_signed(["localhost".to_owned()]).unwrap();
        std::fs::write(of("cert.pem"), made.cert.pem()).unwrap();
        std::fs::write(of("key.pem"), made.signing_key.serialize_pem()).unwrap();
        let mut tokens = Tokens::default();
        let [viewer, operator, ended] =
            [("eve", Role::Viewer, u64::MAX / 2), ("ada", Role::Operator, u64::MAX / 2), ("old", Role::Operator, 1)]
                .map(|(name, role, end)| tokens.add(name, role, end).unwrap());
        tokens.write(&of("tokens.toml")).unwrap();

        let config = tls(&of("cert.pem"), &of("key.pem")).unwrap();
        let listener = listen("127.0.0.1:0".parse().unwrap(), true).unwrap();
        let address = listener.local_addr().unwrap();
        let guard = Guard::of_the_network(&["localhost".to_owned()], address.port(), of("tokens.toml"));
        let site = recorded(guard);
        std::thread::spawn(move || serve(listener, Some(config), site));

        let mut roots = RootCertStore::empty();
        roots.add(CertificateDer::from(made.cert.der().to_vec())).unwrap();
        let provider = Arc::new(rustls::crypto::ring::default_provider());
        let client = ClientConfig::builder_with_provider(provider).with_safe_default_protocol_versions().unwrap();
        let client = Arc::new(client.with_root_certificates(roots).with_no_client_auth());
        Doors { address, client, viewer, operator, ended }
    })
}

impl Doors {
    fn connect(&self) -> StreamOwned<ClientConnection, TcpStream> {
        let stream = TcpStream::connect(self.address).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        let name = ServerName::try_from("localhost").unwrap();
        StreamOwned::new(ClientConnection::new(Arc::clone(&self.client), name).unwrap(), stream)
    }

    /// Status, head and what has come of the body when the head was there.
    fn ask(&self, method: &str, path: &str, token: Option<&str>, more: &str, body: &str) -> (u16, String) {
        let mut stream = self.connect();
        let (port, length) = (self.address.port(), body.len());
        let token = token.map_or_else(String::new, |it| format!("Authorization: Bearer {it}\r\n"));
        let request = format!(
            "{method} {path} HTTP/1.1\r\nHost: localhost:{port}\r\nConnection: close\r\n{token}{more}\
             Content-Length: {length}\r\n\r\n{body}"
        );
        stream.write_all(request.as_bytes()).unwrap();
        let mut answer = Vec::new();
        let mut piece = [0; 4096];
        while !answer.windows(4).any(|it| it == b"\r\n\r\n") {
            let count = stream.read(&mut piece).unwrap();
            assert!(count > 0, "no answer to {method} {path}");
            answer.extend_from_slice(&piece[..count]);
        }
        let head = String::from_utf8_lossy(&answer).into_owned();
        (head.split(' ').nth(1).unwrap().parse().unwrap(), head)
    }
}

const JSON: &str = "Content-Type: application/json\r\n";

#[test]
fn every_path_asks_who_comes() {
    let doors = doors();
    let described = serde_json::to_value(description()).unwrap();
    let mut asked = 0;
    for (path, methods) in described["paths"].as_object().unwrap() {
        if path == "/api/login" {
            continue;
        }
        let name = path.split(['{', '}']).enumerate().map(|(i, part)| if i % 2 == 1 { "1" } else { part });
        let concrete: String = name.collect();
        for method in methods.as_object().unwrap().keys().map(|it| it.to_uppercase()) {
            if !["GET", "POST", "PUT", "PATCH", "DELETE"].contains(&method.as_str()) {
                continue;
            }
            let status = |token: Option<&str>| doors.ask(&method, &concrete, token, JSON, "{}").0;
            for stranger in [None, Some("guess"), Some(doors.ended.as_str())] {
                assert_eq!(status(stranger), 401, "{method} {path} of {stranger:?}");
            }
            let asks = path == "/api/strips/preview" || path.ends_with("/opportunities");
            let viewer = status(Some(&doors.viewer));
            if method == "GET" || asks {
                assert!(![401, 403].contains(&viewer), "{method} {path} of a viewer: {viewer}");
            } else {
                assert_eq!(viewer, 403, "{method} {path} of a viewer");
            }
            let operator = status(Some(&doors.operator));
            assert!(![401, 403, 500].contains(&operator), "{method} {path} of an operator: {operator}");
            asked += 1;
        }
    }
    assert!(asked > 25, "{asked}");
}

#[test]
fn a_browser_hands_in_its_token_and_gets_a_cookie_that_no_page_reads() {
    let doors = doors();
    let login = |token: &str, more: &str| {
        doors.ask("POST", "/api/login", None, &format!("{JSON}{more}"), &format!("{{\"token\": \"{token}\"}}"))
    };
    assert_eq!(login("guess", "").0, 401);
    assert_eq!(login(&doors.ended, "").0, 401);
    assert_eq!(login("\\u0007", "").0, 401, "no header holds it");
    assert_eq!(login(&doors.viewer, "Origin: https://evil.example\r\n").0, 403);
    let (status, head) = login(&doors.viewer, "");
    assert_eq!(status, 200);
    let cookie = head.lines().find_map(|line| line.strip_prefix("set-cookie: ")).unwrap();
    for part in ["HttpOnly", "SameSite=Strict", "Secure", "Path=/"] {
        assert!(cookie.contains(part), "{cookie}");
    }
    let pair = cookie.split(';').next().unwrap();
    assert_eq!(doors.ask("GET", "/api/info", None, &format!("Cookie: {pair}\r\n"), "").0, 200);
    // Another server's page has the browser's cookie with it, and is refused by its origin.
    let foreign = format!("Cookie: {pair}\r\nOrigin: https://evil.example\r\n{JSON}");
    assert_eq!(doors.ask("POST", "/api/strips/preview", None, &foreign, "{}").0, 403);
}

#[test]
fn a_token_that_is_revoked_ends_the_stream_that_it_opened() {
    let doors = doors();
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("doors/tokens.toml");
    let mut tokens = Tokens::read(&path).unwrap();
    let secret = tokens.add("leaver", Role::Viewer, u64::MAX / 2).unwrap();
    tokens.write(&path).unwrap();
    let mut stream = doors.connect();
    let head = format!("Host: localhost:{}\r\nAuthorization: Bearer {secret}\r\n\r\n", doors.address.port());
    stream.write_all(format!("GET /api/facts HTTP/1.1\r\n{head}").as_bytes()).unwrap();
    let mut first = [0; 12];
    stream.read_exact(&mut first).unwrap();
    assert_eq!(&first, b"HTTP/1.1 200");
    let mut tokens = Tokens::read(&path).unwrap();
    tokens.revoke("leaver").unwrap();
    tokens.write(&path).unwrap();
    let begin = Instant::now();
    let mut piece = [0; 65536];
    // Signs of life come before the read gives up: an end is what the server makes.
    while stream.read(&mut piece).is_ok_and(|count| count > 0) {
        assert!(begin.elapsed() < Duration::from_secs(15), "it is still told of the mission");
    }
    assert_eq!(doors.ask("GET", "/api/info", Some(&secret), "", "").0, 401);
}

#[test]
fn who_speaks_without_tls_is_not_answered() {
    let mut stream = TcpStream::connect(doors().address).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    stream.write_all(b"GET /api/info HTTP/1.1\r\nHost: localhost\r\n\r\n").unwrap();
    let mut answer = Vec::new();
    // An alert of TLS, or an end: nothing in the clear.
    let _ = stream.read_to_end(&mut answer);
    assert!(!answer.starts_with(b"HTTP"), "{}", String::from_utf8_lossy(&answer));
    assert_eq!(doors().ask("GET", "/api/info", Some(&doors().viewer), "", "").0, 200);
}

#[test]
fn bodies_that_are_too_long_or_no_json_change_nothing() {
    let status = |path: &str, body: &str| ask("POST", path, JSON, body).0;
    for path in ["/api/strips", "/api/strips/cancel", "/api/planner/mode", "/api/alarms/acknowledge", "/api/login"] {
        for body in ["", "{", "[]", "null", "{\"ids\": [-1]}", "{\"nobody\": 1}", &"[".repeat(10_000), "\u{0}"] {
            assert_eq!(status(path, body), 400, "{path} {body:.20}");
        }
    }
    // 200 MB are announced; nobody waits for them.
    let begin = Instant::now();
    let mut stream = TcpStream::connect(replay()).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    let host = replay();
    let head =
        format!("POST /api/strips HTTP/1.1\r\nHost: {host}\r\n{JSON}Content-Length: 200000000\r\n\r\n{{\"name\": \"");
    stream.write_all(head.as_bytes()).unwrap();
    let piece = [b'x'; 65536];
    let mut sent = 0_usize;
    while sent < 200_000_000 && stream.write_all(&piece).is_ok() {
        sent += piece.len();
    }
    let mut answer = vec![0; 4096];
    let read = stream.read(&mut answer).unwrap_or(0);
    let answer = String::from_utf8_lossy(&answer[..read]).into_owned();
    // The answer may be lost with the connection that is closed on what was still under way.
    assert!(answer.is_empty() || answer.starts_with("HTTP/1.1 413"), "{answer}");
    assert!(sent < 100_000_000, "{sent} bytes were taken");
    assert!(begin.elapsed() < Duration::from_secs(20));
    assert_eq!(ask("GET", "/api/info", "", "").0, 200);
}

#[test]
fn who_never_ends_a_request_is_sent_away_and_others_are_answered() {
    // As many as a process may have open, and more than are taken at a time.
    let mut lazy = Vec::new();
    for _ in 0..600 {
        let Ok(mut stream) = TcpStream::connect(replay()) else { break };
        stream.write_all(b"GET /api/info HTTP/1.1\r\nHost: 127").unwrap();
        lazy.push(stream);
    }
    assert!(lazy.len() > 300, "{}", lazy.len());
    assert_eq!(ask("GET", "/api/info", "", "").0, 200, "while {} wait", lazy.len());
    // Each is closed by the server in the end.
    for mut stream in lazy {
        stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
        let mut rest = Vec::new();
        stream.read_to_end(&mut rest).unwrap();
    }
}
