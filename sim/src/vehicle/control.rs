//! MRP steering law and rate servo: from tracking error to wheel torque.

use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector3;

use crate::config::ControlConfig;
use crate::vehicle::dynamics::Plant;
use crate::vehicle::mrp;

/// Steering rate and its feed-forward derivative, in B.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Steering {
    /// Desired rate ω* of B relative to its steered frame [rad/s].
    pub omega_star: Vector3<f64>,
    /// Its derivative ω*′ [rad/s²]; zero without feed-forward.
    pub omega_star_prime: Vector3<f64>,
}

/// Tracking error that the controller acts on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackingError {
    /// Attitude error σ_BR, ‖σ‖ ≤ 1.
    pub sigma_BR: Vector3<f64>,
    /// Rate error ω_BR in B [rad/s].
    pub omega_BR_B: Vector3<f64>,
}

/// Gains of the steering law and the servo.
#[derive(Clone, Debug)]
pub struct ControlLaw {
    k1: f64,
    k3: f64,
    omega_max: f64,
    feed_forward: bool,
    p: f64,
    ki: f64,
    integral_limit: f64,
}

impl ControlLaw {
    /// The law of a validated configuration.
    #[must_use]
    pub fn new(config: &ControlConfig) -> Self {
        Self {
            k1: config.k1,
            k3: config.k3,
            omega_max: config.omega_max_deg_s.to_radians(),
            feed_forward: config.feed_forward,
            p: config.servo_p,
            ki: config.servo_ki,
            integral_limit: config.servo_integral_limit,
        }
    }

    /// Steering law: ω*ᵢ = -(2ω_max/π)·atan((K1σᵢ + K3σᵢ³)·π/(2ω_max)), and
    /// ω*′ᵢ = -(3K3σᵢ² + K1)/(1 + argᵢ²)·(¼B(σ)ω*)ᵢ (Schaub & Piggott 2018; Basilisk mrpSteering).
    #[inline]
    #[must_use]
    pub fn steer(&self, sigma_BR: &Vector3<f64>) -> Steering {
        let scale = FRAC_PI_2 / self.omega_max;
        let arg = sigma_BR.map(|s| (self.k1 + self.k3 * s * s) * s * scale);
        let omega_star = arg.map(|a| -libm::atan(a) / scale);
        let omega_star_prime = if self.feed_forward {
            let sigma_dot = mrp::b_times(sigma_BR, &omega_star) * 0.25;
            Vector3::from_fn(|i, _| {
                let (s, a) = (sigma_BR[i], arg[i]);
                -(3.0 * self.k3 * s * s + self.k1) / (1.0 + a * a) * sigma_dot[i]
            })
        } else {
            Vector3::zeros()
        };
        Steering { omega_star, omega_star_prime }
    }

    /// Largest steering rate ω_max [rad/s].
    #[must_use]
    pub fn omega_max(&self) -> f64 {
        self.omega_max
    }

    /// Motor torque command that only damps the body's rates [N m]: u = P·ω, which takes energy from the body, ω·u ≥ 0,
    /// whichever of the wheels follow it.
    #[must_use]
    pub fn damping(&self, omega_BN_B: &Vector3<f64>) -> Vector3<f64> {
        omega_BN_B * self.p
    }

    /// Motor torque command [N m], not yet saturated (Basilisk rateServoFullNonlinear):
    /// u = P·δω + Ki·z - (ω*+ω_RN)×(I·ω + Js·(ω+Ω)) - I·(-ω×ω_RN + ω*′), with δω = ω_BR - ω*.
    ///
    /// `integral` is z = ∫δω dt [rad], advanced here by `dt` [s] and clamped per axis before it is used. As in
    /// Basilisk the servo takes I with the wheels in it and adds Js·(ω+Ω).
    #[inline]
    #[must_use]
    pub fn torque(
        &self,
        plant: &Plant,
        error: &TrackingError,
        omega_BN_B: &Vector3<f64>,
        wheel_speed: &Vector3<f64>,
        integral: &mut Vector3<f64>,
        dt: f64,
    ) -> Vector3<f64> {
        let Steering { omega_star, omega_star_prime } = self.steer(&error.sigma_BR);
        let omega_RN_B = omega_BN_B - error.omega_BR_B;
        let rate_error = error.omega_BR_B - omega_star;
        let limit = self.integral_limit;
        *integral = (*integral + rate_error * dt).map(|z| z.clamp(-limit, limit));
        let momentum = plant.inertia.component_mul(omega_BN_B) + (omega_BN_B + wheel_speed) * plant.wheels.inertia;
        let gyroscopic = (omega_star + omega_RN_B).cross(&momentum);
        let reference = plant.inertia.component_mul(&(omega_star_prime - omega_BN_B.cross(&omega_RN_B)));
        rate_error * self.p + *integral * self.ki - gyroscopic - reference
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    fn law(feed_forward: bool) -> ControlLaw {
        ControlLaw::new(&ControlConfig { feed_forward, ..ControlConfig::default() })
    }

    #[test]
    fn the_steering_rate_saturates_at_omega_max() {
        let steering = law(true).steer(&Vector3::new(1.0, -1.0, 0.0));
        let omega_max = 5f64.to_radians();
        assert!(steering.omega_star.x < -0.95 * omega_max && steering.omega_star.x > -omega_max);
        assert_eq!(steering.omega_star.y, -steering.omega_star.x);
        assert_eq!(steering.omega_star.z, 0.0);
    }

    #[test]
    fn the_feed_forward_is_the_derivative_of_the_steering_rate_along_its_own_motion() {
        let law = law(true);
        let sigma = Vector3::new(0.2, -0.1, 0.3);
        let at = law.steer(&sigma);
        let h = 1e-6;
        let sigma_dot = mrp::b_times(&sigma, &at.omega_star) * 0.25;
        let difference = (law.steer(&(sigma + sigma_dot * h)).omega_star
            - law.steer(&(sigma - sigma_dot * h)).omega_star)
            / (2.0 * h);
        assert_relative_eq!(at.omega_star_prime, difference, epsilon = 1e-8);
    }
}
