//! Reaction wheels on the body axes: their limits, and how they saturate.

use nalgebra::Vector3;

use crate::config::{RAD_S_PER_RPM, SpacecraftConfig};

/// Three equal wheels, one on each principal axis.
#[derive(Clone, Debug)]
pub struct Wheels {
    /// Spin inertia Js of each [kg m²].
    pub inertia: f64,
    /// Torque limit of each [N m].
    pub torque_max: Vector3<f64>,
    /// Speed limit of each, relative to the body [rad/s].
    pub speed_max: f64,
    /// 1 for a wheel that turns freely, 0 for one whose speed cannot change.
    pub free: Vector3<f64>,
}

impl Wheels {
    /// The wheels of a validated configuration.
    #[must_use]
    pub fn new(config: &SpacecraftConfig) -> Self {
        Self {
            inertia: config.wheel_inertia_kg_m2,
            torque_max: Vector3::repeat(config.wheel_torque_max_nm),
            speed_max: config.wheel_speed_max_rpm * RAD_S_PER_RPM,
            free: Vector3::repeat(1.0),
        }
    }

    /// The same, each with a torque limit that is lower by a share.
    #[must_use]
    pub fn weakened(&self, share: f64) -> Self {
        Self { torque_max: self.torque_max * (1.0 - share), ..*self }
    }

    /// The same, of which each gives only a share of its torque limit.
    #[must_use]
    pub fn limited(&self, shares: &Vector3<f64>) -> Self {
        Self { torque_max: self.torque_max.component_mul(shares), ..*self }
    }

    /// Blocks a wheel, 0 to 2: its speed relative to the body stays what it is.
    pub fn seize(&mut self, wheel: usize) {
        self.torque_max[wheel] = 0.0;
        self.free[wheel] = 0.0;
    }

    /// What the wheels make of a torque command [N m] at their speeds [rad/s]: clamped to their limit, and nothing that
    /// would speed up a wheel beyond its speed limit.
    #[allow(clippy::manual_clamp, reason = "`clamp` checks its limits, on three axes twice a tick: 5 % of a tick")]
    #[inline]
    #[must_use]
    pub fn saturate(&self, command: &Vector3<f64>, speed: &Vector3<f64>) -> Vector3<f64> {
        command.zip_zip_map(speed, &self.torque_max, |torque, speed, max| {
            let torque = if torque > max {
                max
            } else if torque < -max {
                -max
            } else {
                torque
            };
            if speed.abs() >= self.speed_max && torque * speed > 0.0 { 0.0 } else { torque }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::SimConfig;

    #[test]
    fn a_wheel_at_its_speed_limit_only_takes_torque_that_slows_it() {
        let wheels = Wheels::new(&SimConfig::default().spacecraft);
        let speeds = Vector3::new(629.0, -629.0, 629.0);
        let torque = wheels.saturate(&Vector3::new(0.5, 0.5, -0.1), &speeds);
        assert_eq!(torque, Vector3::new(0.0, 0.3, -0.1));
    }
}
