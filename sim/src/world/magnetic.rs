//! The Earth's magnetic field as a centred, tilted dipole.

use nalgebra::Vector3;

use crate::world::frames::earth_to_inertial;

/// Coefficients g11, h11, g10 of a centred dipole [T], Basilisk's for the Earth.
const COEFFICIENTS: Vector3<f64> = Vector3::new(-2318e-9, 5817e-9, -30926e-9);
/// Radius to which the coefficients belong [m].
const REFERENCE_RADIUS: f64 = 6_371_200.0;

/// A centred dipole that turns with the Earth.
#[derive(Clone, Debug)]
pub struct DipoleField {
    coefficients_E: Vector3<f64>,
    reference_radius: f64,
}

impl Default for DipoleField {
    fn default() -> Self {
        Self { coefficients_E: COEFFICIENTS, reference_radius: REFERENCE_RADIUS }
    }
}

impl DipoleField {
    /// A dipole of coefficients (g11, h11, g10) [T] at a radius [m].
    #[must_use]
    pub fn new(coefficients_E: Vector3<f64>, reference_radius: f64) -> Self {
        Self { coefficients_E, reference_radius }
    }

    /// Field in N [T] at a position [m], `turn` being cosine and sine of the Earth's angle:
    /// B = (R/r)³·(3·(m·r̂)·r̂ - m) (Wertz, *Spacecraft Attitude Determination and Control*, app. H).
    #[inline]
    #[must_use]
    pub fn field_N(&self, r_BN_N: &Vector3<f64>, turn: (f64, f64)) -> Vector3<f64> {
        let inverse = 1.0 / r_BN_N.norm();
        self.field_above_N(&(r_BN_N * inverse), self.scale(1.0 / inverse), turn)
    }

    /// (R/r)³ at a radius [m].
    #[must_use]
    pub fn scale(&self, radius: f64) -> f64 {
        let ratio = self.reference_radius / radius;
        ratio * ratio * ratio
    }

    /// Field in N [T] in a direction from the Earth's centre, at the radius of a scale.
    #[inline]
    #[must_use]
    pub fn field_above_N(&self, up_N: &Vector3<f64>, scale: f64, turn: (f64, f64)) -> Vector3<f64> {
        let m_N = earth_to_inertial(turn, &self.coefficients_E);
        (up_N * (3.0 * up_N.dot(&m_N)) - m_N) * scale
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    #[test]
    fn over_the_pole_the_field_is_twice_that_over_the_equator_and_turns_with_the_earth() {
        let field = DipoleField::new(Vector3::new(0.0, 0.0, -3e-5), 6_371_200.0);
        let r = 6_898_136.6;
        let equator = field.field_N(&Vector3::new(r, 0.0, 0.0), (1.0, 0.0));
        let pole = field.field_N(&Vector3::new(0.0, 0.0, r), (1.0, 0.0));
        assert!(equator.z > 0.0 && pole.z < 0.0, "north at the equator, down at the north pole");
        assert_relative_eq!(pole.norm(), 2.0 * equator.norm(), max_relative = 1e-14);
        let tilted = DipoleField::default();
        let quarter = tilted.field_N(&Vector3::new(0.0, r, 0.0), (0.0, 1.0));
        let none = tilted.field_N(&Vector3::new(r, 0.0, 0.0), (1.0, 0.0));
        assert_relative_eq!(quarter, Vector3::new(-none.y, none.x, none.z), epsilon = 1e-20);
        // 24.9 µT at the magnetic equator at 520 km (facts of the orbit).
        let m = COEFFICIENTS.norm();
        let across = COEFFICIENTS.cross(&Vector3::x()).normalize() * r;
        assert_relative_eq!(tilted.field_N(&across, (1.0, 0.0)).norm(), m * 0.7879, max_relative = 1e-3);
    }
}
