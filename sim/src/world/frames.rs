//! Frame conversions: inertial N, planet-fixed E, Hill H, and the strip's reference R.

use nalgebra::{Matrix3, Vector2, Vector3};

/// Rotates planet-fixed components (E) to inertial components (N) about the common z axis.
#[inline]
#[must_use]
pub fn earth_to_inertial(cos_sin: (f64, f64), v_E: &Vector3<f64>) -> Vector3<f64> {
    let (c, s) = cos_sin;
    Vector3::new(c * v_E.x - s * v_E.y, s * v_E.x + c * v_E.y, v_E.z)
}

/// `dcm_HN`: rows are the Hill frame's radial, along-track and orbit-normal unit vectors in N.
#[must_use]
pub fn hill_dcm(r_BN_N: &Vector3<f64>, v_BN_N: &Vector3<f64>) -> Matrix3<f64> {
    let radial = r_BN_N.normalize();
    let normal = r_BN_N.cross(v_BN_N).normalize();
    let along = normal.cross(&radial);
    Matrix3::from_rows(&[radial.transpose(), along.transpose(), normal.transpose()])
}

/// Geocentric latitude and longitude of a planet-fixed direction [deg].
#[must_use]
pub fn latitude_longitude_deg(r_E: &Vector3<f64>) -> (f64, f64) {
    let horizontal = Vector2::new(r_E.x, r_E.y).norm();
    (libm::atan2(r_E.z, horizontal).to_degrees(), libm::atan2(r_E.y, r_E.x).to_degrees())
}

/// Planet-fixed unit vector of a geocentric latitude and longitude [deg].
#[must_use]
pub fn direction_E(latitude_deg: f64, longitude_deg: f64) -> Vector3<f64> {
    let (lat, lon) = (latitude_deg.to_radians(), longitude_deg.to_radians());
    let cos_lat = libm::cos(lat);
    Vector3::new(cos_lat * libm::cos(lon), cos_lat * libm::sin(lon), libm::sin(lat))
}

/// Below this norm the projected scan direction is taken as vanished (ε of eq. 7).
const SCAN_EPSILON: f64 = 1e-9;

/// Reference frame R2 of a moving ground target: `dcm_RN`, whose rows are x, y, z in N (eqs 1-10).
///
/// z is the line of sight; y = unit(LOS × v⊥) is the cross-track axis; x = y × z. Eqs 2-10 reach this attitude in two
/// rotations from the body's present one, but the result does not depend on where they start
/// (`tests/it/val_paper_construction.rs` shows it).
#[inline]
#[must_use]
pub fn reference_dcm(r_BN_N: &Vector3<f64>, r_target_N: &Vector3<f64>, scan_N: &Vector3<f64>) -> Matrix3<f64> {
    let z = (r_target_N - r_BN_N).normalize();
    let projected = scan_N - z * scan_N.dot(&z);
    let y = if projected.norm_squared() < SCAN_EPSILON * SCAN_EPSILON {
        r_target_N.cross(scan_N).normalize()
    } else {
        // LOS × v⊥ = LOS × v: the part along LOS drops out.
        z.cross(scan_N).normalize()
    };
    let x = y.cross(&z);
    Matrix3::new(x.x, x.y, x.z, y.x, y.y, y.z, z.x, z.y, z.z)
}

/// Sine of the satellite's elevation over the target's horizon (eq. 12).
#[inline]
#[must_use]
pub fn sin_elevation(r_BN_N: &Vector3<f64>, r_target_N: &Vector3<f64>) -> f64 {
    let up = r_BN_N - r_target_N;
    up.dot(r_target_N) / (up.norm_squared() * r_target_N.norm_squared()).sqrt()
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    #[test]
    fn the_hill_frame_has_the_satellite_on_its_first_axis() {
        let r = Vector3::new(7e6, 1e5, -3e5);
        let v = Vector3::new(10.0, 5e3, 5e3);
        let dcm_HN = hill_dcm(&r, &v);
        assert_relative_eq!(dcm_HN * r, Vector3::new(r.norm(), 0.0, 0.0), epsilon = 1e-6);
        assert!((dcm_HN * v).y > 0.0);
        assert_relative_eq!(dcm_HN * dcm_HN.transpose(), Matrix3::identity(), epsilon = 1e-14);
    }

    #[test]
    fn latitude_and_longitude_round_trip() {
        let (lat, lon) = latitude_longitude_deg(&direction_E(-33.5, 151.25));
        assert_relative_eq!(lat, -33.5, epsilon = 1e-12);
        assert_relative_eq!(lon, 151.25, epsilon = 1e-12);
    }

    #[test]
    fn the_reference_looks_at_the_target_and_scans_along_x() {
        let r_BN_N = Vector3::new(6.9e6, 0.0, 0.0);
        let target = Vector3::new(6.378e6, 0.0, 0.0);
        let dcm_RN = reference_dcm(&r_BN_N, &target, &Vector3::y());
        assert_relative_eq!(dcm_RN * Vector3::new(-1.0, 0.0, 0.0), Vector3::z(), epsilon = 1e-15);
        assert_relative_eq!(dcm_RN * Vector3::y(), Vector3::x(), epsilon = 1e-15);
        assert_relative_eq!(dcm_RN.determinant(), 1.0, epsilon = 1e-15);
        assert_relative_eq!(sin_elevation(&r_BN_N, &target), 1.0, epsilon = 1e-15);
    }

    #[test]
    fn a_scan_along_the_line_of_sight_falls_back_to_the_tangent_direction() {
        let r_BN_N = Vector3::new(6.9e6, 1e6, 0.0);
        let target = Vector3::new(6.378e6, 0.0, 0.0);
        let scan = (target - r_BN_N).normalize();
        let dcm_RN = reference_dcm(&r_BN_N, &target, &scan);
        let y = dcm_RN.row(1).transpose();
        assert_relative_eq!(y, target.cross(&scan).normalize(), epsilon = 1e-12);
    }
}
