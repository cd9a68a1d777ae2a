//! Torques from outside: magnetic rods, thrusters, gravity gradient and disturbances.

use nalgebra::Vector3;

use crate::vehicle::dynamics::Stage;
use crate::vehicle::mrp::Rotation;

/// Magnetic rods on the three body axes with the cross-product law.
#[derive(Clone, Copy, Debug)]
pub struct Rods {
    /// Torque wanted over momentum [1/s].
    pub gain: f64,
    /// Largest dipole of each rod [A m²].
    pub dipole_max: f64,
}

impl Rods {
    /// Dipole [A m²] against a momentum of the wheels [N m s] in a field [T], both in B: τ = -k·h, m = B×τ/|B|², each
    /// rod clamped by itself (Markley & Crassidis, *Fundamentals of Spacecraft Attitude Determination and Control*,
    /// 7.5.1; Basilisk mtbMomentumManagementSimple, torque2Dipole, dipoleMapping).
    #[inline]
    #[must_use]
    pub fn dipole(&self, momentum_B: &Vector3<f64>, field_B: &Vector3<f64>) -> Vector3<f64> {
        let squared = field_B.norm_squared();
        if squared <= 0.0 {
            return Vector3::zeros();
        }
        let wanted = field_B.cross(momentum_B) * (-self.gain / squared);
        wanted.map(|dipole| dipole.clamp(-self.dipole_max, self.dipole_max))
    }
}

/// Thrusters that take momentum out of the wheels in pulses.
#[derive(Clone, Copy, Debug)]
pub struct Thrusters {
    /// Largest torque about each body axis [N m].
    pub torque_max: f64,
    /// They fire for one tick of so many, so that the wheels can settle the attitude.
    pub pulse_every: u32,
}

impl Thrusters {
    /// Torque on the body [N m] in tick number `since` of a desaturation: against the wheels' momentum [N m s], no more
    /// than takes it out within a tick of `dt` [s], in its direction where a thruster saturates.
    #[must_use]
    pub fn torque(&self, momentum_B: &Vector3<f64>, since: u32, dt: f64) -> Vector3<f64> {
        if !since.is_multiple_of(self.pulse_every) {
            return Vector3::zeros();
        }
        let wanted = momentum_B / -dt;
        let most = wanted.amax();
        if most > self.torque_max { wanted * (self.torque_max / most) } else { wanted }
    }
}

/// Gravity-gradient torque in B [N m]: 3μ/r³·ê×(I·ê), ê up (Schaub & Junkins, ch. 4); `gradient` is 3μ/r³ [1/s²].
#[inline]
#[must_use]
pub fn gravity_gradient(up_B: &Vector3<f64>, inertia: &Vector3<f64>, gradient: f64) -> Vector3<f64> {
    up_B.cross(&inertia.component_mul(up_B)) * gradient
}

/// What turns the body from outside over a tick: dipole, field and constant torque stand still, the satellite moves.
#[derive(Clone, Copy, Debug)]
pub struct External {
    /// Constant torque in B [N m].
    pub torque_B: Vector3<f64>,
    /// Dipole in B [A m²].
    pub dipole_B: Vector3<f64>,
    /// Magnetic field in N [T].
    pub field_N: Vector3<f64>,
    /// Up in N at the tick's start, middle and end.
    pub up_N: [Vector3<f64>; 3],
    /// 3μ/r³ [1/s²]; 0 without gravity gradient.
    pub gradient: f64,
}

impl External {
    /// Torque on a body of principal inertias [kg m²] at a stage of the tick, in an attitude [N m].
    #[inline]
    #[must_use]
    pub fn torque(&self, stage: Stage, sigma_BN: &Vector3<f64>, inertia: &Vector3<f64>) -> Vector3<f64> {
        let to_body = Rotation::new(sigma_BN);
        let up_B = to_body.apply(&self.up_N[stage.index()]);
        self.torque_of(&to_body.apply(&self.field_N), &up_B, inertia)
    }

    /// Torques at start, middle and end of a tick of `dt` [s] that begins in an attitude with a rate [N m].
    ///
    /// The attitudes follow from that rate alone, to second order in the angle. What the wheels change of it within a
    /// tick turns torques by less than the field itself turns, which stands still here, and the four stages of RK4 need
    /// not wait for these torques one after the other, which costs most.
    #[inline]
    #[must_use]
    pub fn over_tick(
        &self,
        sigma_BN: &Vector3<f64>,
        omega_BN_B: &Vector3<f64>,
        inertia: &Vector3<f64>,
        dt: f64,
    ) -> [Vector3<f64>; 3] {
        let to_body = Rotation::new(sigma_BN);
        let half = 0.5 * dt;
        let [up_0, up_1, up_2] = &self.up_N;
        let field_B = to_body.apply(&self.field_N);
        let (field_1, field_2) = (turned(&field_B, omega_BN_B, half), turned(&field_B, omega_BN_B, dt));
        let up_1 = turned(&to_body.apply(up_1), omega_BN_B, half);
        let up_2 = turned(&to_body.apply(up_2), omega_BN_B, dt);
        [
            self.torque_of(&field_B, &to_body.apply(up_0), inertia),
            self.torque_of(&field_1, &up_1, inertia),
            self.torque_of(&field_2, &up_2, inertia),
        ]
    }

    #[inline(always)]
    fn torque_of(&self, field_B: &Vector3<f64>, up_B: &Vector3<f64>, inertia: &Vector3<f64>) -> Vector3<f64> {
        self.torque_B + self.dipole_B.cross(field_B) + gravity_gradient(up_B, inertia, self.gradient)
    }
}

/// A vector that stands still in N, in B components after a turn of B for a time [s], to second order.
#[inline(always)]
fn turned(v_B: &Vector3<f64>, omega_BN_B: &Vector3<f64>, t: f64) -> Vector3<f64> {
    let across = omega_BN_B.cross(v_B) * t;
    v_B - across + omega_BN_B.cross(&across) * (0.5 * t)
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    #[test]
    fn rods_turn_against_the_momentum_as_far_as_the_field_lets_them() {
        let rods = Rods { gain: 0.003, dipole_max: 1e9 };
        let (momentum, field) = (Vector3::new(3.0, -2.0, 1.0), Vector3::new(1e-5, 2e-5, -3e-5));
        let torque = rods.dipole(&momentum, &field).cross(&field);
        let across = momentum - field * (momentum.dot(&field) / field.norm_squared());
        assert_relative_eq!(torque, across * -0.003, epsilon = 1e-15);
        let small = Rods { gain: 0.003, dipole_max: 100.0 }.dipole(&momentum, &field);
        assert!(small.amax() <= 100.0 && small.amax() >= 100.0);
        assert_eq!(rods.dipole(&momentum, &Vector3::zeros()), Vector3::zeros());
    }

    #[test]
    fn thrusters_pulse_and_stop_at_nothing() {
        let thrusters = Thrusters { torque_max: 1.0, pulse_every: 5 };
        let momentum = Vector3::new(4.0, -2.0, 0.0);
        assert_relative_eq!(thrusters.torque(&momentum, 0, 0.5), Vector3::new(-1.0, 0.5, 0.0));
        for since in 1..5 {
            assert_eq!(thrusters.torque(&momentum, since, 0.5), Vector3::zeros());
        }
        assert_relative_eq!(thrusters.torque(&Vector3::new(0.1, 0.0, 0.0), 5, 0.5), Vector3::new(-0.2, 0.0, 0.0));
    }

    #[test]
    fn torques_over_a_tick_are_those_at_the_attitudes_of_a_turn_at_its_rate() {
        let external = External {
            torque_B: Vector3::new(1e-5, 0.0, 2e-5),
            dipole_B: Vector3::new(100.0, -100.0, 30.0),
            field_N: Vector3::new(1e-5, -2e-5, 2.5e-5),
            up_N: [Vector3::x(), Vector3::new(1.0, 1e-4, 0.0), Vector3::new(1.0, 2e-4, 0.0)],
            gradient: 3.6e-6,
        };
        let inertia = Vector3::new(82.1, 98.4, 121.0);
        let (mut sigma, omega) = (Vector3::new(0.2, -0.1, 0.3), Vector3::new(0.05, -0.06, 0.03));
        let torques = external.over_tick(&sigma, &omega, &inertia, 0.5);
        assert_eq!(torques[0], external.torque(Stage::Start, &sigma, &inertia));
        for (stage, torque) in [(Stage::Middle, torques[1]), (Stage::End, torques[2])] {
            // Small steps of the kinematics, σ̇ = ¼B(σ)ω.
            for _ in 0..250 {
                let half = sigma + crate::vehicle::mrp::b_times(&sigma, &omega) * (0.25 * 0.0005);
                sigma += crate::vehicle::mrp::b_times(&half, &omega) * (0.25 * 0.001);
            }
            assert_relative_eq!(torque, external.torque(stage, &sigma, &inertia), epsilon = 1e-7);
        }
    }

    #[test]
    fn gravity_turns_the_long_axis_up() {
        let inertia = Vector3::new(1.0, 10.0, 10.0);
        let (s, c) = libm::sincos(0.1);
        // x is the long axis, leaning from up by 0.1 rad about z: the torque is 1.5·μ/r³·ΔI·sin 2θ, back towards up.
        let torque = gravity_gradient(&Vector3::new(c, s, 0.0), &inertia, 3e-6);
        assert_relative_eq!(torque, Vector3::new(0.0, 0.0, 3e-6 * 9.0 * s * c), epsilon = 1e-18);
    }
}
