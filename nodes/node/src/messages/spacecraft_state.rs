//! The spacecraft's state as a message, and back.

use swath_msgs::swath_msgs as msg;
use swath_sim::time::Tick;
use swath_sim::vehicle::dynamics::BodyState;
use swath_sim::vehicle::spacecraft::StateSample;

use super::numbers::{RATE_MAX, TORQUE_MAX, checked, components, vector3};
use super::resource_state::{resource_message, resource_state};
use crate::error::MessageError;
use crate::stamp::{INERTIAL_FRAME, Stamper};

/// Largest position [m], velocity [m/s] and wheel speed [rad/s] that make sense.
const POSITION_MAX: f64 = 1e8;
const VELOCITY_MAX: f64 = 1e5;
const WHEEL_SPEED_MAX: f64 = 1e5;

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
        resources: sample.resources.iter().map(|it| resource_message(stamper, sample.tick, it)).collect::<Vec<_>>(),
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
        resources: state.resources.first().map(resource_state).transpose()?,
    })
}
