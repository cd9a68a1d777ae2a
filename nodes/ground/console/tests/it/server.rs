//! The HTTP side of a replay: what it answers, and what it refuses.

use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::path::Path;
use std::sync::OnceLock;
use std::time::Duration;

use serde_json::Value;
use swath_console::{ASSETS, Guard, Shared, Site, listen, read_bag, serve};

/// The sample mission behind a guard.
pub fn recorded(guard: Guard) -> Site {
    let bag = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../bags/samples/mission");
    let shared = Shared::default();
    let recording = shared.update(|ledger| read_bag(&bag, "/swath", ledger)).unwrap();
    let (title, elevation_min_deg) = (recording.title, recording.elevation_min_deg);
    Site { shared, counter: None, title, elevation_min_deg, guard }
}

/// The sample mission, served for all tests of this binary.
pub fn replay() -> SocketAddr {
    static ADDRESS: OnceLock<SocketAddr> = OnceLock::new();
    *ADDRESS.get_or_init(|| {
        let listener = listen("127.0.0.1:0".parse().unwrap(), false).unwrap();
        let address = listener.local_addr().unwrap();
        let site = recorded(Guard::of_this_machine(address.port()));
        std::thread::spawn(move || serve(listener, None, site));
        address
    })
}

/// Every fact, page by page.
pub fn log() -> Vec<Value> {
    let mut facts: Vec<Value> = Vec::new();
    loop {
        let (status, _, body) = ask("GET", &format!("/api/log?after={}", facts.len()), "", "");
        assert_eq!(status, 200);
        let page: Vec<Value> = serde_json::from_str(&body).unwrap();
        if page.is_empty() {
            break;
        }
        facts.extend(page);
    }
    facts
}

/// Status and everything after the head; reading ends after a second of silence.
fn exchange(request: &str) -> (u16, String, String) {
    let mut stream = TcpStream::connect(replay()).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(2))).unwrap();
    stream.write_all(request.as_bytes()).unwrap();
    let mut answer = Vec::new();
    let mut piece = [0; 65536];
    while let Ok(count) = stream.read(&mut piece) {
        if count == 0 {
            break;
        }
        answer.extend_from_slice(&piece[..count]);
    }
    let answer = String::from_utf8(answer).unwrap();
    let (head, body) = answer.split_once("\r\n\r\n").unwrap_or((&answer, ""));
    let status = head.split(' ').nth(1).and_then(|status| status.parse().ok()).unwrap_or(0);
    (status, head.to_lowercase(), body.to_owned())
}

pub fn ask(method: &str, path: &str, more: &str, body: &str) -> (u16, String, String) {
    let host = replay();
    let length = body.len();
    exchange(&format!(
        "{method} {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n{more}Content-Length: {length}\r\n\r\n{body}"
    ))
}

#[test]
fn the_page_comes_from_here_alone() {
    for asset in &ASSETS {
        let (status, head, body) = ask("GET", asset.path, "", "");
        assert_eq!((status, body.as_bytes()), (200, asset.bytes), "{}", asset.path);
        assert!(head.contains("content-security-policy: default-src 'self'"), "{head}");
        assert!(head.contains("x-content-type-options: nosniff"), "{head}");
    }
}

#[test]
fn the_log_tells_the_sample_mission() {
    let facts = log();
    for (number, fact) in (1..).zip(&facts) {
        assert_eq!(fact["n"], number, "{fact}");
    }
    let count = |kind: &str| facts.iter().filter(|fact| fact["kind"] == kind).count();
    // What `swath-bag info` counts in the bag; of each task one result.
    assert_eq!((count("task"), count("result"), count("offer"), count("choice")), (17, 17, 17, 17));
    assert_eq!((count("point"), count("status"), count("wheels"), count("summary")), (172, 172, 172, 68));
    let clock = facts.iter().rfind(|fact| fact["kind"] == "clock").unwrap();
    assert_eq!((clock["epoch_ms"].as_f64(), clock["tick_ms"].as_f64()), (Some(1_767_225_600_000.0), Some(500.0)));
}

#[test]
fn what_the_mission_does_not_have_is_not_told() {
    for (path, what) in [("/api/link", "radio"), ("/api/plan", "predicted"), ("/api/resources", "resources")] {
        let (status, head, body) = ask("GET", path, "", "");
        assert_eq!(status, 404, "{path}");
        assert!(head.contains("application/problem+json") && body.contains(what), "{head}\n{body}");
    }
    let kinds = ["link", "plan", "resources"];
    assert!(!log().iter().any(|fact| kinds.contains(&fact["kind"].as_str().unwrap())));
}

#[test]
fn a_reader_goes_on_where_it_was() {
    let begins = |body: &str| body.split("data: [{\"n\":").nth(1).and_then(|rest| rest.split(',').next()?.parse().ok());
    let (status, head, body) = ask("GET", "/api/facts", "", "");
    assert_eq!(status, 200);
    assert!(head.contains("text/event-stream"));
    assert!(body.contains("event: restart"));
    assert_eq!(begins(&body), Some(1));
    let id = body.split("\nid: ").nth(1).and_then(|rest| rest.split('\n').next()).unwrap().to_owned();
    let read: u64 = id.rsplit_once('.').unwrap().1.parse().unwrap();
    let (_, _, body) = ask("GET", "/api/facts", &format!("Last-Event-ID: {id}\r\n"), "");
    assert!(!body.contains("event: restart"));
    // None is left if the first event told them all.
    assert!(begins(&body).is_none_or(|first| first == read + 1), "{read}");
    let (_, _, body) = ask("GET", "/api/facts", "Last-Event-ID: 1.7\r\n", "");
    assert!(body.contains("event: restart"));
}

#[test]
fn what_is_not_in_order_is_refused() {
    let json = "Content-Type: application/json\r\n";
    let status = |method: &str, path: &str, more: &str, body: &str| ask(method, path, more, body).0;
    assert_eq!(status("GET", "/nothing", "", ""), 404);
    assert_eq!(status("GET", "/../Cargo.toml", "", ""), 404);
    assert_eq!(status("GET", "/api/log?after=-1", "", ""), 400);
    assert_eq!(status("DELETE", "/api/strips", json, ""), 405);
    assert_eq!(status("POST", "/api/strips", "", "{}"), 415);
    assert_eq!(status("POST", "/api/nothing", json, "{}"), 404);
    assert_eq!(status("POST", "/api/strips", &format!("{json}Origin: http://evil.example\r\n"), "{}"), 403);
    // A recording takes no commands, and no address of another machine is served.
    let (code, head, body) = ask("POST", "/api/strips/cancel", json, "{\"ids\":[1]}");
    assert_eq!(code, 409);
    assert!(head.contains("application/problem+json") && body.contains("recording"), "{head}\n{body}");
    let (code, ..) = exchange("GET / HTTP/1.1\r\nHost: evil.example\r\nConnection: close\r\n\r\n");
    assert_eq!(code, 421);
    let error = listen("0.0.0.0:0".parse().unwrap(), false).unwrap_err().to_string();
    assert!(error.contains("other machines"), "{error}");
}
