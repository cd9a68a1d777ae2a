//! How fast the console is with 5 000 strips and 24 hours: its page in Chromium, and its server at pace 1; prints one
//! JSON object of numbers, an empty one where the tests' Python is missing.
#![allow(clippy::print_stdout, missing_docs, reason = "a measuring tool")]

#[path = "common/mod.rs"]
#[allow(dead_code, reason = "others use more of it")]
mod common;

use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use anyhow::{Result, bail, ensure};
use serde_json::{Map, Value, json};

use crate::common::flight::{Flight, python};
use crate::common::server::Server;

const DOMAIN: u16 = 146;
const MISSION: &str = "planner = \"heuristic:90\"\n[requests.random]\ncount = [5000, 5000]\n";
/// Orbits of a day.
const DAY: &str = "15.2";
/// How long the server of a flying mission is watched.
const WATCHED: Duration = Duration::from_secs(30);

fn main() -> Result<()> {
    let Ok(python) = python() else {
        eprintln!("the console is not measured: `cargo xtask setup --test` makes the Python that drives Chromium");
        println!("{{}}");
        return Ok(());
    };
    let folder = tempfile::tempdir()?;
    let mission = folder.path().join("mission.toml");
    std::fs::write(&mission, MISSION)?;
    let mut figures = Map::new();
    page(&mission, folder.path(), &python, &mut figures)?;
    live(&mission, folder.path(), &mut figures)?;
    println!("{}", Value::Object(figures));
    Ok(())
}

/// The page on a recorded day.
fn page(mission: &Path, folder: &Path, python: &Path, figures: &mut Map<String, Value>) -> Result<()> {
    let out = folder.join("day");
    let (well, ..) = Flight::launch(mission, &out, DOMAIN, &["--orbits", DAY, "--pace", "0"])?.end()?;
    ensure!(well, "the day was not flown");
    let bag = out.join("bag").display().to_string();
    let console = Server::start("console", DOMAIN, &["--bag", &bag])?;
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python/console_speed.py");
    let output = Command::new(python).arg(script).arg(format!("http://{}", console.address)).output()?;
    if !output.status.success() {
        bail!("{}", String::from_utf8_lossy(&output.stderr));
    }
    let saw: Map<String, Value> = serde_json::from_slice(&output.stdout)?;
    figures.extend(saw.into_iter().map(|(key, value)| (format!("console_{key}"), value)));
    Ok(())
}

/// The server of a mission that flies in real time.
fn live(mission: &Path, folder: &Path, figures: &mut Map<String, Value>) -> Result<()> {
    let console = Server::start("console", DOMAIN, &[])?;
    let words = ["--orbits", "1", "--pace", "1", "--no-bag"];
    let mut flight = Flight::launch(mission, &folder.join("live"), DOMAIN, &words)?;
    // What comes once, all requests with their past, is over by then.
    std::thread::sleep(Duration::from_secs(15));
    ensure!(flight.flies()?, "the mission has ended: {}", flight.said());
    let (used, begin) = (console.processor_s()?, Instant::now());
    std::thread::sleep(WATCHED);
    let share = (console.processor_s()? - used) / begin.elapsed().as_secs_f64();
    figures.insert("console_server_core_share".to_owned(), json!(share));
    figures.insert("console_server_MB".to_owned(), json!(console.memory()? / 1e6));
    Ok(())
}
