//! Modified Rodrigues parameters (MRP): conversions, composition and kinematics.
//!
//! Formulas are those of Schaub & Junkins, *Analytical Mechanics of Space Systems*, chapter 3. They stand here because
//! the MRP kinematics of the ephemeris crates that were looked at are wrong or missing.

use nalgebra::{Matrix3, Vector3};

/// Euler parameters (unit quaternion) `[β0, β1, β2, β3]`, scalar first.
pub type EulerParameters = [f64; 4];

/// Euler parameters of an MRP set: β0 = (1-σ²)/(1+σ²), β = 2σ/(1+σ²).
#[inline]
#[must_use]
pub fn to_euler_parameters(sigma: &Vector3<f64>) -> EulerParameters {
    let s2 = sigma.norm_squared();
    let k = 1.0 / (1.0 + s2);
    [(1.0 - s2) * k, 2.0 * sigma.x * k, 2.0 * sigma.y * k, 2.0 * sigma.z * k]
}

/// MRP set of Euler parameters, the one with ‖σ‖ ≤ 1.
#[inline]
#[must_use]
pub fn from_euler_parameters(b: &EulerParameters) -> Vector3<f64> {
    let sign = if b[0] < 0.0 { -1.0 } else { 1.0 };
    let k = sign / (1.0 + sign * b[0]);
    Vector3::new(b[1] * k, b[2] * k, b[3] * k)
}

/// Euler parameters of `dcm_BN`, which takes N components to B components (Sheppard's method).
#[inline]
#[must_use]
pub fn euler_parameters_from_dcm(c: &Matrix3<f64>) -> EulerParameters {
    let trace = c[(0, 0)] + c[(1, 1)] + c[(2, 2)];
    let squares = [trace, c[(0, 0)], c[(1, 1)], c[(2, 2)]];
    let mut largest = 0;
    for i in 1..4 {
        if squares[i] > squares[largest] {
            largest = i;
        }
    }
    // root = 4·β_largest², and k = 1/(4·β_largest).
    let root = 1.0 + 2.0 * squares[largest] - trace;
    let b = 0.5 * root.sqrt();
    let k = 0.25 / b;
    let (d23, d31, d12) = (c[(1, 2)] - c[(2, 1)], c[(2, 0)] - c[(0, 2)], c[(0, 1)] - c[(1, 0)]);
    let (s12, s31, s23) = (c[(0, 1)] + c[(1, 0)], c[(2, 0)] + c[(0, 2)], c[(1, 2)] + c[(2, 1)]);
    match largest {
        0 => [b, d23 * k, d31 * k, d12 * k],
        1 => [d23 * k, b, s12 * k, s31 * k],
        2 => [d31 * k, s12 * k, b, s23 * k],
        _ => [d12 * k, s31 * k, s23 * k, b],
    }
}

/// Attitude of B relative to R from those of B and R relative to N: `dcm_BR = dcm_BN · dcm_RNᵀ`.
#[inline]
#[must_use]
pub fn relative_euler_parameters(bn: &EulerParameters, rn: &EulerParameters) -> EulerParameters {
    let [b0, b1, b2, b3] = *bn;
    let [r0, r1, r2, r3] = *rn;
    [
        b0 * r0 + b1 * r1 + b2 * r2 + b3 * r3,
        r0 * b1 - b0 * r1 + b2 * r3 - b3 * r2,
        r0 * b2 - b0 * r2 + b3 * r1 - b1 * r3,
        r0 * b3 - b0 * r3 + b1 * r2 - b2 * r1,
    ]
}

/// `σ_BR = σ_BN ⊖ σ_RN`, the set with ‖σ‖ ≤ 1 (paper, eq. 11).
#[inline]
#[must_use]
pub fn subtract(sigma_BN: &Vector3<f64>, sigma_RN: &Vector3<f64>) -> Vector3<f64> {
    from_euler_parameters(&relative_euler_parameters(&to_euler_parameters(sigma_BN), &to_euler_parameters(sigma_RN)))
}

/// `σ_FN = σ_BN ⊕ σ_FB`: first B relative to N, then F relative to B; the set with ‖σ‖ ≤ 1.
#[must_use]
pub fn add(sigma_BN: &Vector3<f64>, sigma_FB: &Vector3<f64>) -> Vector3<f64> {
    let [b0, b1, b2, b3] = to_euler_parameters(sigma_BN);
    let nb = [b0, -b1, -b2, -b3];
    from_euler_parameters(&relative_euler_parameters(&to_euler_parameters(sigma_FB), &nb))
}

/// `dcm_BN`, which takes N components to B components.
#[must_use]
pub fn to_dcm(sigma_BN: &Vector3<f64>) -> Matrix3<f64> {
    let s2 = sigma_BN.norm_squared();
    let tilde = sigma_BN.cross_matrix();
    let k = 1.0 / ((1.0 + s2) * (1.0 + s2));
    Matrix3::identity() + (8.0 * tilde * tilde - 4.0 * (1.0 - s2) * tilde) * k
}

/// Takes N components to B components without making the matrix: v + (8·σ×(σ×v) - 4(1-σ²)·σ×v)/(1+σ²)².
#[derive(Clone, Copy, Debug)]
pub struct Rotation {
    sigma: Vector3<f64>,
    twice: f64,
    once: f64,
}

impl Rotation {
    /// The rotation from N to B.
    #[inline]
    #[must_use]
    pub fn new(sigma_BN: &Vector3<f64>) -> Self {
        let s2 = sigma_BN.norm_squared();
        let k = 1.0 / ((1.0 + s2) * (1.0 + s2));
        Self { sigma: *sigma_BN, twice: 8.0 * k, once: 4.0 * (1.0 - s2) * k }
    }

    /// The rotation from B to N.
    #[inline]
    #[must_use]
    pub fn back(&self) -> Self {
        Self { sigma: -self.sigma, ..*self }
    }

    /// Components of a vector after the rotation.
    #[inline]
    #[must_use]
    pub fn apply(&self, v: &Vector3<f64>) -> Vector3<f64> {
        let across = self.sigma.cross(v);
        v + self.sigma.cross(&across) * self.twice - across * self.once
    }
}

/// MRP set of `dcm_BN`, with ‖σ‖ ≤ 1.
#[must_use]
pub fn from_dcm(dcm_BN: &Matrix3<f64>) -> Vector3<f64> {
    from_euler_parameters(&euler_parameters_from_dcm(dcm_BN))
}

/// The other MRP set of the same attitude: -σ/σ².
#[inline]
#[must_use]
pub fn shadow(sigma: &Vector3<f64>) -> Vector3<f64> {
    sigma * (-1.0 / sigma.norm_squared())
}

/// `B(σ)·ω` = (1-σ²)ω + 2σ×ω + 2σ(σ·ω), so that σ̇ = ¼·B(σ)·ω.
#[inline]
#[must_use]
pub fn b_times(sigma: &Vector3<f64>, omega: &Vector3<f64>) -> Vector3<f64> {
    let s2 = sigma.norm_squared();
    omega * (1.0 - s2) + sigma.cross(omega) * 2.0 + sigma * (2.0 * sigma.dot(omega))
}

/// Body rate of an MRP rate: ω = 4·B⁻¹(σ)·σ̇ = 4/(1+σ²)²·Bᵀ(σ)·σ̇.
#[inline]
#[must_use]
pub fn rate_to_omega(sigma: &Vector3<f64>, sigma_dot: &Vector3<f64>) -> Vector3<f64> {
    let s2 = sigma.norm_squared();
    let bt = sigma_dot * (1.0 - s2) - sigma.cross(sigma_dot) * 2.0 + sigma * (2.0 * sigma.dot(sigma_dot));
    bt * (4.0 / ((1.0 + s2) * (1.0 + s2)))
}

/// Principal rotation angle of an MRP set with ‖σ‖ ≤ 1 [rad], in [0, π].
#[must_use]
pub fn principal_angle(sigma: &Vector3<f64>) -> f64 {
    4.0 * libm::atan(sigma.norm())
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use proptest::prelude::*;

    use super::*;

    fn mrp() -> impl Strategy<Value = Vector3<f64>> {
        [-0.57..0.57, -0.57..0.57, -0.57..0.57].prop_map(|[x, y, z]| Vector3::new(x, y, z))
    }

    #[test]
    fn a_turn_about_z_takes_n_components_to_b_components() {
        let angle: f64 = 0.7;
        let dcm_BN = to_dcm(&Vector3::new(0.0, 0.0, libm::tan(angle / 4.0)));
        let x_B = dcm_BN * Vector3::x();
        assert_relative_eq!(x_B, Vector3::new(libm::cos(angle), -libm::sin(angle), 0.0), epsilon = 1e-15);
    }

    #[test]
    fn one_axis_kinematics_has_the_closed_form() {
        // σ = tan(θ/4) about a fixed axis, so σ̇ = θ̇/4·(1+σ²): an error of ‖σ‖ for ‖σ‖² shows here.
        let sigma = Vector3::new(0.0, 0.6, 0.0);
        let sigma_dot = b_times(&sigma, &Vector3::new(0.0, 0.2, 0.0)) * 0.25;
        assert_relative_eq!(sigma_dot.y, 0.05 * (1.0 + 0.36), epsilon = 1e-15);
    }

    proptest! {
        #[test]
        fn dcm_round_trip(sigma in mrp()) {
            assert_relative_eq!(from_dcm(&to_dcm(&sigma)), sigma, epsilon = 1e-12);
        }

        #[test]
        fn the_rotation_is_the_matrix(sigma in mrp(), v in mrp()) {
            assert_relative_eq!(Rotation::new(&sigma).apply(&v), to_dcm(&sigma) * v, epsilon = 1e-14);
            assert_relative_eq!(Rotation::new(&sigma).back().apply(&v), to_dcm(&sigma).transpose() * v, epsilon = 1e-14);
        }

        #[test]
        fn subtraction_is_the_product_of_matrices(a in mrp(), b in mrp()) {
            let dcm_BR = to_dcm(&a) * to_dcm(&b).transpose();
            assert_relative_eq!(to_dcm(&subtract(&a, &b)), dcm_BR, epsilon = 1e-12);
        }

        #[test]
        fn addition_undoes_subtraction(a in mrp(), b in mrp()) {
            let sum = add(&b, &subtract(&a, &b));
            assert_relative_eq!(to_dcm(&sum), to_dcm(&a), epsilon = 1e-12);
        }

        #[test]
        fn rate_and_omega_are_inverse(sigma in mrp(), omega in mrp()) {
            let back = rate_to_omega(&sigma, &(b_times(&sigma, &omega) * 0.25));
            assert_relative_eq!(back, omega, epsilon = 1e-12);
        }

        #[test]
        fn the_shadow_set_is_the_same_attitude(sigma in mrp()) {
            prop_assume!(sigma.norm() > 1e-3);
            assert_relative_eq!(to_dcm(&shadow(&sigma)), to_dcm(&sigma), epsilon = 1e-9);
        }
    }
}
