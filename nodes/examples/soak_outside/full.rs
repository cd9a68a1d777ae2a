//! A disk that is really full, under the store, the bag and all else that a mission writes, and has room again.

use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::time::Duration;

use anyhow::{Result, ensure};
use serde_json::{Value, json};

use crate::flight::Flight;
use crate::{Mission, command, sortie};

/// How long the disk is full.
const FULL: Duration = Duration::from_secs(15);
/// How long an alarm may take.
const SOON: Duration = Duration::from_secs(20);

/// A small file system is filled while the mission flies there, and has room again after a while.
pub fn fills(mission: &Mission) -> Result<Value> {
    let file = mission.file("full", 0.9, 100.0, "")?;
    let disk = mission.out("disk");
    fs::create_dir(&disk)?;
    command("mount", &["-t", "tmpfs", "-o", "size=64m", "tmpfs", &disk.display().to_string()])?;
    let out = disk.join("out");
    let environment = sortie::here()?;
    let flight = Flight::launch(&file, &out, environment.domain, &[])?;
    let (told, acknowledged) = sortie::fly(flight, &out, &environment, || fill(&disk, &out))?;
    let (raised, returned) = told;
    let nominal = sortie::nominal(&file, &mission.out("nominal"))?;
    let reward = sortie::reward(&out)?;
    command("umount", &[&disk.display().to_string()])?;
    Ok(json!({ "full_acknowledged": acknowledged, "full_raised_s": raised, "full_returned_s": returned,
        "full_reward": [reward], "full_reward_nominal": [nominal] }))
}

/// Fills the disk and makes room again; how long each alarm took to come, and to return [s].
fn fill(disk: &Path, out: &Path) -> Result<([f64; 2], [f64; 2])> {
    std::thread::sleep(Duration::from_secs(4));
    let ballast = disk.join("ballast");
    let mut file = fs::File::create(&ballast)?;
    while file.write_all(&[1; 4096]).is_ok() {}
    let raised = |name: &str| (sortie::events(out, name).len() % 2 == 1).then_some(());
    let (_, store) = sortie::until("alarm of the store", SOON, || raised("store full"))?;
    let (_, bag) = sortie::until("alarm of the bag", SOON, || raised("bag full"))?;
    std::thread::sleep(FULL);
    ensure!(raised("store full").is_some() && raised("bag full").is_some(), "there is no room, and no alarm");
    drop(file);
    fs::remove_file(&ballast)?;
    let gone = |name: &str| raised(name).is_none().then_some(());
    let (_, store_back) = sortie::until("end of the store's alarm", SOON, || gone("store full"))?;
    let (_, bag_back) = sortie::until("end of the bag's alarm", SOON, || gone("bag full"))?;
    Ok(([store, bag], [store_back, bag_back]))
}
