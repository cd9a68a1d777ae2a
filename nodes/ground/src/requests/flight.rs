//! The request manager's topics where ground and satellite are one: it answers guidance and the planner itself.

use anyhow::{Result, bail};
use swath_mission::requests::lifecycle::State;
use swath_mission::requests::logic::{Abort, RequestLogic};
use swath_msgs::swath_msgs as msg;
use swath_node::messages::decision_point::situation;
use swath_node::messages::task_result::task_record;
use swath_node::messages::upcoming::upcoming_strips;
use swath_node::node::{MissionNode, Severity};
use swath_ros::{Publisher, Subscription, graph};
use swath_sim::time::Tick;
use swath_sim::world::strip::StripId;

use super::messages;
use super::outgoing::Outgoing;
use super::store::Store;

/// The topics of guidance and planner.
pub(super) struct FlightSide {
    points: Subscription<msg::DecisionPoint>,
    tasks: Subscription<msg::ImagingTask>,
    phases: Subscription<msg::TaskPhase>,
    upcoming: Publisher<msg::UpcomingStrips>,
    results: Publisher<msg::TaskResult>,
    /// Tasks below this number have been told of.
    told: u64,
    aborts: Publisher<msg::TaskAbort>,
    last: Option<msg::UpcomingStrips>,
}

impl FlightSide {
    pub(super) fn new(base: &MissionNode) -> Result<Self> {
        Ok(Self {
            points: base.node.subscription(&graph::DECISION_POINT)?,
            tasks: base.node.subscription(&graph::PLANNER_TASK)?,
            phases: base.node.subscription(&graph::TASK_PHASE)?,
            upcoming: base.node.publisher(&graph::UPCOMING_STRIPS)?,
            results: base.node.publisher(&graph::TASK_RESULTS)?,
            told: 0,
            aborts: base.node.publisher(&graph::TASK_ABORT)?,
            last: None,
        })
    }

    /// Whether the mission has begun.
    pub(super) fn begun(&self) -> bool {
        self.last.is_some()
    }

    /// The next question of guidance.
    pub(super) fn next(&mut self) -> Result<Option<msg::DecisionPoint>> {
        Ok(self.points.take()?)
    }

    /// Answers a question of guidance. One who rests offers nothing; guidance asks again.
    pub(super) fn answer(
        &mut self,
        point: &msg::DecisionPoint,
        offers: bool,
        logic: &mut RequestLogic,
        base: &MissionNode,
        store: &Store,
        outgoing: &mut Vec<Outgoing>,
    ) -> Result<()> {
        if base.strikes_at().is_some_and(|at| Tick(point.tick) >= at) {
            base.strike();
        }
        let offer = self.offer(logic, base, store, point)?;
        outgoing.extend(self.results(logic, point).into_iter().map(|result| Outgoing::Result(Box::new(result))));
        outgoing.extend(offer.filter(|_| offers).map(|offer| Outgoing::Offer(Box::new(offer))));
        if point.mission_over {
            outgoing.push(Outgoing::Summary);
        }
        Ok(())
    }

    /// Takes what the planner has chosen, and how far guidance is with it.
    pub(super) fn take_tasks(&self, logic: &mut RequestLogic, base: &MissionNode) -> Result<()> {
        while let Some(task) = self.tasks.take()? {
            if let Some(flown) = messages::in_flight(&task) {
                logic.on_task(flown);
            }
        }
        while let Some(phase) = self.phases.take()? {
            match base.tick(phase.tick) {
                Ok(tick) if phase.phase == msg::WheelTorque::PHASE_IMAGING => logic.on_imaging(phase.task, tick),
                Ok(_) => {}
                Err(error) => base.alarm(Severity::Error, "phase refused", &error.to_string())?,
            }
        }
        Ok(())
    }

    fn offer(
        &mut self,
        logic: &mut RequestLogic,
        base: &MissionNode,
        store: &Store,
        point: &msg::DecisionPoint,
    ) -> Result<Option<msg::UpcomingStrips>> {
        // The question again: the answer may have been lost.
        if let Some(last) = self.last.as_ref().filter(|last| last.task == point.task && !point.mission_over) {
            return Ok(Some(last.clone()));
        }
        let now = match base.tick(point.tick) {
            Ok(now) => now,
            Err(error) => {
                base.alarm(Severity::Error, "decision point refused", &error.to_string())?;
                return Ok(None);
            }
        };
        if now < logic.now() && self.last.is_none() {
            if base.goes_on() {
                // A reader that comes late is sent what the writer still holds.
                tracing::debug!("a decision point of {now} is old");
                return Ok(None);
            }
            let known = logic.now();
            bail!("store {} is of a flight that is at {known}, this one is at {now}", store.path().display());
        }
        base.set_now(now);
        let results = point.result.iter().chain(&point.last_imaging).map(task_record);
        let results = match results.collect::<Result<Vec<_>, _>>() {
            Ok(results) => results,
            Err(error) => {
                base.alarm(Severity::Error, "task result refused", &error.to_string())?;
                return Ok(None);
            }
        };
        match situation(point) {
            Ok(situation) => logic.set_situation(situation),
            Err(error) => base.alarm(Severity::Error, "decision point refused", &error.to_string())?,
        }
        let offer = logic.on_decision_point(point.task, now, &results);
        let order = |id: StripId| logic.request(id).map(|request| &request.order);
        let message = upcoming_strips(&base.stamper, &offer, |candidate| order(candidate.id));
        self.last = Some(message.clone());
        Ok((!point.mission_over).then_some(message))
    }

    /// The tasks that nobody was told of yet, with their rewards.
    fn results(&mut self, logic: &RequestLogic, point: &msg::DecisionPoint) -> Vec<msg::TaskResult> {
        let told = self.told;
        let ended = point.last_imaging.iter().chain(&point.result);
        let mut results: Vec<_> = ended.filter(|result| result.task >= told).cloned().collect();
        results.dedup_by_key(|result| result.task);
        for result in &mut results {
            result.reward = logic.reward_of(result.task);
            self.told = self.told.max(result.task + 1);
        }
        results
    }

    pub(super) fn send_offer(&self, offer: &msg::UpcomingStrips) -> Result<()> {
        Ok(self.upcoming.publish(offer)?)
    }

    pub(super) fn send_result(&self, result: &msg::TaskResult) -> Result<()> {
        Ok(self.results.publish(result)?)
    }

    pub(super) fn tell_aborts(&self, logic: &mut RequestLogic, base: &MissionNode) -> Result<()> {
        for abort in logic.take_aborts() {
            let Abort { task, id } = abort;
            let state = logic.state(id).map_or("unknown", State::name);
            let reason = format!("request {} is {state}", id.0);
            tracing::info!("task {task} should be given up: {reason}");
            self.aborts.publish(&messages::task_abort(&base.stamper, logic.now(), abort, reason))?;
        }
        Ok(())
    }
}
