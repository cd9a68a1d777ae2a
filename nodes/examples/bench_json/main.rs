//! Measures missions over DDS in lockstep and the request manager at scale, and prints one JSON object; `cargo xtask bench` merges it with those of the
//! other crates.
#![allow(clippy::print_stdout, missing_docs, reason = "a measuring tool")]

mod requests;

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, ensure};
use swath_nodes::record::Summary;

/// Each figure is the median of this many missions.
const RUNS: usize = 5;
/// Two orbits: long enough that starting up does not count.
const MISSION: &str = "orbits = 2.0\n[requests.random]\ncount = [3000, 3000]\n";

fn main() -> Result<()> {
    let swath = swath()?;
    let folder = tempfile::tempdir()?;
    let mission = folder.path().join("mission.toml");
    std::fs::write(&mission, MISSION)?;
    let mut factors = Vec::new();
    let mut memory = Vec::new();
    for run in 0..RUNS {
        let (summary, kilobytes) = fly(&swath, &mission, &folder.path().join(run.to_string()))?;
        factors.push(summary.real_time_factor);
        memory.push(kilobytes as f64 / 1e3);
    }
    let mut figures = requests::measure(&swath)?;
    figures["lockstep_real_time_factor"] = median(factors).into();
    figures["suite_memory_MB"] = median(memory).into();
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

/// Flies a mission with its recorder; also the largest memory of all its processes together [kB].
fn fly(swath: &Path, mission: &Path, out: &Path) -> Result<(Summary, u64)> {
    let mut launch = Command::new(swath)
        .arg("launch")
        .arg(mission)
        .arg("--out")
        .arg(out)
        .env("ROS_LOCALHOST_ONLY", "1")
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()?;
    let mut largest = 0;
    let status = loop {
        if let Some(status) = launch.try_wait()? {
            break status;
        }
        largest = largest.max(memory_kb(launch.id()));
        std::thread::sleep(std::time::Duration::from_millis(250));
    };
    ensure!(status.success(), "the mission ended with {status}");
    let text = std::fs::read_to_string(out.join("summary.json"))?;
    Ok((serde_json::from_str(&text)?, largest))
}

/// Proportional memory of a process and its children, without files that are mapped [kB].
fn memory_kb(pid: u32) -> u64 {
    let children = std::fs::read_to_string(format!("/proc/{pid}/task/{pid}/children")).unwrap_or_default();
    let children = children.split_whitespace().filter_map(|child| child.parse().ok());
    std::iter::once(pid).chain(children).map(anonymous_kb).sum()
}

fn anonymous_kb(pid: u32) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
    let field = |line: &str| line.strip_prefix("RssAnon:")?.trim().strip_suffix("kB")?.trim().parse().ok();
    status.lines().find_map(field).unwrap_or(0)
}
