//! Where things are on the Earth, as longitudes and latitudes [deg].

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use swath_msgs::swath_msgs as msg;
use swath_node::orders::request_of_strip;
use swath_sim::vehicle::model::Model;
use swath_sim::vehicle::mrp;
use swath_sim::world::frames::latitude_longitude_deg;
use swath_sim::world::turn::Turn;

use swath_sim::vehicle::spacecraft::StateSample;

/// Longitude and latitude [deg].
pub type Place = [f64; 2];

/// Longest step between points of a strip [km].
const STEP_KM: f64 = 50.0;

/// Points along a strip's great circle, from start to end; only the ends when it cannot be flown.
#[must_use]
pub fn strip_places(model: &Model, strip: &msg::Strip) -> Vec<Place> {
    let radius = model.config.earth.radius_m;
    let Ok(flown) = request_of_strip(strip).to_strip(&model.config.requests, radius) else {
        return vec![
            [strip.start_longitude_deg, strip.start_latitude_deg],
            [strip.end_longitude_deg, strip.end_latitude_deg],
        ];
    };
    let steps = (flown.arc * radius / (1000.0 * STEP_KM)).ceil().max(1.0);
    let time = flown.acquisition_time_s();
    let place = |i: usize| place_of(&flown.target_E(time * i as f64 / steps).0);
    (0..=steps as usize).map(place).collect()
}

/// The point below the satellite.
#[must_use]
pub fn sub_satellite(earth: &mut Turn, state: &StateSample) -> Place {
    place_of(&position_E(earth, state))
}

/// The satellite's position in the planet-fixed frame [m].
#[must_use]
pub fn position_E(earth: &mut Turn, state: &StateSample) -> Vector3<f64> {
    to_E(earth.cos_sin(state.tick), &state.r_BN_N)
}

/// The satellite's velocity as seen from the planet [m/s], which turns by so much [rad/s]: v - ω×r.
#[must_use]
pub fn velocity_E(earth: &mut Turn, rotation_rad_s: f64, state: &StateSample) -> Vector3<f64> {
    let turning = Vector3::new(0.0, 0.0, rotation_rad_s).cross(&state.r_BN_N);
    to_E(earth.cos_sin(state.tick), &(state.v_BN_N - turning))
}

fn to_E((cos, sin): (f64, f64), v_N: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(cos * v_N.x + sin * v_N.y, cos * v_N.y - sin * v_N.x, v_N.z)
}

/// The rotation that takes body components to planet-fixed ones.
#[must_use]
pub fn attitude_E(earth: &mut Turn, state: &StateSample) -> UnitQuaternion<f64> {
    let (cos, sin) = earth.cos_sin(state.tick);
    let to_E = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -sin.atan2(cos));
    let [w, x, y, z] = mrp::to_euler_parameters(&state.body.sigma_BN);
    to_E * UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z))
}

/// Cuts a line where it crosses the antimeridian; each piece ends at ±180°.
#[must_use]
pub fn cut_at_antimeridian(line: &[Place]) -> Vec<Vec<Place>> {
    let mut pieces = vec![Vec::new()];
    let mut last: Option<Place> = None;
    for &place in line {
        if let Some(before) = last
            && (place[0] - before[0]).abs() > 180.0
        {
            let side = 180.0_f64.copysign(before[0]);
            let beyond = place[0] + 2.0 * side;
            let share = (side - before[0]) / (beyond - before[0]);
            let latitude = before[1] + share * (place[1] - before[1]);
            pieces.last_mut().into_iter().for_each(|piece: &mut Vec<Place>| piece.push([side, latitude]));
            pieces.push(vec![[-side, latitude]]);
        }
        pieces.last_mut().into_iter().for_each(|piece| piece.push(place));
        last = Some(place);
    }
    pieces.retain(|piece| piece.len() > 1);
    pieces
}

fn place_of(r_E: &Vector3<f64>) -> Place {
    let (latitude, longitude) = latitude_longitude_deg(r_E);
    [longitude, latitude]
}

#[cfg(test)]
mod tests {
    use nalgebra::Rotation3;
    use swath_sim::config::SimConfig;
    use swath_sim::time::Tick;
    use swath_sim::vehicle::dynamics::BodyState;

    use super::*;

    #[test]
    fn lines_are_cut_at_the_antimeridian() {
        let pieces = cut_at_antimeridian(&[[170.0, 0.0], [-170.0, 10.0], [-160.0, 15.0]]);
        assert_eq!(pieces, [vec![[170.0, 0.0], [180.0, 5.0]], vec![[-180.0, 5.0], [-170.0, 10.0], [-160.0, 15.0]]]);
        let westward = cut_at_antimeridian(&[[-170.0, 0.0], [170.0, 10.0]]);
        assert_eq!(westward, [vec![[-170.0, 0.0], [-180.0, 5.0]], vec![[180.0, 5.0], [170.0, 10.0]]]);
        assert_eq!(cut_at_antimeridian(&[[1.0, 2.0], [3.0, 4.0]]).len(), 1);
    }

    #[test]
    fn the_attitude_takes_body_axes_to_the_planet_s() {
        let model = Model::new(SimConfig::default()).unwrap();
        let sigma_BN = Vector3::new(0.1, -0.3, 0.2);
        let body = BodyState { sigma_BN, omega_BN_B: Vector3::zeros(), wheel_speed: Vector3::zeros() };
        let r_BN_N = Vector3::new(6.9e6, 1e5, -2e6);
        let zero = Vector3::zeros();
        let (tick, truth, resources) = (Tick(12_345), None, None);
        let state = StateSample { tick, r_BN_N, v_BN_N: zero, body, truth, torque_applied: zero, resources };
        let mut earth = model.earth.clone();
        let (cos, sin) = earth.cos_sin(state.tick);
        let dcm_EN = Rotation3::from_axis_angle(&Vector3::z_axis(), -sin.atan2(cos));
        let expected = dcm_EN * mrp::to_dcm(&sigma_BN).transpose() * Vector3::x();
        assert!((attitude_E(&mut earth, &state) * Vector3::x() - expected).norm() < 1e-12);
        assert!((position_E(&mut earth, &state) - dcm_EN * r_BN_N).norm() < 1e-6);
    }
}
