//! The planner node's topics and alarms.

use std::time::{Duration, Instant};

use anyhow::{Context as _, Result};
use swath_mission::orders::action::{Act, Action};
use swath_msgs::swath_msgs as msg;
use swath_node::messages::decision_point::situation;
use swath_node::messages::task_result::task_record;
use swath_node::orders::{operator_action, planner_mode};
use swath_ros::lifecycle::State;
use swath_ros::{Publisher, Server, Spec, Subscription, graph};
use swath_sim::planner::PlannerSpec;
use swath_sim::time::Tick;

use super::logic::{Planned, PlannerLogic};
use super::messages;
use swath_mission::alarms::conditions::of_planner;
use swath_mission::approval::{ApprovalConfig, Gate, GatedPlanner, Mode};
use swath_mission::fallback::{GuardedPlanner, Policies};
use swath_mission::faults::grammar::Process;
use swath_mission::faults::plan::Scheduled;
use swath_node::lifecycle::{self, LifecycleNode};
use swath_node::node::{MissionNode, Severity};
use swath_node::patient::keep;
use swath_node::program::{Parameter, Program};

const PLANNER_PARAMETER: Parameter =
    Parameter { name: "planner", about: "The planner, as mission files name them; the mission's without it." };

const MODE: Parameter =
    Parameter { name: "mode", about: "autonomous, approve or hold; as it was, or as the mission says, without it." };
/// The file in which the planner keeps its mode.
const KEPT: &str = "planner.mode";

/// The node as a program.
const PROGRAM: Program = Program {
    node: graph::PLANNER,
    name: "swath-planner",
    about: "The planner: chooses the next strip and how long to turn to it",
    parameters: &[PLANNER_PARAMETER, MODE],
};

/// Nothing happens by itself: the node only looks whether it is asked to end.
const IDLE: Duration = Duration::from_millis(500);

/// Runs the planner node until it is asked to end.
///
/// # Errors
/// When the node cannot come up or DDS fails.
pub fn run(policies: &Policies) -> Result<()> {
    let base = MissionNode::start(&PROGRAM)?;
    let name = Spec::new(PLANNER_PARAMETER.name, base.mission.planner.to_string(), PLANNER_PARAMETER.about);
    let spec: PlannerSpec = base.node.parameters().declare(name.read_only())?.parse()?;
    let mode = Spec::new(MODE.name, String::new(), MODE.about);
    let mode = base.node.parameters().declare(mode.read_only())?;
    base.node.parameters().check_given()?;
    lifecycle::run(base, |base| PlannerNode::new(base, policies, &spec, &mode))
}

struct PlannerNode {
    logic: PlannerLogic,
    points: Subscription<msg::DecisionPoint>,
    upcoming: Subscription<msg::UpcomingStrips>,
    tasks: Publisher<msg::ImagingTask>,
    decisions: Publisher<msg::Decision>,
    status: Publisher<msg::PlannerStatus>,
    actions: Publisher<msg::OperatorAction>,
    /// There are none where there is a radio: nobody on the ground reaches the planner.
    services: Option<(Server<msg::SetPlannerMode>, Server<msg::ReviewProposal>)>,
    status_told: Option<msg::PlannerStatus>,
    strips: Vec<msg::Candidate>,
    last: Option<msg::ImagingTask>,
    /// Why another planner decides in its place, as it was told last.
    fault_told: Option<String>,
    now: Tick,
    /// What an operator set and there was no room to keep.
    unkept: Option<Mode>,
    /// When there is no planner, by order.
    away: Vec<Scheduled>,
    base: MissionNode,
}

impl PlannerNode {
    fn new(base: MissionNode, policies: &Policies, spec: &PlannerSpec, mode: &str) -> Result<Self> {
        let planner = GuardedPlanner::make(policies, spec, base.mission.seed);
        if let Some(warning) = policies.warning(spec, &base.mission.sim) {
            tracing::warn!("{warning}");
        }
        let config = ApprovalConfig { mode: mode_at_start(&base, mode)?, ..base.mission.approval.clone() };
        let gate = Gate::new(&config, base.model.period);
        let planner = GatedPlanner { gate, planner };
        Ok(Self {
            logic: PlannerLogic::new((*base.model).clone(), planner),
            status: base.node.publisher(&graph::PLANNER_STATUS)?,
            actions: base.node.publisher(&graph::PLANNER_ACTIONS)?,
            services: match base.mission.link {
                None => Some((base.node.server(&graph::SET_PLANNER_MODE)?, base.node.server(&graph::REVIEW_PROPOSAL)?)),
                Some(_) => None,
            },
            status_told: None,
            points: base.node.subscription(&graph::DECISION_POINT)?,
            upcoming: base.node.subscription(&graph::UPCOMING_STRIPS)?,
            tasks: base.node.publisher(&graph::PLANNER_TASK)?,
            decisions: base.node.publisher(&graph::PLANNER_DECISION)?,
            strips: Vec::new(),
            last: None,
            now: Tick(0),
            unkept: None,
            fault_told: None,
            away: away(&base),
            base,
        })
    }

    fn work(&mut self) -> Result<()> {
        self.take_fault_orders()?;
        while let Some(point) = self.points.take()? {
            if point.mission_over {
                continue;
            }
            let tick = Tick(point.tick);
            self.take_fault_orders()?;
            if self.base.strikes_at().is_some_and(|at| tick >= at) {
                self.base.strike();
            }
            if self.away.iter().any(|it| it.from <= tick && tick < it.until) {
                continue;
            }
            // The question again: the answer may have been lost.
            if let Some(last) = self.last.as_ref().filter(|last| last.task == point.task) {
                self.tasks.publish(last)?;
                continue;
            }
            let started = Instant::now();
            let previous = point.result.first().map(task_record).transpose();
            let situation = self.base.tick(point.tick).and_then(|_| situation(&point));
            match situation.and_then(|situation| Ok((situation, previous?))) {
                Ok((situation, previous)) => {
                    let planned = self.logic.on_decision_point(point.task, situation, previous);
                    self.publish(planned, started)?;
                }
                Err(error) => self.base.alarm(Severity::Error, "decision point refused", &error.to_string())?,
            }
        }
        while let Some(message) = self.upcoming.take()? {
            let started = Instant::now();
            match messages::upcoming(&self.base.model, &message) {
                Ok(upcoming) => {
                    self.strips = message.candidates.to_vec();
                    let planned = self.logic.on_upcoming(upcoming);
                    self.publish(planned, started)?;
                }
                Err(error) => self.base.alarm(Severity::Error, "candidates refused", &error.to_string())?,
            }
        }
        self.take_orders()?;
        self.tell_status()
    }

    fn take_fault_orders(&mut self) -> Result<()> {
        if self.base.take_fault_orders()? {
            self.away = away(&self.base);
        }
        Ok(())
    }

    /// What operators say; it counts from the next decision on.
    fn take_orders(&mut self) -> Result<()> {
        let Some((set_mode, review)) = &mut self.services else { return Ok(()) };
        let mut taken = Vec::new();
        let (at, initial) = (self.now, self.last.is_none());
        let mut note = |actor: String, act: Act| taken.push(Action { at, initial, actor, reason: String::new(), act });
        let mut set = None;
        let inactive = (self.base.lifecycle.state() != State::Active).then(|| "the planner is inactive".to_owned());
        let gate = self.logic.gate_mut();
        set_mode.answer_all(|call| match (planner_mode(call.mode), &inactive) {
            (_, Some(reason)) => msg::SetPlannerModeResponse { accepted: false, reason: reason.clone() },
            (Ok(mode), None) => {
                tracing::info!("{} sets the mode to {mode:?}", call.actor);
                gate.set_mode(mode);
                set = Some(mode);
                note(call.actor, Act::SetMode(mode));
                msg::SetPlannerModeResponse { accepted: true, reason: String::new() }
            }
            (Err(error), None) => msg::SetPlannerModeResponse { accepted: false, reason: error.to_string() },
        })?;
        review.answer_all(|call| match inactive.clone().map_or_else(|| self::review(gate, &call), Err) {
            Ok(proposal) => {
                let verb = if call.approve { "approves" } else { "rejects" };
                tracing::info!("{} {verb} proposal {proposal}", call.actor);
                note(call.actor, Act::Decide { proposal, approve: call.approve });
                msg::ReviewProposalResponse { accepted: true, proposal, reason: String::new() }
            }
            Err(reason) => msg::ReviewProposalResponse { reason, ..Default::default() },
        })?;
        self.unkept = set.or(self.unkept);
        if let (Some(path), Some(mode)) = (self.base.keeps(KEPT), self.unkept)
            && keep(&path, &serde_json::to_string(&mode)?)?
        {
            self.unkept = None;
        }
        for action in taken {
            self.actions.publish(&operator_action(&self.base.stamper, &action))?;
        }
        Ok(())
    }

    /// Tells the mode and the proposal when they have changed.
    fn tell_status(&mut self) -> Result<()> {
        let proposed = self.logic.gate().proposal().map(|proposal| proposal.candidate.id.0);
        let known = self.status_told.as_ref().map(|status| &status.strip).filter(|strip| Some(strip.id) == proposed);
        let offered = self.strips.iter().map(|candidate| &candidate.strip);
        // A strip that is proposed stays known when the candidates change.
        let strip = offered.chain(known).find(|strip| Some(strip.id) == proposed).cloned().unwrap_or_default();
        let status = messages::planner_status(&self.base.stamper, self.now, &self.logic, strip);
        let same =
            |told: &msg::PlannerStatus| msg::PlannerStatus { header: told.header.clone(), ..status.clone() } == *told;
        if !self.status_told.as_ref().is_some_and(same) {
            self.status.publish(&status)?;
            self.status_told = Some(status);
        }
        Ok(())
    }

    fn publish(&mut self, planned: Option<Planned>, started: Instant) -> Result<()> {
        let (Some(planned), Some(upcoming)) = (planned, self.logic.upcoming()) else { return Ok(()) };
        self.now = planned.situation.now;
        self.base.set_now(self.now);
        if self.fault_told != planned.fault {
            self.base.condition(&of_planner(self.now, planned.fault.as_deref(), &planned.planner))?;
            self.fault_told.clone_from(&planned.fault);
        }
        let task = messages::imaging_task(&self.base.stamper, &planned, &self.strips);
        self.tasks.publish(&task)?;
        let compute_time_s = started.elapsed().as_secs_f64();
        self.decisions.publish(&messages::decision(&self.base.stamper, &planned, upcoming, compute_time_s))?;
        self.last = Some(task);
        Ok(())
    }
}

impl LifecycleNode for PlannerNode {
    fn base(&self) -> &MissionNode {
        &self.base
    }

    fn turn(&mut self) -> Result<()> {
        self.work()?;
        self.base.wait(IDLE)?;
        Ok(())
    }

    /// Nobody decides: the satellite holds its attitude.
    fn rest(&mut self) -> Result<()> {
        while self.points.take()?.is_some() {}
        while self.upcoming.take()?.is_some() {}
        self.take_fault_orders()?;
        self.take_orders()?;
        self.base.wait(IDLE)?;
        Ok(())
    }

    fn end(self) -> Result<MissionNode> {
        Ok(self.base)
    }
}

fn review(gate: &mut Gate, call: &msg::ReviewProposalRequest) -> Result<u64, String> {
    gate.review(call.proposal, call.approve, &call.actor).map_err(|error| error.to_string())
}

/// When there is no planner, by order.
fn away(base: &MissionNode) -> Vec<Scheduled> {
    base.mission.faults.of(Process::Planner, base.model.period).into_iter().map(|(it, _)| it).collect()
}

/// The mode that is asked for, else the one that operators set before this planner was started again, else the mission's.
fn mode_at_start(base: &MissionNode, asked_for: &str) -> Result<Mode> {
    let text = if asked_for.is_empty() { base.kept(KEPT)? } else { Some(format!("\"{asked_for}\"")) };
    let Some(text) = text else { return Ok(base.mission.approval.mode) };
    serde_json::from_str(&text).with_context(|| format!("{text} is not a mode: autonomous, approve or hold"))
}
