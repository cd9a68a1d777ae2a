//! Starts the processes of a mission: the recorder, the console, the nodes that fly.

use std::net::SocketAddr;
use std::path::Path;
use std::time::Duration;

use anyhow::{Context, Result};
use swath_node::out;
use swath_ros::graph;

use super::output::{OutputFolder, STORE};
use super::supervisor::Fleet;
use swath_mission::fallback::Policies;
use swath_mission::file::Mission;

/// How long the recorder and the console may take to come up.
const START_TIMEOUT: Duration = Duration::from_secs(20);

/// How long time waits for a program that takes a node's place.
const EXTERNAL_TIMEOUT_S: f64 = 3600.0;

/// What there is besides the nodes that fly.
#[derive(Clone, Copy)]
pub struct Wishes<'a> {
    /// Whether a bag is recorded.
    pub record: bool,
    /// Where the console listens, if there is one.
    pub console: Option<SocketAddr>,
    /// Whether there is a radio between ground and satellite.
    pub radio: bool,
    /// Whether the ground predicts what a learned policy decides.
    pub foresees_policy: bool,
    /// Nodes whose place another program takes.
    pub external: &'a [&'static str],
}

impl Wishes<'_> {
    /// The words of ROS that name nodes of other programs.
    fn external(&self) -> Vec<String> {
        match self.external {
            [] => Vec::new(),
            names => vec!["-p".to_owned(), format!("external:=[{}]", names.join(","))],
        }
    }
}

/// Starts the recorder, and waits until it listens.
pub(super) fn start_recorder(
    fleet: &mut Fleet,
    mission_file: &Path,
    bag: &Path,
    namespace: &str,
    further: Vec<String>,
    wishes: &Wishes<'_>,
) -> Result<()> {
    let (manifest, output) = (text(mission_file)?, text(bag)?);
    let words = ["record", "--use-sim-time", "--own-mission-only", "--resume", "--manifest", &manifest];
    let words = words.into_iter().chain(["--output", &output]).map(str::to_owned).chain(further);
    let words: Vec<String> =
        words.chain(["--ros-args".to_owned()]).chain(in_namespace(namespace)).chain(wishes.external()).collect();
    fleet.start(graph::RECORDER, "swath-bag", &words)?;
    fleet.wait_for_line(graph::RECORDER, START_TIMEOUT).map(drop)
}

/// What the manifest of the bag tells besides the mission.
pub(super) fn manifest_data(mission: &Mission, namespace: &str, policies: &Policies) -> Vec<String> {
    let mut entries = vec![format!("revision={}", policies.revision), format!("namespace={namespace}")];
    match (policies.digest)(&mission.planner) {
        Ok(Some(digest)) => entries.push(format!("policy_hash={digest}")),
        Ok(None) => {}
        // The planner node raises the alarm and the heuristic takes over.
        Err(error) => entries.push(format!("policy_hash=none: {error}")),
    }
    entries.into_iter().flat_map(|entry| ["--manifest-data".to_owned(), entry]).collect()
}

/// Starts the console and says where it is. It is not asked for anything: a mission flies on without it.
pub(super) fn show(fleet: &mut Fleet, mission_file: &Path, namespace: &str, address: SocketAddr) -> Result<()> {
    let mission = text(mission_file)?;
    let words = [format!("--listen={address}"), format!("--mission={mission}"), format!("--namespace={namespace}")];
    fleet.start_beside(graph::CONSOLE, "swath-console", &words)?;
    out::say(format_args!("console: {}", fleet.wait_for_line(graph::CONSOLE, START_TIMEOUT)?));
    Ok(())
}

pub(super) fn start_nodes(
    fleet: &mut Fleet,
    mission_file: &Path,
    namespace: &str,
    output: &OutputFolder,
    wishes: Wishes<'_>,
) -> Result<()> {
    let mission = format!("mission:={}", text(mission_file)?);
    let keep = format!("keep:={}", text(&output.make_state_folder()?)?);
    let words = |extra: &[String]| {
        let own = ["--ros-args", "-p", &mission, "-p", &keep].map(str::to_owned);
        let own = own.into_iter().chain(in_namespace(namespace)).chain(wishes.external());
        let recorded = wishes.record.then(|| ["-p", "recorded:=true"].map(str::to_owned)).into_iter().flatten();
        own.chain(recorded).chain(extra.iter().cloned()).collect::<Vec<_>>()
    };
    let store = format!("store:={}", text(&output.path().join(STORE))?);
    // libtorch is large: only who needs it has it.
    let requests = if wishes.foresees_policy { "swath-requests-learned" } else { "swath-requests" };
    fleet.start(graph::REQUEST_MANAGER, requests, &words(&["-p".to_owned(), store]))?;
    let mut peers = vec![graph::GUIDANCE, graph::REQUEST_MANAGER, graph::PLANNER, graph::LAUNCHER];
    let mut others = vec![(graph::PLANNER, "swath-planner"), (graph::GUIDANCE, "swath-guidance")];
    if wishes.radio {
        peers.extend(graph::RADIO_NODES);
        others.extend([(graph::CATALOGUE, "swath-catalogue"), (graph::LINK, "swath-link")]);
    }
    for (name, program) in others.into_iter().filter(|(name, _)| !wishes.external.contains(name)) {
        fleet.start(name, program, &words(&[]))?;
    }
    if wishes.record {
        peers.push(graph::RECORDER);
    }
    if wishes.console.is_some() {
        peers.push(graph::CONSOLE);
    }
    let mut own = vec!["-p".to_owned(), format!("wait_for:={}", peers.join(","))];
    if !wishes.external.is_empty() {
        own.extend(["-p".to_owned(), format!("peer_timeout_s:={EXTERNAL_TIMEOUT_S:?}")]);
    }
    fleet.start(graph::SPACECRAFT, "swath-spacecraft", &words(&own))
}

/// The words after `--ros-args` that put a node into a namespace.
fn in_namespace(namespace: &str) -> [String; 2] {
    ["-r".to_owned(), format!("__ns:={namespace}")]
}

fn text(path: &Path) -> Result<String> {
    path.to_str().map(str::to_owned).with_context(|| format!("path {} is not UTF-8", path.display()))
}
