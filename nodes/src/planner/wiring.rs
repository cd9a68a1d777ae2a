//! The planner node's topics and alarms.

use std::time::{Duration, Instant};

use anyhow::Result;
use swath_msgs::swath_msgs as msg;
use swath_ros::Spec;
use swath_ros::{Publisher, Subscription, graph};
use swath_sim::planner::{Planner, PlannerSpec};

use super::logic::{Planned, PlannerLogic};
use crate::node::{MissionNode, Severity};
use crate::planners::{GuardedPlanner, PlannerMaker};
use crate::{from_msg, to_msg};

/// Nothing happens by itself: the node only looks whether it is asked to end.
const IDLE: Duration = Duration::from_millis(500);

/// Runs the planner node until it is asked to end.
///
/// # Errors
/// When the node cannot come up or DDS fails.
pub fn run(maker: PlannerMaker) -> Result<()> {
    let mut node = PlannerNode::new(MissionNode::start(graph::PLANNER)?, maker)?;
    while !node.base.shutdown.asked() {
        node.turn()?;
    }
    Ok(())
}

struct PlannerNode {
    logic: PlannerLogic,
    points: Subscription<msg::DecisionPoint>,
    upcoming: Subscription<msg::UpcomingStrips>,
    tasks: Publisher<msg::ImagingTask>,
    decisions: Publisher<msg::Decision>,
    strips: Vec<msg::Candidate>,
    last: Option<msg::ImagingTask>,
    /// Alarm to raise at the first decision point: before, nobody may be listening yet.
    missing: Option<(String, String)>,
    base: MissionNode,
}

impl PlannerNode {
    fn new(base: MissionNode, maker: PlannerMaker) -> Result<Self> {
        let name = Spec::new("planner", base.mission.planner.to_string(), "As the mission file names planners.");
        let spec: PlannerSpec = base.node.parameters().declare(name.read_only())?.parse()?;
        base.node.parameters().check_given()?;
        let planner = GuardedPlanner::make(maker, &spec, base.mission.seed);
        let missing = planner
            .missing()
            .map(|reason| (format!("no planner {spec}"), format!("{reason}; {} takes over", planner.name())));
        Ok(Self {
            logic: PlannerLogic::new((*base.model).clone(), planner),
            points: base.node.subscription(&graph::DECISION_POINT)?,
            upcoming: base.node.subscription(&graph::UPCOMING_STRIPS)?,
            tasks: base.node.publisher(&graph::PLANNER_TASK)?,
            decisions: base.node.publisher(&graph::PLANNER_DECISION)?,
            strips: Vec::new(),
            last: None,
            missing,
            base,
        })
    }

    fn turn(&mut self) -> Result<()> {
        while let Some(point) = self.points.take()? {
            if point.mission_over {
                continue;
            }
            if let Some((name, text)) = self.missing.take() {
                self.base.alarm(Severity::Error, &name, &text)?;
            }
            // The question again: the answer may have been lost.
            if let Some(last) = self.last.as_ref().filter(|last| last.task == point.task) {
                self.tasks.publish(last)?;
                continue;
            }
            let started = Instant::now();
            match from_msg::situation(&point) {
                Ok(situation) => {
                    let planned = self.logic.on_decision_point(point.task, situation);
                    self.publish(planned, started)?;
                }
                Err(error) => self.base.alarm(Severity::Error, "decision point refused", &error.to_string())?,
            }
        }
        while let Some(message) = self.upcoming.take()? {
            let started = Instant::now();
            match from_msg::upcoming(&self.base.model, &message) {
                Ok(upcoming) => {
                    self.strips = message.candidates.to_vec();
                    let planned = self.logic.on_upcoming(upcoming);
                    self.publish(planned, started)?;
                }
                Err(error) => self.base.alarm(Severity::Error, "candidates refused", &error.to_string())?,
            }
        }
        self.base.node.wait(IDLE)?;
        Ok(())
    }

    fn publish(&mut self, planned: Option<Planned>, started: Instant) -> Result<()> {
        let (Some(planned), Some(upcoming)) = (planned, self.logic.upcoming()) else { return Ok(()) };
        self.base.set_now(planned.situation.now);
        if let Some(fault) = &planned.fault {
            let text = format!("{fault}; {} takes over", planned.planner);
            self.base.alarm(Severity::Error, "planner failed", &text)?;
        }
        let task = to_msg::imaging_task(&self.base.stamper, &planned, &self.strips);
        self.tasks.publish(&task)?;
        let compute_time_s = started.elapsed().as_secs_f64();
        self.decisions.publish(&to_msg::decision(&self.base.stamper, &planned, upcoming, compute_time_s))?;
        self.last = Some(task);
        Ok(())
    }
}
