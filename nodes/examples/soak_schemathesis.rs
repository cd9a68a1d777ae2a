//! The console's API against its description, many more cases than the test has: `cargo xtask soak schemathesis`, or
//! `soak_schemathesis FIRST COUNT` for some seeds; prints one JSON object, and fails where anything contradicts.
#![allow(clippy::print_stdout, missing_docs, reason = "a measuring tool")]

#[path = "common/mod.rs"]
#[allow(dead_code, reason = "others use more of it")]
mod common;

use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use anyhow::{Result, bail, ensure};
use serde_json::{Value, json};

use crate::common::flight::{Flight, python};
use crate::common::soak;

const DOMAIN: u16 = 148;
const MISSION: &str = "planner = \"lookahead\"\norbits = 400.0\npace = 40.0\n[requests.random]\ncount = [80, 80]\n";
/// Cases of each operation in each phase.
const CASES: &str = "300";

fn main() -> Result<()> {
    soak::run(5, measure)
}

fn measure(seeds: std::ops::Range<u64>) -> Result<Value> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python/described.py");
    let (mut cases, mut contradictions) = (0, 0);
    for seed in seeds {
        let folder = tempfile::tempdir()?;
        let mission = folder.path().join("mission.toml");
        std::fs::write(&mission, MISSION)?;
        let address = TcpListener::bind("127.0.0.1:0")?.local_addr()?.to_string();
        let _flight =
            Flight::launch(&mission, &folder.path().join("out"), DOMAIN, &["--no-bag", "--console", &address])?;
        let deadline = Instant::now() + Duration::from_secs(60);
        while TcpStream::connect(&address).is_err() {
            ensure!(Instant::now() < deadline, "no console");
            std::thread::sleep(Duration::from_millis(100));
        }
        let mut look = Command::new(python()?);
        look.arg(&script).arg(format!("http://{address}")).arg(folder.path()).args([CASES, &seed.to_string()]);
        let output = look.output()?;
        if !output.status.success() {
            bail!("{}", String::from_utf8_lossy(&output.stderr));
        }
        let saw: Value = serde_json::from_slice(&output.stdout)?;
        let wrong = ["failures", "errors"].iter().filter_map(|key| saw[key].as_array().map(Vec::len)).sum::<usize>();
        if wrong > 0 {
            eprintln!("seed {seed}: {saw:#}\n{}", String::from_utf8_lossy(&output.stderr));
        }
        contradictions += wrong;
        cases += saw["cases"].as_u64().unwrap_or(0);
    }
    ensure!(contradictions == 0, "{contradictions} contradictions");
    Ok(json!({ "cases": cases, "contradictions": contradictions }))
}
