//! The Sun and the Earth's shadow.

use nalgebra::Vector3;

/// Astronomical unit [m], Basilisk's value.
pub const ASTRONOMICAL_UNIT: f64 = 149_597_870_693.0;
/// Radius of the Sun [m], Basilisk's value.
pub const SUN_RADIUS: f64 = 695_000_000.0;
/// Solar flux at one astronomical unit [W/m²].
pub const SOLAR_FLUX: f64 = 1361.0;
/// Inside the umbra by more than this nothing of the Sun is seen, whatever is rounded [m].
const UMBRA_MARGIN: f64 = 1.0;

/// A Sun that stands still in N, and the shadow that a spherical Earth casts.
///
/// The Sun moves by 1° a day: for missions of days a fixed one is exact enough, and it is what the reference histories
/// were made with.
#[derive(Clone, Debug)]
pub struct Sun {
    /// Position of the Sun relative to the Earth in N [m].
    pub r_SE_N: Vector3<f64>,
    direction_N: Vector3<f64>,
    earth_radius: f64,
    /// Distance from the Earth's centre to the tips of the penumbra's cone (sunward) and of the umbra's [m].
    tips: (f64, f64),
    /// Tangents of the cones' half angles.
    tangents: (f64, f64),
}

impl Sun {
    /// A Sun at a position [m] over a spherical Earth of a radius [m].
    #[must_use]
    pub fn new(r_SE_N: Vector3<f64>, earth_radius: f64) -> Self {
        let distance = r_SE_N.norm();
        let (outer, inner) = ((SUN_RADIUS + earth_radius) / distance, (SUN_RADIUS - earth_radius) / distance);
        Self {
            direction_N: r_SE_N / distance,
            tips: (earth_radius / outer, earth_radius / inner),
            tangents: (libm::tan(libm::asin(outer)), libm::tan(libm::asin(inner))),
            r_SE_N,
            earth_radius,
        }
    }

    /// A Sun at a right ascension and a declination [deg] and a distance [AU].
    #[must_use]
    pub fn at(right_ascension_deg: f64, declination_deg: f64, distance_au: f64, earth_radius: f64) -> Self {
        let direction_N = crate::world::frames::direction_E(declination_deg, right_ascension_deg);
        Self::new(direction_N * (distance_au * ASTRONOMICAL_UNIT), earth_radius)
    }

    /// Unit vector from the Earth to the Sun in N.
    #[must_use]
    pub fn direction_N(&self) -> &Vector3<f64> {
        &self.direction_N
    }

    /// Share of the Sun's disc that is seen from a position, from 0 in the umbra to 1.
    ///
    /// Cones of umbra and penumbra (Montenbruck & Gill, *Satellite Orbits*, 3.4.2) say where the discs must be looked
    /// at; all else is a few products.
    #[inline]
    #[must_use]
    pub fn illumination(&self, r_BN_N: &Vector3<f64>) -> f64 {
        let behind = -r_BN_N.dot(&self.direction_N);
        if behind <= 0.0 {
            return 1.0;
        }
        let off_axis = (r_BN_N.norm_squared() - behind * behind).max(0.0).sqrt();
        if off_axis >= (behind + self.tips.0) * self.tangents.0 {
            return 1.0;
        }
        if off_axis < (self.tips.1 - behind) * self.tangents.1 - UMBRA_MARGIN {
            return 0.0;
        }
        self.seen_disc(r_BN_N)
    }

    /// The shadow that a satellite on a circular orbit is in or enters next: begin and end [s from now], of a shadow
    /// without penumbra. None where the orbit has none. The begin is negative within one.
    ///
    /// With u the angle along the orbit from the point nearest to the Sun, r̂·ŝ = cos β·cos u, and the Earth hides the
    /// Sun where that is below -√(1 - (R/r)²).
    #[must_use]
    pub fn next_shadow_s(&self, r_BN_N: &Vector3<f64>, v_BN_N: &Vector3<f64>) -> Option<(f64, f64)> {
        use std::f64::consts::{PI, TAU};
        let radius = r_BN_N.norm();
        let (up, along) = (r_BN_N / radius, v_BN_N.normalize());
        let (a, b) = (up.dot(&self.direction_N), along.dot(&self.direction_N));
        let cos_beta = (a * a + b * b).sqrt();
        let limit = (1.0 - (self.earth_radius / radius) * (self.earth_radius / radius)).max(0.0).sqrt();
        if limit >= cos_beta {
            return None;
        }
        let half = libm::acos(limit / cos_beta);
        let mean_motion = v_BN_N.norm() / radius;
        // The middle of the shadow lies half a turn from the point nearest to the Sun, which is atan2(b, a) ahead.
        let end = libm::atan2(b, a) + PI + half;
        // The first end that is still to come.
        let middle = end - (end / TAU).ceil() * TAU + TAU - half;
        Some(((middle - half) / mean_motion, (middle + half) / mean_motion))
    }

    /// Share of the Sun's disc that the Earth's leaves free: a and b are their apparent radii, c their distance.
    #[cold]
    fn seen_disc(&self, r_BN_N: &Vector3<f64>) -> f64 {
        let r_SB_N = self.r_SE_N - r_BN_N;
        let (to_sun, to_earth) = (r_SB_N.norm(), r_BN_N.norm());
        let a = libm::asin((SUN_RADIUS / to_sun).min(1.0));
        let b = libm::asin((self.earth_radius / to_earth).min(1.0));
        let c = libm::acos((-r_BN_N.dot(&r_SB_N) / (to_earth * to_sun)).clamp(-1.0, 1.0));
        if c <= b - a {
            0.0
        } else if c < a - b {
            1.0 - (b / a) * (b / a)
        } else if c < a + b {
            // Angles from both legs, and the height by Heron's formula: the usual arc cosines lose half the digits here.
            let x = (c * c + a * a - b * b) / (2.0 * c);
            let product = (a + b + c) * (a + b - c) * (c + a - b) * (c + b - a);
            let y = product.max(0.0).sqrt() / (2.0 * c);
            let hidden = a * a * libm::atan2(y, x) + b * b * libm::atan2(y, c - x) - c * y;
            (1.0 - hidden / (std::f64::consts::PI * a * a)).clamp(0.0, 1.0)
        } else {
            1.0
        }
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    const EARTH: f64 = 6_378_136.6;

    #[test]
    fn noon_is_bright_midnight_is_dark_and_the_edge_is_half() {
        let sun = Sun::new(Vector3::new(ASTRONOMICAL_UNIT, 0.0, 0.0), EARTH);
        let radius = EARTH + 520e3;
        let at = |x: f64, y: f64| sun.illumination(&Vector3::new(x, y, 0.0));
        assert_eq!(at(radius, 0.0), 1.0);
        assert_eq!(at(-radius, 0.0), 0.0);
        assert_eq!(at(0.0, radius), 1.0);
        // Where the Earth's edge covers the Sun's centre: c = b.
        let angle = libm::asin(EARTH / radius);
        let middle = at(-radius * libm::cos(angle), radius * libm::sin(angle));
        assert!((0.49..0.51).contains(&middle), "{middle}");
    }

    #[test]
    fn the_cones_leave_the_discs_only_what_they_decide() {
        let sun = Sun::at(30.0, -20.0, 1.0, EARTH);
        let across = sun.direction_N().cross(&Vector3::z()).normalize();
        let mut partial = 0;
        for i in 0..200_000 {
            let angle = f64::from(i) * std::f64::consts::TAU / 200_000.0;
            let (s, c) = libm::sincos(angle);
            let r_BN_N = (sun.direction_N() * c + across * s) * (EARTH + 520e3);
            let slow = if r_BN_N.dot(sun.direction_N()) > 0.0 { 1.0 } else { sun.seen_disc(&r_BN_N) };
            let fast = sun.illumination(&r_BN_N);
            assert_relative_eq!(fast, slow, epsilon = 1e-9);
            partial += u32::from(fast > 0.0 && fast < 1.0);
        }
        // The Sun's disc of 0.53° passes twice: 200 000/360·0.53·2, more slowly because the edge is slanted.
        assert!((590..900).contains(&partial), "{partial}");
    }

    #[test]
    fn the_next_shadow_is_where_half_the_sun_is_hidden() {
        let sun = Sun::at(75.0, 10.0, 1.0, EARTH);
        let (radius, speed) = (EARTH + 520e3, 7601.4);
        let n = speed / radius;
        let (x, y) = (Vector3::new(0.0, 0.8, 0.6), Vector3::new(1.0, 0.0, 0.0));
        let at = |t: f64| {
            let (s, c) = libm::sincos(n * t);
            ((x * c + y * s) * radius, (y * c - x * s) * speed)
        };
        for k in 0..400 {
            let t = f64::from(k) * 30.0;
            let (r_BN_N, v_BN_N) = at(t);
            let (begin, end) = sun.next_shadow_s(&r_BN_N, &v_BN_N).unwrap();
            assert!(begin < end && end > 0.0 && end <= std::f64::consts::TAU / n, "{begin} {end}");
            let within = sun.illumination(&at(t + 0.5 * (begin + end)).0);
            let (before, after) = (sun.illumination(&at(t + begin - 15.0).0), sun.illumination(&at(t + end + 15.0).0));
            assert_eq!((within, before, after), (0.0, 1.0, 1.0));
            let edge = sun.illumination(&at(t + begin).0);
            assert!((0.3..0.7).contains(&edge), "{edge}");
        }
        let beside = Sun::at(0.0, 90.0, 1.0, EARTH);
        assert_eq!(beside.next_shadow_s(&Vector3::new(radius, 0.0, 0.0), &Vector3::new(0.0, speed, 0.0)), None);
    }

    #[test]
    fn far_behind_the_earth_the_eclipse_is_annular() {
        let sun = Sun::new(Vector3::new(ASTRONOMICAL_UNIT, 0.0, 0.0), EARTH);
        let distance = 2e9;
        let a = SUN_RADIUS / (ASTRONOMICAL_UNIT + distance);
        let b = EARTH / distance;
        let seen = sun.illumination(&Vector3::new(-distance, 0.0, 0.0));
        assert_relative_eq!(seen, 1.0 - (b / a) * (b / a), max_relative = 1e-4);
    }
}
