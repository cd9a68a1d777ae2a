//! How power, data and momentum stand as a message, and back.

use swath_msgs::swath_msgs as msg;
use swath_sim::time::Tick;
use swath_sim::vehicle::resources::{Delivered, Failure, ResourceState};

use super::numbers::{checked, components, vector3};
use crate::error::MessageError;
use crate::stamp::{BODY_FRAME, Stamper};

/// Largest energy [J], power [W], dipole [A m²], momentum [N m s] and sum of priorities that make sense.
const ENERGY_MAX: f64 = 1e10;
const POWER_MAX: f64 = 1e7;
const DIPOLE_MAX: f64 = 1e6;
const MOMENTUM_MAX: f64 = 1e6;
const REWARD_MAX: f64 = 1e9;

/// How power, data and momentum stand at a tick.
#[must_use]
pub fn resource_message(stamper: &Stamper, tick: Tick, state: &ResourceState) -> msg::ResourceState {
    let (rise, set) = state.contact.unwrap_or((Tick(0), Tick(0)));
    msg::ResourceState {
        header: stamper.header(tick, BODY_FRAME),
        tick: tick.0,
        charge: state.charge_j,
        capacity: state.capacity_j,
        illumination: state.illumination,
        generated_power: state.generated_w,
        load_power: state.asked_w,
        stored_bits: state.stored_bits,
        to_send_bits: state.to_send_bits,
        storage_bits: state.storage_bits,
        in_contact: state.in_contact,
        has_contact: state.contact.is_some(),
        contact_rise_tick: rise.0,
        contact_set_tick: set.0,
        sent_bits: state.sent_bits,
        rod_dipole: vector3(&state.rod_dipole_B),
        wheel_momentum: state.momentum_nms,
        safe_mode: match state.safe_mode {
            None => msg::ResourceState::SAFE_MODE_NONE,
            Some(Failure::BatteryEmpty) => msg::ResourceState::SAFE_MODE_BATTERY_EMPTY,
            Some(Failure::WheelMomentum) => msg::ResourceState::SAFE_MODE_WHEEL_MOMENTUM,
        },
        delivered_strips: state.delivered.strips,
        delivered_reward: state.delivered.reward,
        failures: state.delivered.failures,
        floor_violations: state.delivered.floor_violations,
    }
}

/// How power, data and momentum stand.
///
/// # Errors
/// When a constant is unknown or a number is not finite or absurd.
pub fn resource_state(message: &msg::ResourceState) -> Result<ResourceState, MessageError> {
    checked("charge", [message.charge, message.capacity, 0.0], ENERGY_MAX)?;
    checked("power", [message.generated_power, message.load_power, message.illumination], POWER_MAX)?;
    checked("wheel_momentum", [message.wheel_momentum, 0.0, 0.0], MOMENTUM_MAX)?;
    checked("delivered_reward", [message.delivered_reward, 0.0, 0.0], REWARD_MAX)?;
    Ok(ResourceState {
        charge_j: message.charge,
        capacity_j: message.capacity,
        illumination: message.illumination,
        generated_w: message.generated_power,
        asked_w: message.load_power,
        stored_bits: message.stored_bits,
        to_send_bits: message.to_send_bits,
        storage_bits: message.storage_bits,
        in_contact: message.in_contact,
        contact: message.has_contact.then_some((Tick(message.contact_rise_tick), Tick(message.contact_set_tick))),
        sent_bits: message.sent_bits,
        rod_dipole_B: checked("rod_dipole", components(&message.rod_dipole), DIPOLE_MAX)?,
        momentum_nms: message.wheel_momentum,
        safe_mode: match message.safe_mode {
            msg::ResourceState::SAFE_MODE_NONE => None,
            msg::ResourceState::SAFE_MODE_BATTERY_EMPTY => Some(Failure::BatteryEmpty),
            msg::ResourceState::SAFE_MODE_WHEEL_MOMENTUM => Some(Failure::WheelMomentum),
            value => return Err(MessageError::Constant { field: "safe_mode", value }),
        },
        delivered: Delivered {
            strips: message.delivered_strips,
            reward: message.delivered_reward,
            failures: message.failures,
            floor_violations: message.floor_violations,
        },
    })
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;
    use swath_sim::time::TickPeriod;

    use super::*;

    #[test]
    fn states_come_back_to_the_bit_and_nonsense_is_refused() {
        let stamper = Stamper::new(0, TickPeriod::from_frequency(2.0).unwrap());
        let state = ResourceState {
            charge_j: 1.0 / 3.0,
            capacity_j: 1.8e6,
            illumination: 0.125,
            generated_w: 449.9,
            asked_w: 101.25,
            stored_bits: u64::MAX,
            to_send_bits: 3,
            storage_bits: 4,
            in_contact: true,
            contact: Some((Tick(5), Tick(6))),
            sent_bits: 7,
            rod_dipole_B: Vector3::new(1.0, -2.0, 3.0),
            momentum_nms: 4.25,
            safe_mode: Some(Failure::WheelMomentum),
            delivered: Delivered { strips: 8, reward: 5.5, failures: 9, floor_violations: 10 },
        };
        let none = ResourceState { contact: None, safe_mode: None, in_contact: false, ..state };
        for state in [state, none] {
            assert_eq!(resource_state(&resource_message(&stamper, Tick(11), &state)), Ok(state));
        }
        let message = resource_message(&stamper, Tick(11), &state);
        let refused = [
            msg::ResourceState { charge: f64::NAN, ..message.clone() },
            msg::ResourceState { load_power: f64::INFINITY, ..message.clone() },
            msg::ResourceState { safe_mode: 3, ..message },
        ];
        assert!(refused.iter().all(|message| resource_state(message).is_err()));
    }
}
