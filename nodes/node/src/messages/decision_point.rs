//! What a planner may know of the satellite, from the message that asks for a task.

use swath_msgs::swath_msgs as msg;
use swath_sim::time::Tick;
use swath_sim::vehicle::flight::Situation;

use super::numbers::{RATE_MAX, TORQUE_MAX, checked};
use super::spacecraft_state::state_sample;
use crate::error::MessageError;

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
        resources: state.resources,
    })
}
