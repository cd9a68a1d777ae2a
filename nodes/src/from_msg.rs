//! From messages to the simulation's types; everything that came from outside is checked here.

pub mod requests;

use nalgebra::Vector3;
use swath_msgs::geometry_msgs;
use swath_msgs::swath_msgs as msg;
use swath_sim::catalogue::Candidate;
use swath_sim::dynamics::BodyState;
use swath_sim::env::TaskRecord;
use swath_sim::error::StripError;
use swath_sim::flight::Situation;
use swath_sim::guidance::{FailureReason, Task, TaskOutcome};
use swath_sim::model::Model;
use swath_sim::strip::{Strip, StripId, StripRequest};
use swath_sim::time::Tick;
use swath_sim::windows::Window;
use thiserror::Error;

use crate::approval::Mode;
use crate::guidance::logic::TaskOrder;
use crate::planner::logic::Upcoming;
use crate::spacecraft::logic::StateSample;

/// Why a message is not taken.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum MessageError {
    /// A number is NaN, infinite or absurd.
    #[error("{field} is {value}, the limit is ±{limit}")]
    Number {
        /// Field of the message.
        field: &'static str,
        /// Value given.
        value: f64,
        /// Largest magnitude.
        limit: f64,
    },
    /// A constant that the interface does not know.
    #[error("{field} is {value}, which is none of its constants")]
    Constant {
        /// Field of the message.
        field: &'static str,
        /// Value given.
        value: u8,
    },
    /// Too many candidates.
    #[error("{count} candidates were offered, the limit is {max}")]
    Candidates {
        /// Number given.
        count: usize,
        /// Most allowed.
        max: usize,
    },
    /// A task of another length than its strip.
    #[error("acquisition of strip {strip} takes {expected} ticks, the message says {given}")]
    AcquisitionTime {
        /// Number of the strip.
        strip: u64,
        /// Ticks that the strip takes.
        expected: u32,
        /// Ticks given.
        given: u32,
    },
    /// A strip that cannot be flown.
    #[error("strip {strip}: {source}")]
    Strip {
        /// Number of the strip.
        strip: u64,
        /// Why.
        source: StripError,
    },
}

/// Largest number in a task's result.
const RESULT_MAX: f64 = 1e3;
/// Largest position [m], velocity [m/s], rate [rad/s], wheel speed [rad/s] and torque [N m] that make sense.
const POSITION_MAX: f64 = 1e8;
const VELOCITY_MAX: f64 = 1e5;
const RATE_MAX: f64 = 100.0;
const WHEEL_SPEED_MAX: f64 = 1e5;
const TORQUE_MAX: f64 = 1e3;

fn checked(field: &'static str, v: [f64; 3], limit: f64) -> Result<Vector3<f64>, MessageError> {
    match v.into_iter().find(|value| value.is_nan() || value.abs() > limit) {
        Some(value) => Err(MessageError::Number { field, value, limit }),
        None => Ok(Vector3::from(v)),
    }
}

fn components(v: &geometry_msgs::Vector3) -> [f64; 3] {
    [v.x, v.y, v.z]
}

/// The spacecraft's state.
///
/// # Errors
/// When a number is not finite or absurd.
pub fn spacecraft_state(state: &msg::SpacecraftState) -> Result<StateSample, MessageError> {
    Ok(StateSample {
        tick: Tick(state.tick),
        r_BN_N: checked("r_bn_n", components(&state.r_bn_n), POSITION_MAX)?,
        v_BN_N: checked("v_bn_n", components(&state.v_bn_n), VELOCITY_MAX)?,
        body: BodyState {
            sigma_BN: checked("sigma_bn", state.sigma_bn, 1.0 + 1e-9)?,
            omega_BN_B: checked("omega_bn_b", components(&state.omega_bn_b), RATE_MAX)?,
            wheel_speed: checked("wheel_speed", state.wheel_speed, WHEEL_SPEED_MAX)?,
        },
        torque_applied: checked("wheel_torque", state.wheel_torque, TORQUE_MAX)?,
    })
}

/// What a planner may know of the satellite.
///
/// # Errors
/// When a number is not finite or absurd.
pub fn situation(point: &msg::DecisionPoint) -> Result<Situation, MessageError> {
    let state = spacecraft_state(&point.state)?;
    Ok(Situation {
        now: Tick(point.tick),
        r_BN_N: state.r_BN_N,
        v_BN_N: state.v_BN_N,
        body: state.body,
        servo_integral: checked("servo_integral", point.servo_integral, RATE_MAX)?,
        torque_pending: checked("torque_pending", point.torque_pending, TORQUE_MAX)?,
    })
}

/// The task that just ended.
///
/// # Errors
/// When a constant is unknown.
pub fn task_record(result: &msg::TaskResult) -> Result<TaskRecord, MessageError> {
    let failure = match result.reason {
        msg::TaskResult::REASON_NONE => None,
        msg::TaskResult::REASON_ATTITUDE => Some(FailureReason::Attitude),
        msg::TaskResult::REASON_ELEVATION => Some(FailureReason::Elevation),
        msg::TaskResult::REASON_INTERRUPTED => Some(FailureReason::Interrupted),
        value => return Err(MessageError::Constant { field: "reason", value }),
    };
    let numbers = [result.max_attitude_error, result.min_elevation, result.reward];
    checked("task result", numbers, RESULT_MAX)?;
    Ok(TaskRecord {
        task: result.task,
        start: Tick(result.start_tick),
        end: Tick(result.end_tick),
        strip: (result.kind == msg::ImagingTask::KIND_IMAGE).then_some(StripId(result.strip_id)),
        t_pre: result.t_pre_ticks,
        t_acq: result.t_acq_ticks,
        outcome: TaskOutcome {
            failure,
            max_attitude_error: result.max_attitude_error,
            min_elevation: result.min_elevation,
        },
        reward: result.reward,
    })
}

/// What a strip asks for.
#[must_use]
pub fn request_of_strip(strip: &msg::Strip) -> StripRequest {
    StripRequest {
        start_latitude_deg: strip.start_latitude_deg,
        start_longitude_deg: strip.start_longitude_deg,
        end_latitude_deg: strip.end_latitude_deg,
        end_longitude_deg: strip.end_longitude_deg,
        priority: strip.priority,
        acquisition_speed_m_s: strip.acquisition_speed,
        bidirectional: false,
    }
}

fn strip(model: &Model, strip: &msg::Strip) -> Result<Strip, MessageError> {
    request_of_strip(strip)
        .to_strip(&model.config.requests, model.config.earth.radius_m)
        .map_err(|source| MessageError::Strip { strip: strip.id, source })
}

fn acquisition(model: &Model, message: &msg::Strip, given: u32) -> Result<Strip, MessageError> {
    let strip = strip(model, message)?;
    let expected = strip.acquisition_ticks(model.period);
    if expected != given {
        return Err(MessageError::AcquisitionTime { strip: message.id, expected, given });
    }
    Ok(strip)
}

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
            strip: acquisition(model, &candidate.strip, candidate.t_acq_ticks)?,
            t_acq: candidate.t_acq_ticks,
            window: Window { open: Tick(candidate.window_open_tick), close: Tick(candidate.window_close_tick) },
        })
    });
    Ok(Upcoming { task: message.task, candidates: candidates.collect::<Result<_, _>>()? })
}

/// A task as guidance takes it.
///
/// # Errors
/// When its kind is unknown or its strip cannot be flown.
pub fn task_order(model: &Model, message: &msg::ImagingTask) -> Result<TaskOrder, MessageError> {
    let (kind, named) = match message.kind {
        msg::ImagingTask::KIND_IMAGE => {
            let strip = acquisition(model, &message.strip, message.t_acq_ticks)?;
            let kind = Task::Image { strip, t_pre: message.t_pre_ticks, t_acq: message.t_acq_ticks };
            (kind, Some((StripId(message.strip.id), message.strip.name.clone())))
        }
        msg::ImagingTask::KIND_WAIT => (Task::Wait { ticks: message.wait_ticks }, None),
        value => return Err(MessageError::Constant { field: "kind", value }),
    };
    Ok(TaskOrder { task: message.task, kind, strip: named })
}

/// What the planner may do by itself.
///
/// # Errors
/// When the mode is none of the constants.
pub fn planner_mode(mode: u8) -> Result<Mode, MessageError> {
    match mode {
        msg::PlannerStatus::MODE_AUTONOMOUS => Ok(Mode::Autonomous),
        msg::PlannerStatus::MODE_APPROVE => Ok(Mode::Approve),
        msg::PlannerStatus::MODE_HOLD => Ok(Mode::Hold),
        value => Err(MessageError::Constant { field: "mode", value }),
    }
}
