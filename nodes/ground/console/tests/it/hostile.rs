//! Callers who mean no good: thousands of open requests, bodies without end, paths that lead elsewhere, garbage.

use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::thread;
use std::time::{Duration, Instant};

use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use swath_console::{Guard, listen, serve};

use super::server::recorded;

/// A server of a test's own.
fn server() -> SocketAddr {
    let listener = listen("127.0.0.1:0".parse().unwrap(), false).unwrap();
    let address = listener.local_addr().unwrap();
    let site = recorded(Guard::of_this_machine(address.port()));
    thread::spawn(move || serve(listener, None, site));
    address
}

/// Sends what is given and reads until the server ends or is silent for a while.
fn say(address: SocketAddr, words: &[u8]) -> Vec<u8> {
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    // The server may have closed before everything was said.
    let _ = stream.write_all(words);
    let mut answer = Vec::new();
    let mut piece = [0; 65536];
    while let Ok(count @ 1..) = stream.read(&mut piece) {
        answer.extend_from_slice(&piece[..count]);
    }
    answer
}

fn status(answer: &[u8]) -> u16 {
    let head = String::from_utf8_lossy(&answer[..answer.len().min(200)]).into_owned();
    head.split(' ').nth(1).and_then(|it| it.parse().ok()).unwrap_or(0)
}

fn ask(address: SocketAddr, line: &str) -> u16 {
    status(&say(address, format!("{line} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n").as_bytes()))
}

/// As many files as this process may have open, after it has asked for more.
fn files() -> u64 {
    let limit = getrlimit(Resource::Nofile);
    let raised = Rlimit { current: limit.maximum, ..limit };
    // What is not granted is not needed: there are fewer callers then.
    let _ = setrlimit(Resource::Nofile, raised);
    getrlimit(Resource::Nofile).current.unwrap_or(20_000)
}

#[test]
fn ten_thousand_open_requests_keep_nobody_out() {
    let address = server();
    let count = 10_000.min(usize::try_from(files()).unwrap().saturating_sub(700));
    assert!(count >= 300, "{count}");
    let host = format!("Host: {address}\r\n");
    let habits = [
        // Nothing at all; half a head; a head without its body; a stream that nobody reads.
        String::new(),
        "GET /api/info HTTP/1.1\r\nHo".to_owned(),
        format!("POST /api/strips HTTP/1.1\r\n{host}Content-Type: application/json\r\nContent-Length: 99\r\n\r\n{{"),
        format!("GET /api/facts HTTP/1.1\r\n{host}\r\n"),
    ];
    let mut open = Vec::with_capacity(count);
    let (mut slowest, mut asked) = (Duration::ZERO, 0);
    for habit in habits.iter().cycle().take(count) {
        let mut stream = TcpStream::connect(address).unwrap();
        // Who waited longest has been sent away by then.
        let _ = stream.write_all(habit.as_bytes());
        open.push(stream);
        if open.len() % 1000 == 0 || open.len() == count {
            let begin = Instant::now();
            assert_eq!(ask(address, "GET /api/info"), 200, "while {} are open", open.len());
            (slowest, asked) = (slowest.max(begin.elapsed()), asked + 1);
        }
    }
    assert!(asked > 0 && slowest < Duration::from_secs(10), "an answer took {slowest:?}");
    // The facts are told to so many at a time; whoever comes then is told where else they are.
    assert_eq!(ask(address, "GET /api/facts"), 503);
    drop(open);
    let begin = Instant::now();
    loop {
        let mut stream = TcpStream::connect(address).unwrap();
        stream.write_all(format!("GET /api/facts HTTP/1.1\r\n{host}\r\n").as_bytes()).unwrap();
        let mut head = [0; 12];
        stream.read_exact(&mut head).unwrap();
        match status(&head) {
            200 => break,
            told => assert_eq!(told, 503),
        }
        assert!(begin.elapsed() < Duration::from_secs(60), "readers that are gone are not noticed");
        thread::sleep(Duration::from_millis(200));
    }
}

#[test]
fn a_body_without_an_announced_end_is_refused_at_its_limit() {
    let address = server();
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    let head = "Content-Type: application/json\r\nTransfer-Encoding: chunked\r\n\r\n";
    stream.write_all(format!("POST /api/strips HTTP/1.1\r\nHost: {address}\r\n{head}").as_bytes()).unwrap();
    let begin = "{\"name\": \"big\", \"geojson\": {\"type\": \"FeatureCollection\", \"features\": [";
    stream.write_all(format!("{:x}\r\n{begin}\r\n", begin.len()).as_bytes()).unwrap();
    let feature = r#"{"type":"Feature","properties":{},"geometry":{"type":"LineString","coordinates":[[1,2],[1,3]]}},"#;
    let piece = feature.repeat(1000);
    let piece = format!("{:x}\r\n{piece}\r\n", piece.len());
    let mut sent = 0;
    while sent < 200_000_000 && stream.write_all(piece.as_bytes()).is_ok() {
        sent += piece.len();
    }
    assert!(sent < 100_000_000, "{sent} bytes were taken");
    let mut answer = [0; 12];
    // The answer may be lost with the connection that is closed on what was still under way.
    if stream.read_exact(&mut answer).is_ok() {
        assert_eq!(status(&answer), 413);
    }
    assert_eq!(ask(address, "GET /api/info"), 200);
}

#[test]
fn no_path_leads_out_of_the_server() {
    let address = server();
    let absolute = format!("http://{address}/../Cargo.toml");
    for path in [
        "/../Cargo.toml",
        "/../../../../../../etc/passwd",
        "/%2e%2e/%2e%2e/etc/passwd",
        "/..%2f..%2f..%2fetc%2fpasswd",
        "/..%5c..%5cetc%5cpasswd",
        "/..\\..\\etc\\passwd",
        "//etc/passwd",
        "/console.js/../../Cargo.toml",
        "/console.js%00.html",
        "/./console.js",
        "/api/strips/../../etc/passwd",
        "/features/collections/..%2f..%2fetc%2fpasswd/items",
        "/features/collections/strips/items/..%2f1",
        "/stapi/products/..%2f..%2fetc%2fpasswd",
        "/stapi/orders/..",
        "etc/passwd",
        "*",
        absolute.as_str(),
    ] {
        let answer =
            say(address, format!("GET {path} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n").as_bytes());
        assert!([400, 404, 409].contains(&status(&answer)), "{path}: {}", String::from_utf8_lossy(&answer));
    }
}

#[test]
fn garbage_is_refused_and_ends_nothing() {
    let address = server();
    let sound = format!(
        "POST /api/strips/preview?x=1 HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\
         Content-Type: application/json\r\nContent-Length: 30\r\n\r\n{{\"name\": \"x\", \"geojson\": null}}"
    );
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut next = |below: usize| {
        // Xorshift: the same garbage each time.
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        usize::try_from(state % u64::try_from(below).unwrap()).unwrap()
    };
    for _ in 0..300 {
        let mut words = sound.clone().into_bytes();
        for _ in 0..=next(6) {
            let at = next(words.len());
            match next(3) {
                0 => words[at] = u8::try_from(next(256)).unwrap(),
                1 => drop(words.drain(at..(at + next(20)).min(words.len()))),
                _ => words.insert(at, u8::try_from(next(256)).unwrap()),
            }
        }
        // Whoever says less than announced is waited for: that is looked at elsewhere.
        let mut stream = TcpStream::connect(address).unwrap();
        let _ = stream.write_all(&words);
        let _ = stream.shutdown(std::net::Shutdown::Write);
        stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        assert!(answer.is_empty() || status(&answer) >= 400, "{}", String::from_utf8_lossy(&words));
    }
    assert_eq!(ask(address, "GET /api/info"), 200);
}
