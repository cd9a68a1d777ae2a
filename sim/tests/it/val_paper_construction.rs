//! The paper's two-step reference attitude (eqs 2-10) equals the closed form that guidance uses, wherever the body looks.
#![expect(non_snake_case, reason = "frame letters")]

use approx::assert_relative_eq;
use nalgebra::Vector3;
use proptest::prelude::*;
use swath_sim::vehicle::mrp;
use swath_sim::world::frames::reference_dcm;

/// Eqs 2-10, step by step, starting from the body's attitude; `dcm_R2N`.
fn two_steps(
    sigma_BN: &Vector3<f64>,
    r_BN_N: &Vector3<f64>,
    r_target_N: &Vector3<f64>,
    v_N: &Vector3<f64>,
) -> Vector3<f64> {
    let los_N = (r_target_N - r_BN_N).normalize();
    // Eqs 2-5: turn the boresight to the line of sight along the shortest way.
    let los_B = mrp::to_dcm(sigma_BN) * los_N;
    let phi_1 = libm::acos(los_B.z.clamp(-1.0, 1.0));
    let axis = Vector3::z().cross(&los_B);
    let e_1 = if axis.norm() < 1e-12 { Vector3::y() } else { axis.normalize() };
    let sigma_BR1 = e_1 * -libm::tan(phi_1 / 4.0);
    let sigma_R1N = mrp::add(sigma_BN, &-sigma_BR1);
    // Eqs 6-7: the reference cross-track axis.
    let projected = v_N - los_N * v_N.dot(&los_N);
    let cross_track_N = los_N.cross(&projected).normalize();
    // Eqs 8-10: turn about the line of sight until q_y lies on it. The sign of eq. 8 is fixed: φ2 turns R2 back from R1.
    let cross_track_R1 = mrp::to_dcm(&sigma_R1N) * cross_track_N;
    let q_y = Vector3::y();
    let sign = -q_y.cross(&cross_track_R1).z.signum();
    let phi_2 = sign * libm::acos(q_y.dot(&cross_track_R1).clamp(-1.0, 1.0));
    let sigma_R2R1 = Vector3::z() * -libm::tan(phi_2 / 4.0);
    mrp::add(&sigma_R1N, &sigma_R2R1)
}

proptest! {
    #[test]
    fn two_rotations_end_where_the_closed_form_stands(
        sigma in [-0.57..0.57, -0.57..0.57, -0.57..0.57],
        aside in [-4e5..4e5, -4e5..4e5],
        v in [-1.0..1.0, -1.0..1.0, -1.0..1.0],
    ) {
        let sigma_BN = Vector3::from(sigma);
        let r_BN_N = Vector3::new(6.898e6, 0.0, 0.0);
        let r_target_N = Vector3::new(6.35e6, aside[0], aside[1]);
        let v_N = Vector3::from(v);
        let los = (r_target_N - r_BN_N).normalize();
        prop_assume!(los.cross(&v_N).norm() > 0.05);
        // At half a turn about the line of sight the sign of eq. 8 is undefined.
        let dcm = mrp::to_dcm(&two_steps(&sigma_BN, &r_BN_N, &r_target_N, &v_N));
        let closed = reference_dcm(&r_BN_N, &r_target_N, &v_N);
        assert_relative_eq!(dcm, closed, epsilon = 1e-6);
    }
}
