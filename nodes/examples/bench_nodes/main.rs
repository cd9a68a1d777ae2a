//! Measures missions over DDS in lockstep and the request manager at scale, and prints one JSON object; `cargo xtask bench`
//! merges it with those of the other crates.
#![allow(clippy::print_stdout, missing_docs, reason = "a measuring tool")]

mod requests;

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use swath_mission::outcome::Summary;

/// Each figure is the median of this many missions.
const RUNS: usize = 5;
/// How long a process may take to load its libraries.
const LOADING: Duration = Duration::from_secs(4);
/// Two orbits: long enough that starting up does not count.
const MISSION: &str = "orbits = 2.0\nplanner = \"lookahead\"\n[requests.random]\ncount = [3000, 3000]\n";

fn main() -> Result<()> {
    let swath = swath()?;
    let folder = tempfile::tempdir()?;
    let mission = folder.path().join("mission.toml");
    std::fs::write(&mission, MISSION)?;
    let libtorch = libtorch_kb(&swath)?;
    let mut factors = Vec::new();
    let mut memory = Vec::new();
    let mut own = Vec::new();
    for run in 0..RUNS {
        let (summary, kilobytes, linked) = fly(&swath, &mission, &folder.path().join(run.to_string()))?;
        factors.push(summary.real_time_factor);
        memory.push(kilobytes as f64 / 1e3);
        own.push(kilobytes.saturating_sub(linked * libtorch) as f64 / 1e3);
    }
    let mut figures = requests::measure(&swath)?;
    figures["lockstep_real_time_factor"] = median(factors).into();
    figures["suite_memory_with_libtorch_MB"] = median(memory).into();
    figures["suite_memory_MB"] = median(own).into();
    println!("{figures}");
    Ok(())
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// The launcher that was built with this example.
fn swath() -> Result<PathBuf> {
    let exe = std::env::current_exe()?;
    let release = exe.parent().and_then(Path::parent).context("this example lies in no target folder")?;
    let swath = release.join("swath");
    ensure!(swath.is_file(), "{} is missing: cargo build --release -p swath-nodes", swath.display());
    Ok(swath)
}

/// Flies a mission with its recorder; also the largest memory of all its processes together [kB], and how many of these
/// have libtorch loaded.
fn fly(swath: &Path, mission: &Path, out: &Path) -> Result<(Summary, u64, u64)> {
    let mut launch = Command::new(swath)
        .arg("launch")
        .arg(mission)
        .arg("--out")
        .arg(out)
        .env("ROS_LOCALHOST_ONLY", "1")
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()?;
    let mut largest = (0, 0);
    let status = loop {
        if let Some(status) = launch.try_wait()? {
            break status;
        }
        let processes = family(launch.id());
        let memory = processes.iter().copied().map(anonymous_kb).sum();
        let linked = processes.iter().filter(|&&pid| libtorch_of(pid).is_some()).count() as u64;
        largest = largest.max((memory, linked));
        std::thread::sleep(Duration::from_millis(250));
    };
    ensure!(status.success(), "the mission ended with {status}");
    let text = std::fs::read_to_string(out.join("summary.json"))?;
    Ok((serde_json::from_str(&text)?, largest.0, largest.1))
}

/// A process and its children.
fn family(pid: u32) -> Vec<u32> {
    let children = std::fs::read_to_string(format!("/proc/{pid}/task/{pid}/children")).unwrap_or_default();
    let children = children.split_whitespace().filter_map(|child| child.parse().ok());
    std::iter::once(pid).chain(children).collect()
}

/// The file of libtorch that a process has loaded.
fn libtorch_of(pid: u32) -> Option<String> {
    let maps = std::fs::read_to_string(format!("/proc/{pid}/maps")).ok()?;
    let line = maps.lines().find(|line| line.ends_with("/libtorch_cpu.so"))?;
    Some(line[line.find('/')?..].to_owned())
}

/// What loading libtorch alone takes in a process that does nothing [kB]; `swath` says which libtorch.
fn libtorch_kb(swath: &Path) -> Result<u64> {
    let mut idle =
        Command::new(swath).args(["planner", "status"]).stdout(Stdio::null()).stderr(Stdio::null()).spawn()?;
    std::thread::sleep(LOADING);
    let library = libtorch_of(idle.id());
    idle.kill()?;
    idle.wait()?;
    let library = library.context("swath has no libtorch loaded")?;
    let mut sleeper = Command::new("sleep").arg("60").env("LD_PRELOAD", &library).spawn()?;
    std::thread::sleep(LOADING);
    let memory = anonymous_kb(sleeper.id());
    sleeper.kill()?;
    sleeper.wait()?;
    Ok(memory)
}

/// Memory of a process, without files that are mapped [kB].
fn anonymous_kb(pid: u32) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
    let field = |line: &str| line.strip_prefix("RssAnon:")?.trim().strip_suffix("kB")?.trim().parse().ok();
    status.lines().find_map(field).unwrap_or(0)
}
