//! From the simulation's types to messages; nothing can go wrong here.

pub mod requests;

use nalgebra::Vector3;
use swath_msgs::builtin_interfaces::Time;
use swath_msgs::geometry_msgs;
use swath_msgs::std_msgs::Header;
use swath_msgs::swath_msgs as msg;
use swath_sim::catalogue::Candidate;
use swath_sim::guidance::{FailureReason, Task};
use swath_sim::planner::Decision;
use swath_sim::time::{Tick, TickPeriod};

use crate::approval::Mode;
use crate::guidance::logic::{Command, DecisionPoint, FinishedTask};
use crate::planner::logic::{Planned, PlannerLogic, Upcoming};
use crate::requests::logic::Offer;
use crate::requests_file::NamedRequest;
use crate::spacecraft::logic::StateSample;

/// Turns ticks into stamps.
#[derive(Clone, Copy, Debug)]
pub struct Stamper {
    epoch_unix_s: u32,
    period: TickPeriod,
}

/// Name of the inertial frame N in headers.
pub const INERTIAL_FRAME: &str = "eci";
/// Name of the planet-fixed frame E in headers.
pub const EARTH_FRAME: &str = "ecef";
/// Name of the body frame B in headers.
pub const BODY_FRAME: &str = "body";

impl Stamper {
    /// A stamper for a mission's epoch.
    #[must_use]
    pub fn new(epoch_unix_s: u32, period: TickPeriod) -> Self {
        Self { epoch_unix_s, period }
    }

    /// Simulated time of a tick [ns since 1970-01-01 UTC].
    #[must_use]
    pub fn nanoseconds(&self, tick: Tick) -> u64 {
        u64::from(self.epoch_unix_s) * 1_000_000_000 + tick.0 * self.period.nanoseconds()
    }

    /// Simulated time of a tick.
    #[must_use]
    pub fn time(&self, tick: Tick) -> Time {
        swath_ros::stamp(self.nanoseconds(tick))
    }

    /// The first tick at a time or after it; the epoch for times before it.
    #[must_use]
    pub fn tick_from(&self, time: &Time) -> Tick {
        let ns = nanoseconds(time).saturating_sub(self.nanoseconds(Tick(0)));
        Tick(ns.div_ceil(self.period.nanoseconds()))
    }

    /// Header of a message at a tick.
    #[must_use]
    pub fn header(&self, tick: Tick, frame: &str) -> Header {
        Header { stamp: self.time(tick), frame_id: frame.to_owned() }
    }
}

/// A time [ns since 1970-01-01 UTC]; 0 for times before.
#[must_use]
pub fn nanoseconds(time: &Time) -> u64 {
    u64::try_from(time.sec).map_or(0, |seconds| seconds * 1_000_000_000 + u64::from(time.nanosec))
}

/// A vector by its components.
#[must_use]
pub fn vector3(v: &Vector3<f64>) -> geometry_msgs::Vector3 {
    geometry_msgs::Vector3 { x: v.x, y: v.y, z: v.z }
}

/// The spacecraft's state.
#[must_use]
pub fn spacecraft_state(stamper: &Stamper, sample: &StateSample) -> msg::SpacecraftState {
    msg::SpacecraftState {
        header: stamper.header(sample.tick, INERTIAL_FRAME),
        tick: sample.tick.0,
        r_bn_n: vector3(&sample.r_BN_N),
        v_bn_n: vector3(&sample.v_BN_N),
        sigma_bn: sample.body.sigma_BN.into(),
        omega_bn_b: vector3(&sample.body.omega_BN_B),
        wheel_speed: sample.body.wheel_speed.into(),
        wheel_torque: sample.torque_applied.into(),
    }
}

/// A torque command with the tracking error that it rests on.
#[must_use]
pub fn wheel_torque(stamper: &Stamper, command: &Command) -> msg::WheelTorque {
    let guidance = &command.guidance;
    msg::WheelTorque {
        header: stamper.header(command.tick, BODY_FRAME),
        tick: command.tick.0,
        torque: guidance.torque.into(),
        task: command.task,
        phase: phase(command),
        sigma_br: guidance.error.sigma_BR.into(),
        omega_br_b: vector3(&guidance.error.omega_BR_B),
        attitude_error: guidance.error.sigma_BR.norm(),
        elevation: guidance.elevation(),
    }
}

fn phase(command: &Command) -> u8 {
    match (command.has_strip, command.guidance.imaging) {
        (false, _) => msg::WheelTorque::PHASE_HOLD,
        (true, false) => msg::WheelTorque::PHASE_TRANSITION,
        (true, true) => msg::WheelTorque::PHASE_IMAGING,
    }
}

/// What guidance is doing; `strip` is the number and name of the strip in hand.
#[must_use]
pub fn guidance_status(stamper: &Stamper, command: &Command, strip: Option<(u64, &str)>) -> msg::GuidanceStatus {
    let (strip_id, strip_name) = strip.unwrap_or_default();
    msg::GuidanceStatus {
        header: stamper.header(command.tick, BODY_FRAME),
        tick: command.tick.0,
        task: command.task,
        phase: phase(command),
        strip_id,
        strip_name: strip_name.to_owned(),
        attitude_error: command.guidance.error.sigma_BR.norm(),
        elevation: command.guidance.elevation(),
        remaining_ticks: command.remaining,
    }
}

/// A task is wanted.
#[must_use]
pub fn decision_point(stamper: &Stamper, point: &DecisionPoint) -> msg::DecisionPoint {
    let state = spacecraft_state(stamper, &point.state);
    msg::DecisionPoint {
        header: state.header.clone(),
        tick: point.state.tick.0,
        task: point.task,
        state,
        servo_integral: point.situation.servo_integral.into(),
        torque_pending: point.situation.torque_pending.into(),
        mission_over: point.mission_over,
        result: point.finished.as_ref().map(task_result).into_iter().collect::<Vec<_>>(),
        last_imaging: point.last_imaging.as_ref().map(task_result).into_iter().collect::<Vec<_>>(),
    }
}

/// How a task went.
#[must_use]
pub fn task_result(finished: &FinishedTask) -> msg::TaskResult {
    let record = &finished.record;
    msg::TaskResult {
        task: record.task,
        start_tick: record.start.0,
        end_tick: record.end.0,
        kind: if record.strip.is_some() { msg::ImagingTask::KIND_IMAGE } else { msg::ImagingTask::KIND_WAIT },
        strip_id: record.strip.map_or(0, |id| id.0),
        strip_name: finished.name.clone(),
        t_pre_ticks: record.t_pre,
        t_acq_ticks: record.t_acq,
        success: record.success(),
        reason: match record.outcome.failure {
            None => msg::TaskResult::REASON_NONE,
            Some(FailureReason::Attitude) => msg::TaskResult::REASON_ATTITUDE,
            Some(FailureReason::Elevation) => msg::TaskResult::REASON_ELEVATION,
            Some(FailureReason::Interrupted) => msg::TaskResult::REASON_INTERRUPTED,
        },
        max_attitude_error: record.outcome.max_attitude_error,
        min_elevation: record.outcome.min_elevation,
        reward: record.reward,
    }
}

/// A strip in a request's own degrees.
#[must_use]
pub fn strip(id: u64, named: &NamedRequest) -> msg::Strip {
    let request = &named.request;
    msg::Strip {
        id,
        name: named.name.clone(),
        start_latitude_deg: request.start_latitude_deg,
        start_longitude_deg: request.start_longitude_deg,
        end_latitude_deg: request.end_latitude_deg,
        end_longitude_deg: request.end_longitude_deg,
        priority: request.priority,
        acquisition_speed: request.acquisition_speed_m_s,
    }
}

/// What the planner is offered; `request` gives what was asked for under an identity.
#[must_use]
pub fn upcoming_strips<'a>(
    stamper: &Stamper,
    offer: &Offer,
    request: impl Fn(&Candidate) -> Option<&'a NamedRequest>,
) -> msg::UpcomingStrips {
    let candidates = offer.candidates.iter().filter_map(|candidate| {
        Some(msg::Candidate {
            strip: strip(candidate.id.0, request(candidate)?),
            window_open_tick: candidate.window.open.0,
            window_close_tick: candidate.window.close.0,
            t_acq_ticks: candidate.t_acq,
        })
    });
    msg::UpcomingStrips {
        header: stamper.header(offer.tick, EARTH_FRAME),
        tick: offer.tick.0,
        task: offer.task,
        candidates: candidates.collect::<Vec<_>>(),
        pending: offer.pending as u64,
        fulfilled: offer.fulfilled as u64,
    }
}

/// The task in hand enters a phase.
#[must_use]
pub fn task_phase(stamper: &Stamper, command: &Command, strip: u64) -> msg::TaskPhase {
    msg::TaskPhase {
        header: stamper.header(command.tick, BODY_FRAME),
        tick: command.tick.0,
        task: command.task,
        strip_id: strip,
        phase: phase(command),
    }
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
            task.kind = msg::ImagingTask::KIND_WAIT;
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
        mode: match gate.mode() {
            Mode::Autonomous => msg::PlannerStatus::MODE_AUTONOMOUS,
            Mode::Approve => msg::PlannerStatus::MODE_APPROVE,
            Mode::Hold => msg::PlannerStatus::MODE_HOLD,
        },
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
        window_close_tick: proposal.candidate.window.close.0,
        deadline_tick: proposal.deadline.map_or(0, |deadline| deadline.0),
        ..status
    }
}

/// How the planner chose.
#[must_use]
pub fn decision(stamper: &Stamper, planned: &Planned, upcoming: &Upcoming, compute_time_s: f64) -> msg::Decision {
    let (chosen, t_pre_ticks) = match planned.decision {
        Decision::Image { candidate, t_pre } => (candidate as u32, t_pre),
        Decision::Wait { .. } => (upcoming.candidates.len() as u32, 0),
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
