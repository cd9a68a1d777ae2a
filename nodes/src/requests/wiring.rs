//! The request manager's topics, service and store of offers.

use std::time::Duration;

use anyhow::Result;
use swath_msgs::swath_msgs as msg;
use swath_ros::{Publisher, Server, Subscription, graph};
use swath_sim::strip::StripId;
use swath_sim::time::Tick;

use super::logic::{Refusal, RequestLogic};
use crate::node::{MissionNode, Severity};
use crate::requests_file::NamedRequest;
use crate::{from_msg, to_msg};

/// Nothing happens by itself: the node only looks whether it is asked to end.
const IDLE: Duration = Duration::from_millis(500);
/// Most requests in one call of the service.
const BATCH_MAX: usize = 100_000;

/// Runs the request manager until it is asked to end.
///
/// # Errors
/// When the node cannot come up, the mission's requests cannot be read, or DDS fails.
pub fn run() -> Result<()> {
    let mut node = RequestNode::new(MissionNode::start(graph::REQUEST_MANAGER)?)?;
    while !node.base.shutdown.asked() {
        node.turn()?;
    }
    Ok(())
}

struct RequestNode {
    logic: RequestLogic,
    points: Subscription<msg::DecisionPoint>,
    tasks: Subscription<msg::ImagingTask>,
    requests: Subscription<msg::StripRequest>,
    submit: Server<msg::SubmitStrips>,
    upcoming: Publisher<msg::UpcomingStrips>,
    events: Publisher<msg::StripStatus>,
    summary: Publisher<msg::RequestSummary>,
    last: Option<msg::UpcomingStrips>,
    base: MissionNode,
}

impl RequestNode {
    fn new(base: MissionNode) -> Result<Self> {
        base.node.parameters().check_given()?;
        let mut logic = RequestLogic::new((*base.model).clone(), &base.mission.initial(), base.horizon);
        let requests = base.mission.initial_requests()?;
        let total = requests.len();
        let accepted = requests.into_iter().filter_map(|request| logic.submit(request).ok()).count();
        tracing::info!("{accepted} of the {total} strips known from the start are accepted");
        Ok(Self {
            logic,
            points: base.node.subscription(&graph::DECISION_POINT)?,
            tasks: base.node.subscription(&graph::PLANNER_TASK)?,
            requests: base.node.subscription(&graph::STRIP_REQUEST)?,
            submit: base.node.server(&graph::SUBMIT_STRIPS)?,
            upcoming: base.node.publisher(&graph::UPCOMING_STRIPS)?,
            events: base.node.publisher(&graph::STRIP_EVENTS)?,
            summary: base.node.publisher(&graph::REQUEST_SUMMARY)?,
            last: None,
            base,
        })
    }

    fn turn(&mut self) -> Result<()> {
        while let Some(point) = self.points.take()? {
            self.offer(&point)?;
        }
        while let Some(task) = self.tasks.take()? {
            if task.kind == msg::ImagingTask::KIND_IMAGE {
                self.logic.on_task(StripId(task.strip.id));
            }
        }
        while let Some(request) = self.requests.take()? {
            if let Err(refusal) = self.logic.submit(from_msg::named_request(&request)) {
                self.base.alarm(Severity::Warn, "request refused", &refusal.to_string())?;
            }
        }
        let logic = &mut self.logic;
        self.submit.answer_all(|call| answer(logic, call))?;
        // Before the mission begins nobody may be listening yet: changes wait for its first decision.
        if self.last.is_some() {
            self.tell_changes()?;
        }
        self.base.node.wait(IDLE)?;
        Ok(())
    }

    fn offer(&mut self, point: &msg::DecisionPoint) -> Result<()> {
        // The question again: the answer may have been lost.
        if let Some(last) = self.last.as_ref().filter(|last| last.task == point.task && !point.mission_over) {
            self.upcoming.publish(last)?;
            return Ok(());
        }
        let now = Tick(point.tick);
        self.base.set_now(now);
        let finished = match point.result.first().map(from_msg::task_record).transpose() {
            Ok(finished) => finished,
            Err(error) => return self.base.alarm(Severity::Error, "task result refused", &error.to_string()),
        };
        let offer = self.logic.on_decision_point(point.task, now, finished.as_ref());
        let logic = &self.logic;
        let message = to_msg::upcoming_strips(&self.base.stamper, &offer, |candidate| logic.request(candidate.id));
        if !point.mission_over {
            self.upcoming.publish(&message)?;
        }
        self.last = Some(message);
        self.tell_changes()?;
        let counts = self.logic.counts();
        let count = |standing| counts.get(&standing).copied().unwrap_or(0);
        self.summary.publish(&to_msg::request_summary(&self.base.stamper, now, count, self.logic.reward()))?;
        Ok(())
    }

    fn tell_changes(&mut self) -> Result<()> {
        for change in self.logic.take_changes() {
            self.events.publish(&to_msg::strip_status(&self.base.stamper, &change))?;
        }
        Ok(())
    }
}

fn answer(logic: &mut RequestLogic, call: msg::SubmitStripsRequest) -> msg::SubmitStripsResponse {
    let too_many = call.requests.len() > BATCH_MAX;
    let submit = |request: &msg::StripRequest| -> Result<StripId, Refusal> {
        if too_many {
            return Err(Refusal::Batch { count: call.requests.len(), max: BATCH_MAX });
        }
        let named: NamedRequest = from_msg::named_request(request);
        logic.submit(named)
    };
    let results = call.requests.iter().map(submit).map(|result| match result {
        Ok(id) => msg::SubmitResult { accepted: true, id: id.0, ..msg::SubmitResult::default() },
        Err(refusal) => {
            msg::SubmitResult { accepted: false, id: 0, reason_code: refusal.code(), reason: refusal.to_string() }
        }
    });
    msg::SubmitStripsResponse { results: results.collect::<Vec<_>>() }
}
