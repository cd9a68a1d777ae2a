//! Messages that more than one node reads or writes: checked coming in, infallible going out.

use nalgebra::Vector3;
use swath_msgs::{geometry_msgs, swath_msgs as msg};
use swath_sim::model::Model;
use swath_sim::task::{FailureReason, TaskOutcome, TaskRecord};
use swath_sim::time::Tick;
use swath_sim::vehicle::dynamics::BodyState;
use swath_sim::vehicle::flight::Situation;
use swath_sim::vehicle::spacecraft::StateSample;
use swath_sim::world::strip::{Strip, StripId};

use crate::error::MessageError;
use crate::orders::request_of_strip;
use crate::stamp::{INERTIAL_FRAME, Stamper};

/// Largest number in a task's result.
const RESULT_MAX: f64 = 1e3;
/// Largest position [m], velocity [m/s], rate [rad/s], wheel speed [rad/s] and torque [N m] that make sense.
const POSITION_MAX: f64 = 1e8;
const VELOCITY_MAX: f64 = 1e5;
const RATE_MAX: f64 = 100.0;
const WHEEL_SPEED_MAX: f64 = 1e5;
const TORQUE_MAX: f64 = 1e3;

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

/// The spacecraft's state.
///
/// # Errors
/// When a number is not finite or absurd.
pub fn state_sample(state: &msg::SpacecraftState) -> Result<StateSample, MessageError> {
    Ok(StateSample {
        tick: Tick(state.tick),
        r_BN_N: checked("r_bn_n", components(&state.r_bn_n), POSITION_MAX)?,
        v_BN_N: checked("v_bn_n", components(&state.v_bn_n), VELOCITY_MAX)?,
        truth: None,
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
    let state = state_sample(&point.state)?;
    Ok(Situation {
        now: Tick(point.tick),
        r_BN_N: state.r_BN_N,
        v_BN_N: state.v_BN_N,
        body: state.body,
        servo_integral: checked("servo_integral", point.servo_integral, RATE_MAX)?,
        torque_pending: checked("torque_pending", point.torque_pending, TORQUE_MAX)?,
        wheels: checked("wheel_share", point.wheel_share, 1.0)?.map(|share| share.max(0.0)),
        resources: None,
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
    checked("task result", [result.max_attitude_error, result.min_elevation, 0.0], RESULT_MAX)?;
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
    })
}

/// The strip of a message, whose acquisition takes `given` ticks.
///
/// # Errors
/// When the strip cannot be flown or takes another time.
pub fn acquisition(model: &Model, message: &msg::Strip, given: u32) -> Result<Strip, MessageError> {
    let strip = strip(model, message)?;
    let expected = strip.acquisition_ticks(model.period);
    if expected != given {
        return Err(MessageError::AcquisitionTime { strip: message.id, expected, given });
    }
    Ok(strip)
}

fn strip(model: &Model, strip: &msg::Strip) -> Result<Strip, MessageError> {
    request_of_strip(strip)
        .to_strip(&model.config.requests, model.config.earth.radius_m)
        .map_err(|source| MessageError::Strip { strip: strip.id, source })
}

fn checked(field: &'static str, v: [f64; 3], limit: f64) -> Result<Vector3<f64>, MessageError> {
    match v.into_iter().find(|value| value.is_nan() || value.abs() > limit) {
        Some(value) => Err(MessageError::Number { field, value, limit }),
        None => Ok(Vector3::from(v)),
    }
}

fn components(v: &geometry_msgs::Vector3) -> [f64; 3] {
    [v.x, v.y, v.z]
}
