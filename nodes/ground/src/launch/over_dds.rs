//! A mission over DDS: the nodes that fly and the recorder, each a process of its own.

use std::collections::VecDeque;
use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, anyhow, bail};
use swath_msgs::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus};
use swath_msgs::swath_msgs as msg;
use swath_node::health::{HEALTH, STATE};
use swath_node::messages::resource_state::resource_state;
use swath_node::messages::task_result::task_record;
use swath_node::out;
use swath_node::stamp::Stamper;
use swath_ros::lifecycle::State;
use swath_ros::{Environment, Node, RosArgs, Shutdown, Subscription, Value, graph, stamp};
use swath_sim::task::{FailureReason, TaskOutcome, TaskRecord};
use swath_sim::time::Tick;
use swath_sim::vehicle::faults::FOR_GOOD;
use swath_sim::vehicle::model::Model;

use super::kept::{Keeping, KeptFlight};
use super::output::{Flown, OutputFolder, STORE};
use super::progress::Progress;
use super::start::{Wishes, manifest_data, show, start_nodes, start_recorder};
use super::supervisor::Fleet;
use crate::alarms::FlyingBoard;
use swath_mission::alarms::conditions::{Report, of_plan};
use swath_mission::alarms::{Key, Severity};
use swath_mission::fallback::{Deciders, Policies, made_instead};
use swath_mission::faults::grammar::{Failure, Process};
use swath_mission::faults::plan::Scheduled;
use swath_mission::faults::{FaultPlan, What};
use swath_mission::file::Mission;
use swath_mission::link::ground::Ground;
use swath_mission::link::response::LinkSummary;
use swath_mission::outcome::{OrderOutcome, ResourcesSummary, Summary, SummaryInputs, TaskLine};
use swath_mission::requests::journal::{Attempt, Outcome as AttemptOutcome};
use swath_mission::task_log::TaskLog;

use crate::requests::ground_end::GroundEnd;
use crate::requests::orders::{Orders, stored};
use crate::requests::store::Store;

/// In lockstep, a mission without a decision for so long has stalled.
const STALL_TIMEOUT: Duration = Duration::from_secs(60);
/// How long the last summary of the requests may take.
const SUMMARY_TIMEOUT: Duration = Duration::from_secs(5);
/// How long what happened to alarms waits for more before it is written.
const JOURNAL_DELAY: Duration = Duration::from_millis(500);
const WAIT: Duration = Duration::from_millis(100);
/// How long nodes that are started again at the very end may take to be there.
const WHOLE_TIMEOUT: Duration = Duration::from_secs(20);
/// How often what another launcher must know is kept.
const KEEP_EVERY: Duration = Duration::from_secs(1);
/// How long a launcher that takes over waits for nodes to be there.
const MATCH_TIMEOUT: Duration = Duration::from_secs(5);

/// Flies a mission over DDS; an error where nothing was flown.
pub fn fly(
    mission: &Mission,
    mission_file: &Path,
    ros: &RosArgs,
    output: &mut OutputFolder,
    wishes: Wishes<'_>,
    policies: &Policies,
) -> Result<Flown> {
    let keeping = Keeping::new(output.make_state_folder()?);
    let _lock = keeping.lock()?;
    let mut launcher = Launcher::start(mission, ros, keeping.clone(), wishes.record)?;
    let namespace = launcher.node.names().namespace().to_owned();
    let manifest_data = manifest_data(mission, &namespace, policies);
    let mut fleet = Fleet::new(&mission.supervision, keeping);
    if wishes.record {
        let words = [manifest_data, full_bag(&launcher)].concat();
        start_recorder(&mut fleet, mission_file, &output.path().join("bag"), &namespace, words, &wishes)?;
    }
    if let Some(address) = wishes.console {
        show(&mut fleet, mission_file, &namespace, address)?;
    }
    start_nodes(&mut fleet, mission_file, &namespace, output, wishes)?;
    launcher.keep()?;
    land(mission, launcher, fleet, output)
}

/// Takes over a mission whose launcher is gone, and flies it to its end.
pub fn take_over(mission: &Mission, ros: &RosArgs, output: &mut OutputFolder, flown: &[TaskLine]) -> Result<Flown> {
    let keeping = Keeping::new(output.make_state_folder()?);
    let _lock = keeping.lock()?;
    let kept = keeping.flight()?;
    let domain = Environment::read()?.domain;
    if domain != kept.domain {
        bail!("this mission flies in domain {}, not in {domain}: set ROS_DOMAIN_ID", kept.domain);
    }
    let epoch = i64::try_from(kept.epoch + 1)?;
    let ros = ros.clone().in_namespace(&kept.namespace).with_parameter("epoch", Value::Integer(epoch));
    let mut launcher = Launcher::start(mission, &ros, keeping.clone(), kept.record)?;
    launcher.take_up(kept, flown)?;
    // Nodes tell a launcher that has just come what it must know: it should be there for them. Some may be lost.
    if let Err(missing) = launcher.node.wait_for_peers(&graph::FLIGHT_NODES, MATCH_TIMEOUT) {
        tracing::warn!("{missing}");
    }
    launcher.catch_up(output)?;
    let fleet = Fleet::take_over(&mission.supervision, keeping)?;
    launcher.keep()?;
    land(mission, launcher, fleet, output)
}

/// Watches a mission to its end, ends its processes, and tells what came of it.
fn land(mission: &Mission, mut launcher: Launcher, mut fleet: Fleet, output: &mut OutputFolder) -> Result<Flown> {
    let record = launcher.record;
    let nodes = fleet.processes();
    let watched = launcher.watch(&mut fleet, output);
    let Some(flown) = launcher.flown else {
        return Err(watched.err().unwrap_or_else(|| anyhow!("the mission has not begun")));
    };
    let kept = output.finish(&launcher.alarms.journal(flown.end));
    // The recorder ends first: the nodes' last messages reach it while they are still there.
    let recorded = fleet.stop(&[graph::RECORDER]).and_then(|()| match record {
        true => count_messages(&output.path().join("bag")),
        false => Ok(0),
    });
    let ended = fleet.stop(&graph::ALL_FLIGHT_NODES);
    drop(fleet);
    let (messages_recorded, unrecorded) = match recorded {
        Ok(count) => (count, None),
        Err(error) => (0, Some(error)),
    };
    let safe_mode = launcher.safe_mode.take();
    let model = mission.model()?;
    let ground = ground(mission, &model, output)?;
    let told = output.write_ways(&ground.iter().flat_map(Ground::lines).collect::<Vec<_>>());
    // The first of them is the cause of the others.
    let failure = watched.err().or(unrecorded).or(ended.err()).or(kept.err()).or(told.err());
    let inputs = SummaryInputs {
        planner: mission.planner.to_string(),
        decided_instead: made_instead(launcher.deciders.clone(), &mission.planner),
        failure: failure.as_ref().map(out::chain),
        seed: mission.seed,
        orbits: mission.orbits,
        ticks: flown.end.0,
        wall_seconds: launcher.flown_before_s + (flown.last - flown.began).as_secs_f64(),
        requests: mission.initial_requests()?.0.len() as u64,
        accepted: launcher.accepted(),
        messages_recorded,
        nodes,
        orders: orders(output),
        resources: launcher.resources,
        link: ground.map(|ground| LinkSummary::new(ground.lines(), model.period)),
    };
    Ok(Flown { summary: Summary::new(inputs, launcher.log.totals(), model.period), failure, safe_mode })
}

/// The ground as the request manager left it, in a mission with a radio.
fn ground(mission: &Mission, model: &Model, output: &OutputFolder) -> Result<Option<Ground>> {
    let Some(mut end) = GroundEnd::new(mission, model)? else { return Ok(None) };
    end.take_up(&Store::open_read_only(&output.path().join(STORE))?)?;
    Ok(Some(end.into_ground()))
}

/// What became of orders, from the store that the request manager left.
fn orders(output: &OutputFolder) -> Vec<OrderOutcome> {
    let requests = Store::open_read_only(&output.path().join(STORE)).map_err(Into::into).and_then(|it| stored(&it));
    match requests {
        Ok(requests) => Orders::of(requests.into_iter().map(|(_, status)| status)).outcomes(),
        Err(error) => {
            tracing::warn!("the share imaged of orders is unknown: {error:#}");
            Vec::new()
        }
    }
}

/// When nothing can be stored in the bag, by order.
fn full_bag(launcher: &Launcher) -> Vec<String> {
    let ns = |tick: Tick| if tick == FOR_GOOD { u64::MAX } else { launcher.stamper.nanoseconds(tick) };
    let words = |it: &Scheduled| ["--full-disk".to_owned(), format!("{}..{}", ns(it.from), ns(it.until))];
    launcher.faults.when(What::BagFull, launcher.model.period).iter().flat_map(words).collect()
}

fn count_messages(bag: &Path) -> Result<u64> {
    let information = swath_bags::metadata::BagInformation::read(bag)?;
    let information = information.with_context(|| format!("the bag {} has no metadata.yaml", bag.display()))?;
    Ok(information.message_count)
}

/// The task of an attempt.
fn record_of(attempt: &Attempt) -> TaskRecord {
    let failure = match attempt.outcome {
        AttemptOutcome::Succeeded => None,
        AttemptOutcome::Failed(reason) => Some(reason),
        AttemptOutcome::Cancelled => Some(FailureReason::Interrupted),
    };
    let (max_attitude_error, min_elevation) = (attempt.max_attitude_error, attempt.min_elevation);
    TaskRecord {
        task: attempt.task,
        start: attempt.start,
        end: attempt.end,
        strip: Some(attempt.id),
        duty: None,
        t_pre: attempt.t_pre,
        t_acq: attempt.t_acq,
        outcome: TaskOutcome { failure, max_attitude_error, min_elevation },
    }
}

/// Whether a node tells of its health that it does nothing because somebody told it to.
fn rests(status: &DiagnosticStatus) -> bool {
    let waits = [State::Unconfigured, State::Inactive].map(State::label);
    status.name.ends_with(HEALTH) && status.values.iter().any(|it| it.key == STATE && waits.contains(&&*it.value))
}

/// What a node of a mission says of an alarm: `/NAMESPACE/NODE: ALARM`. Its health is none.
fn report(tick: Tick, status: DiagnosticStatus) -> Option<Report> {
    let (node, name) = status.name.split_once(": ")?;
    let (_, node) = node.rsplit_once('/')?;
    let key = (graph::MEMBERS.contains(&node) && name != HEALTH).then(|| Key::new(node, name))?;
    let severity = if status.level == DiagnosticStatus::WARN { Severity::Warn } else { Severity::Error };
    Some(Report { tick, key, severity, wrong: status.level != DiagnosticStatus::OK, text: status.message })
}

/// Follows a mission, looks after its nodes, and knows what became of its tasks and alarms.
pub(super) struct Launcher {
    pub(super) node: Node,
    pub(super) shutdown: Shutdown,
    pub(super) points: Subscription<msg::DecisionPoint>,
    pub(super) status: Subscription<msg::GuidanceStatus>,
    pub(super) results: Subscription<msg::TaskResult>,
    pub(super) summary: Subscription<msg::RequestSummary>,
    pub(super) diagnostics: Subscription<DiagnosticArray>,
    pub(super) decisions: Subscription<msg::Decision>,
    /// The last task that was decided on, and who decided on all.
    pub(super) decided: Option<u64>,
    pub(super) deciders: Deciders,
    /// Nothing before the first decision point.
    pub(super) flown: Option<Reached>,
    pub(super) model: Model,
    pub(super) horizon: Tick,
    pub(super) log: TaskLog,
    pub(super) last_summary: Option<msg::RequestSummary>,
    pub(super) paced: bool,
    /// Whether a node comes from another program, whenever that is.
    waits_for_others: bool,
    pub(super) stamper: Stamper,
    pub(super) alarms: FlyingBoard,
    /// When a node was last heard to rest because somebody told it to.
    pub(super) resting: Option<Instant>,
    keeping: Keeping,
    /// When what is known of the flight was kept last.
    kept_at: Option<Instant>,
    /// Launchers before this one, and how long they flew [s of wall time].
    epoch: u64,
    flown_before_s: f64,
    /// Whether a bag is recorded.
    record: bool,
    /// What was ordered up to this tick has befallen the recorder before this launcher.
    pub(super) recorder_since: Tick,
    /// When something happened to alarms that is not in the journal's file yet.
    pub(super) unwritten: Option<Instant>,
    /// What is ordered to befall the mission.
    pub(super) faults: FaultPlan,
    pub(super) fault_orders: Subscription<msg::FaultOrders>,
    /// What is ordered to befall the recorder, which knows of no mission, the next first.
    pub(super) recorder_faults: VecDeque<(Scheduled, Failure)>,
    /// Why the mission is, or ended, in safe mode.
    pub(super) safe_mode: Option<String>,
    pub(super) planner_status: Subscription<msg::PlannerStatus>,
    /// Since when a recorder is there that was lost.
    pub(super) room_since: Option<Instant>,
    /// Whether the planner has held since the mission came into safe mode.
    pub(super) held: bool,
    /// What came to the ground and what was left at the last decision point, in a mission with resources.
    pub(super) resources: Option<ResourcesSummary>,
}

/// How far the mission has come.
#[derive(Clone, Copy)]
pub(super) struct Reached {
    pub(super) end: Tick,
    began: Instant,
    last: Instant,
}

impl Launcher {
    fn start(mission: &Mission, ros: &RosArgs, keeping: Keeping, record: bool) -> Result<Self> {
        let external: Vec<String> = mission.nodes.external().into_iter().map(str::to_owned).collect();
        let waits_for_others = !external.is_empty();
        let node = Node::start(graph::LAUNCHER, &ros.clone().with_parameter("external", Value::Strings(external)))?;
        let model = mission.model()?;
        let stamper = Stamper::new(mission.epoch_unix_s, model.period);
        let planned = of_plan(&mission.faults, model.period);
        Ok(Self {
            shutdown: Shutdown::on_signals(node.signal())?,
            points: node.subscription(&graph::DECISION_POINT)?,
            status: node.subscription(&graph::GUIDANCE_STATUS)?,
            results: node.subscription(&graph::TASK_RESULTS)?,
            summary: node.subscription(&graph::REQUEST_SUMMARY)?,
            diagnostics: node.subscription(&graph::DIAGNOSTICS)?,
            decisions: node.subscription(&graph::PLANNER_DECISION)?,
            decided: None,
            deciders: Deciders::new(),
            flown: None,
            horizon: mission.horizon(&model),
            log: TaskLog::default(),
            last_summary: None,
            paced: mission.pace > 0.0,
            waits_for_others,
            alarms: FlyingBoard::new(&node, model.period, stamper.clone(), planned)?,
            resting: None,
            keeping,
            kept_at: None,
            epoch: 0,
            flown_before_s: 0.0,
            record,
            recorder_since: Tick(0),
            unwritten: None,
            stamper,
            faults: mission.faults.clone(),
            fault_orders: node.subscription(&graph::FAULT_ORDERS)?,
            recorder_faults: mission.faults.of(Process::Recorder, model.period).into(),
            safe_mode: None,
            planner_status: node.subscription(&graph::PLANNER_STATUS)?,
            held: false,
            resources: None,
            room_since: None,
            model,
            node,
        })
    }

    /// Goes on where the launcher before was.
    fn take_up(&mut self, kept: KeptFlight, flown: &[TaskLine]) -> Result<()> {
        self.recorder_since = kept.at;
        self.recorder_faults.retain(|(it, _)| it.from > kept.at);
        self.alarms.take_up(kept.reports, kept.wishes)?;
        (self.epoch, self.flown_before_s) = (kept.epoch + 1, kept.flown_s);
        (self.decided, self.deciders, self.safe_mode) = (kept.decided, kept.deciders, kept.safe_mode);
        self.log = TaskLog::going_on(flown);
        let now = Instant::now();
        let end = Tick(flown.iter().map(|line| line.end_tick).max().unwrap_or(0));
        self.flown = Some(Reached { end, began: now, last: now });
        Ok(())
    }

    /// Learns from the store what was imaged while there was no launcher.
    fn catch_up(&mut self, output: &mut OutputFolder) -> Result<()> {
        let store = Store::open_read_only(&output.path().join(STORE))?;
        for (attempt, name) in store.attempts_from(self.log.next())? {
            self.log.flown(record_of(&attempt), &name);
            self.log.settled(attempt.task, attempt.reward);
        }
        self.take_rest(output)
    }

    /// Keeps what another launcher must know.
    fn keep(&mut self) -> Result<()> {
        self.kept_at = Some(Instant::now());
        let (reports, wishes) = self.alarms.kept();
        let flown_s = self.flown.map_or(0.0, |flown| (flown.last - flown.began).as_secs_f64());
        // Without room for it, what was kept before stands until the next time.
        let _ = self.keeping.keep_flight(&KeptFlight {
            epoch: self.epoch,
            domain: self.node.environment().domain,
            namespace: self.node.names().namespace().to_owned(),
            record: self.record,
            decided: self.decided,
            deciders: self.deciders.clone(),
            reports: reports.to_vec(),
            wishes: wishes.to_vec(),
            at: self.alarms.now().max(self.recorder_since),
            safe_mode: self.safe_mode.clone(),
            flown_s: self.flown_before_s + flown_s,
        })?;
        Ok(())
    }

    /// Follows the mission to its end.
    fn watch(&mut self, fleet: &mut Fleet, output: &mut OutputFolder) -> Result<()> {
        let mut progress = Progress::new(self.horizon, self.model.period);
        let outcome = self.follow(fleet, output, &mut progress);
        progress.finish();
        let over = outcome.and_then(|()| self.wait_for_the_ground(fleet, output));
        // What had come until then is kept.
        over.or_else(|error| {
            self.log.give_up();
            self.take_rest(output).and(Err(error))
        })
    }

    fn follow(&mut self, fleet: &mut Fleet, output: &mut OutputFolder, progress: &mut Progress) -> Result<()> {
        let mut last_news = Instant::now();
        loop {
            if self.shutdown.asked() {
                bail!("interrupted");
            }
            while let Some(point) = self.points.take()? {
                if point.tick > self.horizon.0 {
                    tracing::warn!("a decision point of tick {} lies after the mission's end", point.tick);
                    continue;
                }
                last_news = Instant::now();
                let (end, began) = (Tick(point.tick), self.flown.map_or(last_news, |flown| flown.began));
                self.flown = Some(Reached { end, began, last: last_news });
                if let Some(resources) = point.state.resources.first() {
                    self.resources = Some(ResourcesSummary::new(&resource_state(resources)?));
                }
                if let Some(result) = point.result.first() {
                    self.log.flown(task_record(result)?, &result.strip_name);
                }
                progress.task(end, self.log.totals());
                if point.mission_over {
                    return Ok(());
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
            self.mind(fleet)?;
            self.mind_alarms(fleet, output)?;
            if self.kept_at.is_none_or(|at| at.elapsed() > KEEP_EVERY) {
                self.keep()?;
            }
            // Its time is over, and nobody has said so yet; before that a paced mission goes on by itself.
            let over = self.stamper.tick_from(&stamp(fleet.now_ns())) >= self.horizon;
            if (self.paced && !over) || (self.waits_for_others && self.flown.is_none()) {
                last_news = Instant::now();
            }
            // A mission that somebody made wait has not stalled.
            let stands = last_news.max(self.resting.unwrap_or(last_news)).elapsed();
            if stands > STALL_TIMEOUT {
                bail!("no decision for {} s: the mission has stalled", STALL_TIMEOUT.as_secs());
            }
            self.node.wait(WAIT)?;
        }
    }

    fn take_rest(&mut self, output: &mut OutputFolder) -> Result<()> {
        for notice in self.node.notices() {
            tracing::warn!("{}: {notice}", notice.trouble.name());
        }
        while let Some(result) = self.results.take()? {
            self.log.settled(result.task, result.reward);
        }
        for (_, line) in self.log.take() {
            output.write_task(&line).context("cannot write tasks.jsonl")?;
        }
        while let Some(decision) = self.decisions.take()? {
            // A question that is asked again is answered again.
            if self.decided.is_none_or(|last| last < decision.task) {
                self.decided = Some(decision.task);
                *self.deciders.entry(decision.planner).or_insert(0) += 1;
            }
        }
        while let Some(summary) = self.summary.take()? {
            self.last_summary = Some(summary);
        }
        while let Some(array) = self.diagnostics.take()? {
            let tick = self.stamper.tick_from(&array.header.stamp);
            for status in array.status {
                tracing::debug!("{}: {}", status.name, status.message);
                if rests(&status) {
                    self.resting = Some(Instant::now());
                }
                report(tick, status).into_iter().for_each(|report| self.alarms.report(report));
            }
        }
        Ok(())
    }

    /// Tells what happened to alarms, and keeps it in the journal's file.
    fn mind_alarms(&mut self, fleet: &Fleet, output: &OutputFolder) -> Result<()> {
        let Some(flown) = self.flown else { return Ok(()) };
        let now = self.stamper.tick_from(&stamp(fleet.now_ns())).clamp(flown.end, self.horizon);
        if self.alarms.step(now)? {
            self.unwritten.get_or_insert_with(Instant::now);
        }
        if self.unwritten.is_some_and(|since| since.elapsed() > JOURNAL_DELAY) {
            let written = output.write_alarms(&self.alarms.journal(now))?;
            self.unwritten = (!written).then(Instant::now);
        }
        Ok(())
    }

    /// Waits for the last rewards and the last summary of the request manager.
    fn wait_for_the_ground(&mut self, fleet: &mut Fleet, output: &mut OutputFolder) -> Result<()> {
        let whole_by = Instant::now() + WHOLE_TIMEOUT;
        loop {
            self.mind(fleet)?;
            if fleet.is_whole() || Instant::now() > whole_by {
                break;
            }
            self.take_rest(output)?;
            self.mind_alarms(fleet, output)?;
            self.node.wait(WAIT)?;
        }
        let end = self.flown.map_or(Tick(0), |flown| flown.end);
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
