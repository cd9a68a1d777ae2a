//! A mission over DDS: four nodes and the recorder, each a process of its own.

use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use swath_msgs::diagnostic_msgs::DiagnosticArray;
use swath_msgs::swath_msgs as msg;
use swath_node::messages::task_record;
use swath_ros::{Node, RosArgs, Shutdown, Subscription, graph};
use swath_sim::model::Model;
use swath_sim::task::Totals;

use swath_sim::time::Tick;

use super::fleet::Fleet;
use super::output::OutputFolder;
use super::progress::Progress;
use swath_mission::file::Mission;
use swath_mission::guarded::Policies;
use swath_mission::outcome::{Summary, SummaryInputs};
use swath_mission::task_log::TaskLog;

/// How long the recorder may take to come up.
const RECORDER_TIMEOUT: Duration = Duration::from_secs(20);
/// In lockstep, a mission without a decision for so long has stalled.
const STALL_TIMEOUT: Duration = Duration::from_secs(60);
/// How long the last summary of the requests may take.
const SUMMARY_TIMEOUT: Duration = Duration::from_secs(5);
const WAIT: Duration = Duration::from_millis(100);

/// Flies a mission over DDS.
pub fn fly(
    mission: &Mission,
    mission_file: &Path,
    output: &mut OutputFolder,
    record: bool,
    policies: &Policies,
) -> Result<Summary> {
    let mut launcher = Launcher::start(mission)?;
    let mut fleet = Fleet::default();
    if record {
        let bag = output.path().join("bag");
        let words = ["record", "--use-sim-time", "--manifest", &text(mission_file)?, "--output", &text(&bag)?];
        let words: Vec<String> = words.map(str::to_owned).into_iter().chain(manifest_data(mission, policies)).collect();
        fleet.start(graph::RECORDER, "swath-bag", &words, true)?;
        fleet.wait_for_line(graph::RECORDER, RECORDER_TIMEOUT)?;
    }
    start_nodes(&mut fleet, mission_file, output, record)?;
    let nodes = fleet.processes();
    let flown = launcher.watch(&mut fleet, output)?;
    // The recorder ends first: the nodes' last messages reach it while they are still there.
    fleet.stop(&[graph::RECORDER])?;
    fleet.stop(&graph::FLIGHT_NODES)?;
    let messages_recorded = if record { count_messages(&output.path().join("bag"))? } else { 0 };
    let model = mission.model()?;
    let inputs = SummaryInputs {
        planner: mission.planner.to_string(),
        seed: mission.seed,
        orbits: mission.orbits,
        ticks: flown.end.0,
        wall_seconds: flown.wall.as_secs_f64(),
        requests: mission.initial_requests()?.0.len() as u64,
        accepted: launcher.accepted(),
        messages_recorded,
        nodes,
        resources: None,
    };
    Ok(Summary::new(inputs, &flown.totals, model.period))
}

/// What the manifest of the bag tells besides the mission.
fn manifest_data(mission: &Mission, policies: &Policies) -> Vec<String> {
    let mut entries = vec![format!("revision={}", policies.revision)];
    match (policies.digest)(&mission.planner) {
        Ok(Some(digest)) => entries.push(format!("policy_hash={digest}")),
        Ok(None) => {}
        // The planner node raises the alarm and the heuristic takes over.
        Err(error) => entries.push(format!("policy_hash=none: {error}")),
    }
    entries.into_iter().flat_map(|entry| ["--manifest-data".to_owned(), entry]).collect()
}

fn start_nodes(fleet: &mut Fleet, mission_file: &Path, output: &OutputFolder, record: bool) -> Result<()> {
    let mission = format!("mission:={}", text(mission_file)?);
    let words = |extra: &[String]| {
        let own = ["--ros-args", "-p", &mission].map(str::to_owned);
        own.into_iter().chain(extra.iter().cloned()).collect::<Vec<_>>()
    };
    let store = format!("store:={}", text(&output.path().join("requests.sqlite"))?);
    fleet.start_and_keep(graph::REQUEST_MANAGER, "swath-requests", &words(&["-p".to_owned(), store]))?;
    for (name, program) in [(graph::PLANNER, "swath-planner"), (graph::GUIDANCE, "swath-guidance")] {
        fleet.start(name, program, &words(&[]), false)?;
    }
    let mut peers = vec![graph::GUIDANCE, graph::REQUEST_MANAGER, graph::PLANNER, graph::LAUNCHER];
    if record {
        peers.push(graph::RECORDER);
    }
    let wait_for = ["-p".to_owned(), format!("wait_for:={}", peers.join(","))];
    fleet.start(graph::SPACECRAFT, "swath-spacecraft", &words(&wait_for), false)
}

fn text(path: &Path) -> Result<String> {
    path.to_str().map(str::to_owned).with_context(|| format!("path {} is not UTF-8", path.display()))
}

fn count_messages(bag: &Path) -> Result<u64> {
    let information = swath_bags::metadata::BagInformation::read(bag)?;
    let information = information.with_context(|| format!("the bag {} has no metadata.yaml", bag.display()))?;
    Ok(information.message_count)
}

struct Launcher {
    node: Node,
    shutdown: Shutdown,
    points: Subscription<msg::DecisionPoint>,
    status: Subscription<msg::GuidanceStatus>,
    results: Subscription<msg::TaskResult>,
    summary: Subscription<msg::RequestSummary>,
    diagnostics: Subscription<DiagnosticArray>,
    model: Model,
    horizon: Tick,
    log: TaskLog,
    last_summary: Option<msg::RequestSummary>,
    paced: bool,
}

struct Flown {
    end: Tick,
    wall: Duration,
    totals: Totals,
}

impl Launcher {
    fn start(mission: &Mission) -> Result<Self> {
        let node = Node::start(graph::LAUNCHER, &RosArgs::default())?;
        let model = mission.model()?;
        Ok(Self {
            shutdown: Shutdown::on_signals(node.signal())?,
            points: node.subscription(&graph::DECISION_POINT)?,
            status: node.subscription(&graph::GUIDANCE_STATUS)?,
            results: node.subscription(&graph::TASK_RESULTS)?,
            summary: node.subscription(&graph::REQUEST_SUMMARY)?,
            diagnostics: node.subscription(&graph::DIAGNOSTICS)?,
            horizon: mission.horizon(&model),
            model,
            log: TaskLog::default(),
            last_summary: None,
            paced: mission.pace > 0.0,
            node,
        })
    }

    fn watch(&mut self, fleet: &mut Fleet, output: &mut OutputFolder) -> Result<Flown> {
        let mut progress = Progress::new(self.horizon, self.model.period);
        let mut started = None;
        let mut last_news = Instant::now();
        loop {
            if self.shutdown.asked() {
                progress.finish();
                bail!("interrupted");
            }
            while let Some(point) = self.points.take()? {
                last_news = Instant::now();
                let began = *started.get_or_insert(last_news);
                if let Some(result) = point.result.first() {
                    self.log.flown(task_record(result)?, &result.strip_name);
                }
                progress.task(Tick(point.tick), self.log.totals());
                if point.mission_over {
                    progress.finish();
                    self.wait_for_the_ground(Tick(point.tick), output)?;
                    let (end, wall, totals) = (Tick(point.tick), last_news - began, *self.log.totals());
                    return Ok(Flown { end, wall, totals });
                }
            }
            while let Some(status) = self.status.take()? {
                let phase = match status.phase {
                    msg::WheelTorque::PHASE_TRANSITION => "to",
                    msg::WheelTorque::PHASE_IMAGING => "imaging",
                    _ => "waiting",
                };
                progress.status(Tick(status.tick), phase, &status.strip_name, status.attitude_error, self.log.totals());
            }
            self.take_rest(output)?;
            fleet.check()?;
            if !self.paced && last_news.elapsed() > STALL_TIMEOUT {
                bail!("no decision for {} s: the mission has stalled", STALL_TIMEOUT.as_secs());
            }
            self.node.wait(WAIT)?;
        }
    }

    fn take_rest(&mut self, output: &mut OutputFolder) -> Result<()> {
        while let Some(result) = self.results.take()? {
            self.log.settled(result.task, result.reward);
        }
        for (_, line) in self.log.take() {
            output.write_task(&line).context("cannot write tasks.jsonl")?;
        }
        while let Some(summary) = self.summary.take()? {
            self.last_summary = Some(summary);
        }
        while let Some(array) = self.diagnostics.take()? {
            for status in array.status {
                tracing::debug!("{}: {}", status.name, status.message);
            }
        }
        Ok(())
    }

    /// Waits for the last rewards and the last summary of the request manager.
    fn wait_for_the_ground(&mut self, end: Tick, output: &mut OutputFolder) -> Result<()> {
        let deadline = Instant::now() + SUMMARY_TIMEOUT;
        let behind = |it: &Self| it.last_summary.as_ref().is_none_or(|summary| summary.tick < end.0) || it.log.waits();
        while behind(self) && Instant::now() < deadline {
            self.take_rest(output)?;
            self.node.wait(WAIT)?;
        }
        if self.log.waits() {
            tracing::warn!("the request manager has not settled every task: its rewards count as 0");
            self.log.give_up();
        }
        self.take_rest(output)
    }

    fn accepted(&self) -> u64 {
        self.last_summary.as_ref().map_or(0, |s| {
            [
                s.held,
                s.accepted,
                s.scheduled,
                s.executing,
                s.completed,
                s.cancelled_by_user,
                s.cancelled_by_system,
                s.expired,
                s.failed,
                s.superseded,
                s.fulfilled_by_link,
            ]
            .iter()
            .sum()
        })
    }
}
