//! Rigid body with three reaction wheels on the body axes, integrated by RK4.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::config::SpacecraftConfig;
use crate::vehicle::mrp;
use crate::vehicle::wheels::Wheels;

/// Attitude, rate and wheel speeds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BodyState {
    /// Attitude of the body relative to the inertial frame, MRP with ‖σ‖ ≤ 1.
    pub sigma_BN: Vector3<f64>,
    /// Body rate in B [rad/s].
    pub omega_BN_B: Vector3<f64>,
    /// Wheel speeds relative to the body [rad/s].
    pub wheel_speed: Vector3<f64>,
}

/// Where in a tick a stage of RK4 is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// At its start.
    Start,
    /// In its middle.
    Middle,
    /// At its end.
    End,
}

impl Stage {
    /// Number of the time that it belongs to: start 0, middle 1, end 2.
    #[inline]
    #[must_use]
    pub fn index(self) -> usize {
        self as usize
    }
}

/// The body's and the wheels' constants.
#[derive(Clone, Debug)]
pub struct Plant {
    /// Principal inertias, wheels included [kg m²].
    pub inertia: Vector3<f64>,
    /// The wheels on its axes.
    pub wheels: Wheels,
    /// I - Js [kg m²] and its inverse.
    net_inertia: Vector3<f64>,
    net_inertia_inverse: Vector3<f64>,
    dt: f64,
}

impl Plant {
    /// The plant of a validated configuration, stepped by `dt` [s].
    #[must_use]
    pub fn new(config: &SpacecraftConfig, dt: f64) -> Self {
        let inertia = Vector3::from(config.inertia_kg_m2);
        let net_inertia = inertia.add_scalar(-config.wheel_inertia_kg_m2);
        Self { inertia, wheels: Wheels::new(config), net_inertia, net_inertia_inverse: net_inertia.map(f64::recip), dt }
    }

    /// The same with wheels whose torque limit is lower by a share.
    #[must_use]
    pub fn weakened(&self, share: f64) -> Self {
        Self { wheels: self.wheels.weakened(share), ..self.clone() }
    }

    /// The same with wheels of which each gives only a share of its torque limit.
    #[must_use]
    pub fn limited(&self, shares: &Vector3<f64>) -> Self {
        Self { wheels: self.wheels.limited(shares), ..self.clone() }
    }

    /// The same with a wheel, 0 to 2, whose speed relative to the body stays what it is. Its axis then has the whole
    /// inertia I, and the momentum Js·Ω of the wheel is constant.
    #[must_use]
    pub fn seized(&self, wheel: usize) -> Self {
        let mut plant = self.clone();
        plant.wheels.seize(wheel);
        plant.net_inertia[wheel] = plant.inertia[wheel];
        plant.net_inertia_inverse[wheel] = plant.inertia[wheel].recip();
        plant
    }

    /// Advances the state by one tick under a constant motor torque [N m] on the wheels.
    ///
    /// (I-Js)·ω̇ = -ω×(I·ω + Js·Ω) - u and Ω̇ = u/Js - ω̇ (Schaub & Junkins, ch. 4). The second integrates in closed
    /// form to Js·(Ω+ω) = Js·(Ω₀+ω₀) + u·t, so only σ and ω go through RK4. The MRP set is switched once, after the
    /// step.
    #[inline]
    pub fn step(&self, state: &mut BodyState, torque: &Vector3<f64>) {
        self.integrate(state, torque, |_, _| *torque);
    }

    /// The same with a torque from outside on the body [N m], which is asked for at each stage of RK4 with its σ_BN.
    #[inline]
    pub fn step_under(
        &self,
        state: &mut BodyState,
        torque: &Vector3<f64>,
        mut external: impl FnMut(Stage, &Vector3<f64>) -> Vector3<f64>,
    ) {
        self.integrate(state, torque, |stage, sigma| torque - external(stage, sigma));
    }

    /// `braking` is the wheels' torque less that from outside.
    #[inline(always)]
    fn integrate(
        &self,
        state: &mut BodyState,
        torque: &Vector3<f64>,
        mut braking: impl FnMut(Stage, &Vector3<f64>) -> Vector3<f64>,
    ) {
        let dt = self.dt;
        let half = 0.5 * dt;
        let (sigma0, omega0) = (state.sigma_BN, state.omega_BN_B);
        let spin0 = (state.wheel_speed + omega0.component_mul(&self.wheels.free)) * self.wheels.inertia;
        let spin_half = spin0 + torque * half;
        let spin_end = spin0 + torque * dt;

        let (sigma, omega) = (sigma0, omega0);
        let (ds1, dw1) = self.derivative(&sigma, &omega, &spin0, &braking(Stage::Start, &sigma));
        let (sigma, omega) = (sigma0 + ds1 * half, omega0 + dw1 * half);
        let (ds2, dw2) = self.derivative(&sigma, &omega, &spin_half, &braking(Stage::Middle, &sigma));
        let (sigma, omega) = (sigma0 + ds2 * half, omega0 + dw2 * half);
        let (ds3, dw3) = self.derivative(&sigma, &omega, &spin_half, &braking(Stage::Middle, &sigma));
        let (sigma, omega) = (sigma0 + ds3 * dt, omega0 + dw3 * dt);
        let (ds4, dw4) = self.derivative(&sigma, &omega, &spin_end, &braking(Stage::End, &sigma));

        let sixth = dt / 6.0;
        let sigma = sigma0 + (ds1 + (ds2 + ds3) * 2.0 + ds4) * sixth;
        let omega = omega0 + (dw1 + (dw2 + dw3) * 2.0 + dw4) * sixth;
        state.sigma_BN = if sigma.norm_squared() > 1.0 { mrp::shadow(&sigma) } else { sigma };
        state.omega_BN_B = omega;
        state.wheel_speed = spin_end * (1.0 / self.wheels.inertia) - omega.component_mul(&self.wheels.free);
    }

    /// σ̇ and ω̇; `spin` is the wheels' absolute momentum Js·(Ω+ω) [N m s], Js·Ω of one that is seized; `torque` the wheels'
    /// less that from outside.
    #[inline(always)]
    fn derivative(
        &self,
        sigma: &Vector3<f64>,
        omega: &Vector3<f64>,
        spin: &Vector3<f64>,
        torque: &Vector3<f64>,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let momentum = self.net_inertia.component_mul(omega) + spin;
        let omega_dot = self.net_inertia_inverse.component_mul(&(momentum.cross(omega) - torque));
        (mrp::b_times(sigma, omega) * 0.25, omega_dot)
    }

    /// Total angular momentum in N [N m s].
    #[must_use]
    pub fn momentum_N(&self, state: &BodyState) -> Vector3<f64> {
        let h_B = self.inertia.component_mul(&state.omega_BN_B) + state.wheel_speed * self.wheels.inertia;
        mrp::to_dcm(&state.sigma_BN).transpose() * h_B
    }

    /// Rotational kinetic energy [J]: ½ωᵀ(I-Js)ω + ½Js·|ω+Ω|².
    #[must_use]
    pub fn energy(&self, state: &BodyState) -> f64 {
        let w = &state.omega_BN_B;
        let wheels = (w + state.wheel_speed).norm_squared() * self.wheels.inertia;
        let body = self.inertia.add_scalar(-self.wheels.inertia);
        0.5 * (w.dot(&body.component_mul(w)) + wheels)
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;
    use crate::config::SimConfig;

    fn tumbling() -> BodyState {
        BodyState {
            sigma_BN: Vector3::new(0.3, -0.2, 0.1),
            omega_BN_B: Vector3::new(0.02, -0.03, 0.01),
            wheel_speed: Vector3::new(100.0, -150.0, 50.0),
        }
    }

    #[test]
    fn momentum_is_conserved_under_wheel_torques() {
        let plant = Plant::new(&SimConfig::default().spacecraft, 0.5);
        let mut state = tumbling();
        let before = plant.momentum_N(&state);
        for k in 0..200 {
            let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
            plant.step(&mut state, &(Vector3::new(0.3, -0.1, 0.2) * sign));
        }
        assert_relative_eq!(plant.momentum_N(&state), before, max_relative = 1e-6);
        assert!(state.sigma_BN.norm() <= 1.0);
    }

    #[test]
    fn momentum_changes_by_the_integral_of_the_torque_from_outside() {
        let plant = Plant::new(&SimConfig::default().spacecraft, 0.5);
        let mut state = tumbling();
        let before = plant.momentum_N(&state);
        // A torque that stands still in N.
        let torque_N = Vector3::new(2e-3, -1e-3, 3e-3);
        for _ in 0..400 {
            plant.step_under(&mut state, &Vector3::new(0.01, 0.02, -0.01), |_, sigma| mrp::to_dcm(sigma) * torque_N);
        }
        assert_relative_eq!(plant.momentum_N(&state), before + torque_N * 200.0, epsilon = 1e-6);
        let mut alone = tumbling();
        let mut none = tumbling();
        plant.step(&mut alone, &Vector3::new(0.1, 0.2, 0.3));
        plant.step_under(&mut none, &Vector3::new(0.1, 0.2, 0.3), |_, _| Vector3::zeros());
        assert_eq!(alone, none);
    }

    #[test]
    fn energy_is_conserved_without_torque() {
        let plant = Plant::new(&SimConfig::default().spacecraft, 0.5);
        let mut state = tumbling();
        let before = plant.energy(&state);
        for _ in 0..2000 {
            plant.step(&mut state, &Vector3::zeros());
        }
        assert_relative_eq!(plant.energy(&state), before, max_relative = 1e-9);
    }

    #[test]
    fn a_wheel_torque_about_one_axis_turns_the_body_the_other_way() {
        let plant = Plant::new(&SimConfig::default().spacecraft, 0.5);
        let zero = Vector3::zeros();
        let mut state = BodyState { sigma_BN: zero, omega_BN_B: zero, wheel_speed: zero };
        for _ in 0..20 {
            plant.step(&mut state, &Vector3::new(0.3, 0.0, 0.0));
        }
        let net = 82.1 - plant.wheels.inertia;
        assert_relative_eq!(state.omega_BN_B.x, -0.3 * 10.0 / net, max_relative = 1e-12);
        // θ = ½·α·t², σ = tan(θ/4).
        assert_relative_eq!(state.sigma_BN.x, libm::tan(-0.5 * 0.3 / net * 100.0 / 4.0), max_relative = 1e-7);
    }

    /// A seized wheel is a part of the body that carries momentum: total momentum stays, and so does its speed, while
    /// the others turn the body.
    #[test]
    fn a_seized_wheel_keeps_its_speed_and_the_momentum_is_conserved() {
        let plant = Plant::new(&SimConfig::default().spacecraft, 0.5).seized(1);
        let mut state = tumbling();
        let (before, speed) = (plant.momentum_N(&state), state.wheel_speed.y);
        for k in 0..200 {
            let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
            let torque = plant.wheels.saturate(&(Vector3::new(0.3, 0.3, -0.2) * sign), &state.wheel_speed);
            assert_eq!(torque.y, 0.0);
            plant.step(&mut state, &torque);
            assert_relative_eq!(state.wheel_speed.y, speed, max_relative = 1e-12);
        }
        assert_relative_eq!(plant.momentum_N(&state), before, max_relative = 1e-6);
    }
}
