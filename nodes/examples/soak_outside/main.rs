//! What befalls a mission from the outside: messages that are lost, a network that parts, a disk that is full, a clock
//! that is moved. `cargo xtask soak outside`, or `soak_outside FIRST COUNT`; a seed is one of these (drops in the
//! endpoints, losses in the network, partition, disk, clock), then the same again in another mission.
//!
//! All but the drops happen in a network and a file system of its own, which needs Linux, root, `unshare`, `ip`, `nft`
//! (Debian: nftables) and libfaketime. Whatever happens, the mission ends by itself, what was acknowledged is kept, no
//! strip is imaged twice, and the bag is valid.
#![allow(missing_docs, clippy::print_stdout, reason = "a program for people")]

mod clock;
#[path = "../common/mod.rs"]
#[allow(dead_code, reason = "others use more of it")]
mod common;
mod full;
mod network;

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail, ensure};
use serde_json::{Value, json};

use crate::common::soak;

/// Each of them in three missions.
const SEEDS: u64 = 15;
/// Says that this process is in a network and a file system of its own.
const INSIDE: &str = "--inside";

fn main() -> Result<()> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    match &args[..] {
        [inside, seed] if inside == INSIDE => {
            command("ip", &["link", "set", "lo", "up", "multicast", "on"])?;
            let found = found(seed.parse()?)?;
            println!("{found}");
            Ok(())
        }
        [operator, rest @ ..] if operator == network::OPERATOR => network::operate(rest),
        _ => soak::run(SEEDS, |seeds| {
            let mut all = json!({ "failed": [] });
            for seed in seeds {
                match in_own_surroundings(seed) {
                    Ok(found) => add(&mut all, found),
                    Err(error) => {
                        eprintln!("seed {seed}: {error:#}");
                        add(&mut all, json!({ "failed": [seed] }));
                    }
                }
            }
            Ok(all)
        }),
    }
}

/// This program again, in a network and a file system of its own.
fn in_own_surroundings(seed: u64) -> Result<Value> {
    let mut own = Command::new("unshare");
    own.args(["--net", "--mount"]).arg(std::env::current_exe()?).args([INSIDE, &seed.to_string()]);
    let said = own.output().context("cannot run unshare")?;
    let errors = String::from_utf8_lossy(&said.stderr);
    ensure!(said.status.success(), "{}", errors.trim());
    serde_json::from_slice(&said.stdout).with_context(|| format!("it told nothing: {errors}"))
}

/// Adds what was found: lists are joined, numbers added.
fn add(all: &mut Value, found: Value) {
    let Value::Object(found) = found else { return };
    for (key, value) in found {
        match (&mut all[&key], value) {
            (Value::Array(list), Value::Array(more)) => list.extend(more),
            (Value::Number(sum), Value::Number(more)) => {
                all[&key] = (sum.as_f64().unwrap_or(0.0) + more.as_f64().unwrap_or(0.0)).into();
            }
            (before, value) => *before = value,
        }
    }
}

fn found(seed: u64) -> Result<Value> {
    let folder = tempfile::tempdir()?;
    let mission = Mission { folder: folder.path().to_owned(), seed: seed / 5 };
    match seed % 5 {
        0 => network::drops(&mission),
        1 => network::loses(&mission),
        2 => network::parts(&mission),
        3 => full::fills(&mission),
        _ => clock::moves(&mission),
    }
}

/// A mission to be flown.
struct Mission {
    folder: PathBuf,
    seed: u64,
}

impl Mission {
    /// Its file, with a name.
    fn file(&self, name: &str, orbits: f64, pace: f64, more: &str) -> Result<PathBuf> {
        let path = self.folder.join(format!("{name}.toml"));
        let head = format!("orbits = {orbits:?}\nseed = {}\npace = {pace:?}\nplanner = \"lookahead\"\n", self.seed);
        std::fs::write(&path, format!("{head}[requests.random]\ncount = [1500, 1500]\n{more}"))?;
        Ok(path)
    }

    /// Where it goes, by a name.
    fn out(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }
}

/// Runs a command that must do well; what it said.
fn command(program: &str, words: &[&str]) -> Result<String> {
    let said = Command::new(program).args(words).output();
    let said = said.with_context(|| format!("cannot run {program} (Debian: packages nftables, iproute2, mount)"))?;
    if !said.status.success() {
        bail!("{program} {}: {}", words.join(" "), String::from_utf8_lossy(&said.stderr).trim());
    }
    Ok(String::from_utf8_lossy(&said.stdout).into_owned())
}

/// What two missions have earned, as figures with a name.
fn rewards(name: &str, reward: f64, nominal: f64) -> Value {
    json!({ format!("{name}_reward"): [reward], format!("{name}_reward_nominal"): [nominal] })
}

/// Whether a path can be read; else what is missing.
fn needs(path: &str, what: &str) -> Result<()> {
    ensure!(Path::new(path).exists(), "{path} is missing: {what}");
    Ok(())
}
