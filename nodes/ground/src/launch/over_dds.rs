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
use swath_mission::outcome::{Summary, SummaryInputs, TaskLine};

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
        requests: mission.initial_requests()?.len() as u64,
        accepted: launcher.accepted(),
        messages_recorded,
        nodes,
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
    summary: Subscription<msg::RequestSummary>,
    diagnostics: Subscription<DiagnosticArray>,
    model: Model,
    horizon: Tick,
    next_task: u64,
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
            summary: node.subscription(&graph::REQUEST_SUMMARY)?,
            diagnostics: node.subscription(&graph::DIAGNOSTICS)?,
            horizon: mission.horizon(&model),
            model,
            next_task: 0,
            last_summary: None,
            paced: mission.pace > 0.0,
            node,
        })
    }

    fn watch(&mut self, fleet: &mut Fleet, output: &mut OutputFolder) -> Result<Flown> {
        let mut totals = Totals::default();
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
                    self.take_result(result, output, &mut totals)?;
                }
                progress.task(Tick(point.tick), &totals);
                if point.mission_over {
                    progress.finish();
                    self.wait_for_summary(Tick(point.tick))?;
                    return Ok(Flown { end: Tick(point.tick), wall: last_news - began, totals });
                }
            }
            while let Some(status) = self.status.take()? {
                let phase = match status.phase {
                    msg::WheelTorque::PHASE_TRANSITION => "to",
                    msg::WheelTorque::PHASE_IMAGING => "imaging",
                    _ => "waiting",
                };
                progress.status(Tick(status.tick), phase, &status.strip_name, status.attitude_error, &totals);
            }
            self.take_rest()?;
            fleet.check()?;
            if !self.paced && last_news.elapsed() > STALL_TIMEOUT {
                bail!("no decision for {} s: the mission has stalled", STALL_TIMEOUT.as_secs());
            }
            self.node.wait(WAIT)?;
        }
    }

    /// Takes a result once: guidance asks again when an answer is late.
    fn take_result(&mut self, result: &msg::TaskResult, output: &mut OutputFolder, totals: &mut Totals) -> Result<()> {
        if result.task < self.next_task {
            return Ok(());
        }
        self.next_task = result.task + 1;
        let record = task_record(result)?;
        totals.add(&record);
        let name = record.strip.map(|_| result.strip_name.as_str());
        output.write_task(&TaskLine::new(&record, name)).context("cannot write tasks.jsonl")
    }

    fn take_rest(&mut self) -> Result<()> {
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

    fn wait_for_summary(&mut self, end: Tick) -> Result<()> {
        let deadline = Instant::now() + SUMMARY_TIMEOUT;
        while self.last_summary.as_ref().is_none_or(|summary| summary.tick < end.0) && Instant::now() < deadline {
            self.take_rest()?;
            self.node.wait(WAIT)?;
        }
        Ok(())
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
