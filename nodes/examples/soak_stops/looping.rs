//! A node that fails whenever it is started again.

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant, SystemTime};

use anyhow::{Context, Result, ensure};
use serde_json::{Value, json};

use crate::common::flight::{Flight, signal, swath};
use crate::common::{sortie, witness};

/// The programs of a mission.
const PROGRAMS: [&str; 6] =
    ["swath", "swath-spacecraft", "swath-guidance", "swath-planner", "swath-requests", "swath-bag"];
/// The exit code of a panic.
const PANIC: u8 = 101;
/// How long it may take until it is given up.
const LIMIT: Duration = Duration::from_secs(60);

/// Planner or guidance is killed, and panics at once whenever it is started again: safe mode, with a planner that holds,
/// or the end. How long after the last try the alarm came [s], and the launcher's exit code.
pub fn fails_again_and_again(seed: u64) -> Result<Value> {
    let (node, program) =
        if seed.is_multiple_of(2) { ("planner", "swath-planner") } else { ("guidance", "swath-guidance") };
    let folder = tempfile::tempdir_in(swath()?.parent().context("swath lies nowhere")?)?;
    for name in PROGRAMS {
        fs::hard_link(swath()?.with_file_name(name), folder.path().join(name))?;
    }
    let tries = folder.path().join("tries");
    make_it_panic(folder.path(), program, &tries)?;
    let file = folder.path().join("mission.toml");
    let text =
        "orbits = 3.0\nseed = 7\npace = 100.0\nplanner = \"heuristic:90\"\n[requests.random]\ncount = [1500, 1500]\n";
    fs::write(&file, text)?;
    let out = folder.path().join("out");
    let mut launch = Command::new(folder.path().join("swath"));
    launch.env("ROS_DOMAIN_ID", sortie::own_domain().to_string()).env("ROS_LOCALHOST_ONLY", "1");
    let mut flight = Flight::start(launch, &file, &out, &[])?;
    flight.wait_for_tasks(2)?;
    let pid = witness::process(&format!("{program}.real"), &out).with_context(|| format!("there is no {program}"))?;
    signal(pid, "-KILL");
    let killed = Instant::now();
    let critical = || sortie::events(&out, "safe mode").into_iter().find(|line| line["severity"] == "critical");
    sortie::until("safe mode", LIMIT, critical)?;
    let raised = SystemTime::now();
    let last = fs::metadata(&tries)?.modified()?;
    let after = raised.duration_since(last).unwrap_or_default().as_secs_f64();
    let count = fs::read_to_string(&tries)?.lines().count();
    let given_up = killed.elapsed().as_secs_f64();
    if node == "planner" {
        // It holds, until it is asked to end.
        std::thread::sleep(Duration::from_secs(3));
        ensure!(flight.flies()?, "it does not hold");
        signal(flight.pid(), "-INT");
    }
    let code = flight.code()?;
    ensure!(code == Some(4), "exit code {code:?}: {}", flight.said());
    ensure!(after < 1.0, "the alarm came {after} s after the last try");
    Ok(
        json!({ "node": node, "tries": count, "given_up_s": given_up, "alarm_after_last_try_s": after, "exit_code": code }),
    )
}

/// The program notes each start but the first, and panics then.
fn make_it_panic(folder: &Path, program: &str, tries: &Path) -> Result<()> {
    let path = folder.join(program);
    let real = folder.join(format!("{program}.real"));
    fs::rename(&path, &real)?;
    let script = format!(
        "#!/bin/sh\ncase \"$*\" in *\"epoch:=0\"*|*\"mode:=hold\"*) exec {} \"$@\" ;; esac\necho again >> {}\nexit {PANIC}\n",
        real.display(),
        tries.display()
    );
    fs::write(&path, script)?;
    Ok(fs::set_permissions(&path, fs::Permissions::from_mode(0o755))?)
}
