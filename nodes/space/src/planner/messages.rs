//! The planner's messages.

use swath_msgs::swath_msgs as msg;
use swath_node::error::MessageError;
use swath_node::messages::strip::acquisition;
use swath_node::messages::task_result::kind_without_strip;
use swath_node::orders::mode_number;
use swath_node::stamp::{EARTH_FRAME, Stamper};
use swath_sim::planner::Decision;
use swath_sim::requests::catalogue::Candidate;
use swath_sim::task::Task;
use swath_sim::time::Tick;
use swath_sim::vehicle::model::Model;
use swath_sim::world::strip::StripId;
use swath_sim::world::windows::Window;

use super::logic::{Planned, PlannerLogic, Upcoming};

/// The candidates of a task.
///
/// # Errors
/// When there are too many, or one is no strip that can be flown.
pub fn upcoming(model: &Model, message: &msg::UpcomingStrips) -> Result<Upcoming, MessageError> {
    let (count, max) = (message.candidates.len(), model.config.planning.candidates);
    if count > max {
        return Err(MessageError::Candidates { count, max });
    }
    let candidates = message.candidates.iter().map(|candidate| {
        Ok(Candidate {
            id: StripId(candidate.strip.id),
            twin: (candidate.twin > 0).then_some(StripId(candidate.twin)),
            strip: acquisition(model, &candidate.strip, candidate.t_acq_ticks)?,
            t_acq: candidate.t_acq_ticks,
            window: Window { open: Tick(candidate.window_open_tick), close: Tick(candidate.window_close_tick) },
        })
    });
    Ok(Upcoming { task: message.task, candidates: candidates.collect::<Result<_, _>>()? })
}

/// The task of a decision; `strips` are the candidates as they came.
#[must_use]
pub fn imaging_task(stamper: &Stamper, planned: &Planned, strips: &[msg::Candidate]) -> msg::ImagingTask {
    let now = planned.situation.now;
    let mut task = msg::ImagingTask {
        header: stamper.header(now, EARTH_FRAME),
        task: planned.task,
        start_tick: now.0,
        ..msg::ImagingTask::default()
    };
    match (planned.decision, planned.kind) {
        (Decision::Image { candidate, .. }, Task::Image { t_pre, t_acq, .. }) => {
            task.kind = msg::ImagingTask::KIND_IMAGE;
            task.strip = strips.get(candidate).map(|candidate| candidate.strip.clone()).unwrap_or_default();
            task.t_pre_ticks = t_pre;
            task.t_acq_ticks = t_acq;
        }
        (_, kind) => {
            task.kind = kind_without_strip(kind.duty());
            task.wait_ticks = kind.ticks();
        }
    }
    task
}

/// What the planner may do by itself, and what it proposes; `strip` is the one proposed.
#[must_use]
pub fn planner_status(stamper: &Stamper, now: Tick, logic: &PlannerLogic, strip: msg::Strip) -> msg::PlannerStatus {
    let gate = logic.gate();
    let status = msg::PlannerStatus {
        header: stamper.header(now, EARTH_FRAME),
        mode: mode_number(gate.mode()),
        planner: logic.planner_name(),
        last_outcome: gate.last_outcome().to_owned(),
        ..msg::PlannerStatus::default()
    };
    let Some(proposal) = gate.proposal() else { return status };
    msg::PlannerStatus {
        proposal_state: if proposal.approved {
            msg::PlannerStatus::PROPOSAL_APPROVED
        } else {
            msg::PlannerStatus::PROPOSAL_OPEN
        },
        proposal: proposal.number,
        strip,
        t_pre_ticks: proposal.t_pre,
        t_pre_s: stamper.seconds(proposal.t_pre),
        window_close_tick: proposal.candidate.window.close.0,
        window_close: stamper.time(proposal.candidate.window.close),
        deadline: proposal.deadline.map(|deadline| stamper.time(deadline)).unwrap_or_default(),
        deadline_tick: proposal.deadline.map_or(0, |deadline| deadline.0),
        ..status
    }
}

/// How the planner chose.
#[must_use]
pub fn decision(stamper: &Stamper, planned: &Planned, upcoming: &Upcoming, compute_time_s: f64) -> msg::Decision {
    let (chosen, t_pre_ticks) = match planned.decision {
        Decision::Image { candidate, t_pre } => (candidate as u32, t_pre),
        Decision::Wait { .. } | Decision::Serve { .. } => (upcoming.candidates.len() as u32, 0),
    };
    let mut rationale = planned.rationale.clone().unwrap_or_default();
    rationale.probabilities.truncate(upcoming.candidates.len());
    msg::Decision {
        header: stamper.header(planned.situation.now, EARTH_FRAME),
        task: planned.task,
        planner: planned.planner.clone(),
        policy_hash: rationale.policy,
        candidate_ids: upcoming.candidates.iter().map(|candidate| candidate.id.0).collect::<Vec<_>>(),
        probabilities: rationale.probabilities,
        value: rationale.value,
        chosen,
        t_pre_ticks,
        compute_time_s,
    }
}
