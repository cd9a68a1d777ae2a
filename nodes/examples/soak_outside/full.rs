//! A disk that is really full, under the store, the bag and all else that a mission writes, and has room again.

use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::time::Duration;

use anyhow::{Result, ensure};
use serde_json::{Value, json};
use swath_msgs::swath_msgs as msg;
use swath_ros::{Client, Node, RosArgs, graph};

use crate::common::flight::Flight;
use crate::common::sortie;
use crate::{Mission, command};

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
    let board = Board::start()?;
    let (_, store) = sortie::until("alarm of the store", SOON, || board.stands("store full").then_some(()))?;
    let (_, bag) = sortie::until("alarm of the bag", SOON, || board.stands("bag full").then_some(()))?;
    let tasks = || fs::read_to_string(out.join("tasks.jsonl")).map_or(0, |text| text.lines().count());
    let written = tasks();
    std::thread::sleep(FULL);
    ensure!(board.stands("store full") && board.stands("bag full"), "there is no room, and no alarm");
    drop(file);
    fs::remove_file(&ballast)?;
    let (_, store_back) =
        sortie::until("end of the store's alarm", SOON, || (!board.stands("store full")).then_some(()))?;
    let (_, bag_back) = sortie::until("end of the bag's alarm", SOON, || (!board.stands("bag full")).then_some(()))?;
    sortie::until("tasks that were flown meanwhile", SOON, || (tasks() > written + 3).then_some(()))?;
    Ok(([store, bag], [store_back, bag_back]))
}

/// The alarms of the mission, as an operator sees them: there is no room for their file.
struct Board {
    alarms: Client<msg::ListAlarms>,
    _node: Node,
}

impl Board {
    fn start() -> Result<Self> {
        let node = Node::start_in(sortie::here()?, "board", &RosArgs::default())?;
        let alarms = node.client(&graph::LIST_ALARMS)?;
        node.wait_for_service(&alarms, SOON)?;
        Ok(Self { alarms, _node: node })
    }

    /// Whether something is wrong.
    fn stands(&self, name: &str) -> bool {
        let answer = self.alarms.call_repeatedly(msg::ListAlarmsRequest::default(), SOON / 40, SOON);
        let wrong = [msg::Alarm::STATE_UNACKNOWLEDGED, msg::Alarm::STATE_ACKNOWLEDGED];
        let is = |it: &msg::Alarm| it.name == name && wrong.contains(&it.beneath);
        answer.is_ok_and(|answer| answer.alarms.iter().any(is))
    }
}
