//! Ground strips: the great circle that the virtual target follows, and what a request may ask for.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::config::RequestLimits;
use crate::error::StripError;
use crate::time::TickPeriod;
use crate::world::frames::{direction_E, earth_to_inertial};

/// Identity of a strip within a mission.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct StripId(pub u64);

impl StripId {
    /// The identity of the strip at an index, from 0: identities begin at 1.
    #[must_use]
    pub fn from_index(index: usize) -> Self {
        Self(index as u64 + 1)
    }

    /// Index of the strip among all, from 0; none for 0, which is no identity.
    #[must_use]
    pub fn index(self) -> Option<usize> {
        usize::try_from(self.0.checked_sub(1)?).ok()
    }
}

/// What a request asks for: the paper's (r_start, r_end, p, v_acq) in an operator's units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StripRequest {
    /// Geocentric latitude of the start [deg].
    pub start_latitude_deg: f64,
    /// Longitude of the start, east positive [deg].
    pub start_longitude_deg: f64,
    /// Geocentric latitude of the end [deg].
    pub end_latitude_deg: f64,
    /// Longitude of the end, east positive [deg].
    pub end_longitude_deg: f64,
    /// Priority p in [0, 1].
    pub priority: f64,
    /// Speed v_acq of the target along the ground [m/s].
    pub acquisition_speed_m_s: f64,
    /// Whether the strip may as well be imaged from its end to its start.
    #[serde(default)]
    pub bidirectional: bool,
}

/// A strip on the great circle from start to end, in the planet-fixed frame E.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strip {
    /// Unit vector to the start.
    pub start_E: Vector3<f64>,
    /// Unit tangent at the start, along the scan.
    pub along_E: Vector3<f64>,
    /// Central angle from start to end [rad].
    pub arc: f64,
    /// Angular acquisition speed v_acq/R_E [rad/s].
    pub angular_speed: f64,
    /// Priority p in [0, 1].
    pub priority: f64,
}

/// Strips whose ends are this close to opposite have no defined great circle [rad].
const ANTIPODAL_MARGIN: f64 = 1e-6;

impl StripRequest {
    /// Checks a request and lays its great circle on a sphere of `radius` [m].
    ///
    /// # Errors
    /// Why the request is refused, with the value and the limit.
    pub fn to_strip(&self, limits: &RequestLimits, radius: f64) -> Result<Strip, StripError> {
        self.check_numbers()?;
        if !(limits.speed_min_m_s..=limits.speed_max_m_s).contains(&self.acquisition_speed_m_s) {
            return Err(StripError::Speed {
                speed_m_s: self.acquisition_speed_m_s,
                min_m_s: limits.speed_min_m_s,
                max_m_s: limits.speed_max_m_s,
            });
        }
        let strip = self.great_circle(radius)?;
        let length_km = strip.arc * radius / 1e3;
        // The limit is meant for people: a metre of rounding is not a reason to refuse.
        if !(limits.length_min_km - 1e-3..=limits.length_max_km + 1e-3).contains(&length_km) {
            return Err(StripError::Length { length_km, min_km: limits.length_min_km, max_km: limits.length_max_km });
        }
        Ok(strip)
    }

    fn check_numbers(&self) -> Result<(), StripError> {
        for (field, value) in [
            ("start latitude", self.start_latitude_deg),
            ("start longitude", self.start_longitude_deg),
            ("end latitude", self.end_latitude_deg),
            ("end longitude", self.end_longitude_deg),
            ("priority", self.priority),
            ("acquisition speed", self.acquisition_speed_m_s),
        ] {
            if !value.is_finite() {
                return Err(StripError::NotFinite { field, value });
            }
        }
        for (field, value_deg) in [("start latitude", self.start_latitude_deg), ("end latitude", self.end_latitude_deg)]
        {
            if !(-90.0..=90.0).contains(&value_deg) {
                return Err(StripError::Latitude { field, value_deg });
            }
        }
        for (field, value_deg) in
            [("start longitude", self.start_longitude_deg), ("end longitude", self.end_longitude_deg)]
        {
            if !(-180.0..=360.0).contains(&value_deg) {
                return Err(StripError::Longitude { field, value_deg });
            }
        }
        if !(0.0..=1.0).contains(&self.priority) {
            return Err(StripError::Priority { priority: self.priority });
        }
        Ok(())
    }

    fn great_circle(&self, radius: f64) -> Result<Strip, StripError> {
        let start_E = direction_E(self.start_latitude_deg, self.start_longitude_deg);
        let end_E = direction_E(self.end_latitude_deg, self.end_longitude_deg);
        let normal = start_E.cross(&end_E);
        let arc = libm::atan2(normal.norm(), start_E.dot(&end_E));
        if arc > std::f64::consts::PI - ANTIPODAL_MARGIN {
            return Err(StripError::Antipodal);
        }
        let along_E = normal.cross(&start_E);
        let norm = along_E.norm();
        Ok(Strip {
            start_E,
            // A strip of no length has no direction; its length is refused by the caller's limit.
            along_E: if norm > 0.0 { along_E / norm } else { Vector3::zeros() },
            arc,
            angular_speed: self.acquisition_speed_m_s / radius,
            priority: self.priority,
        })
    }

    /// The same strip scanned from its end to its start.
    #[must_use]
    pub fn reversed(&self) -> Self {
        Self {
            start_latitude_deg: self.end_latitude_deg,
            start_longitude_deg: self.end_longitude_deg,
            end_latitude_deg: self.start_latitude_deg,
            end_longitude_deg: self.start_longitude_deg,
            ..self.clone()
        }
    }
}

impl Strip {
    /// Time T_acq to image the strip [s].
    #[must_use]
    pub fn acquisition_time_s(&self) -> f64 {
        self.arc / self.angular_speed
    }

    /// T_acq in whole ticks, rounded up.
    #[must_use]
    pub fn acquisition_ticks(&self, period: TickPeriod) -> u32 {
        period.ticks_ceil(self.acquisition_time_s())
    }

    /// Unit vector of the target and of its scan direction in E, `elapsed` [s] after the start of imaging; negative
    /// times lie on the circle's extension before the start.
    #[inline]
    #[must_use]
    pub fn target_E(&self, elapsed: f64) -> (Vector3<f64>, Vector3<f64>) {
        let (s, c) = libm::sincos(self.angular_speed * elapsed);
        (self.start_E * c + self.along_E * s, self.along_E * c - self.start_E * s)
    }

    /// Position of the target on a sphere of `radius` [m] and unit vector of its scan direction in N, as
    /// [`target_E`](Self::target_E), when cosine and sine of the Earth's rotation angle are `earth`.
    #[inline]
    #[must_use]
    pub fn target_N(&self, elapsed: f64, earth: (f64, f64), radius: f64) -> (Vector3<f64>, Vector3<f64>) {
        let (target_E, scan_E) = self.target_E(elapsed);
        (earth_to_inertial(earth, &target_E) * radius, earth_to_inertial(earth, &scan_E))
    }

    /// Unit vector to the strip's end in E.
    #[must_use]
    pub fn end_E(&self) -> Vector3<f64> {
        let (s, c) = libm::sincos(self.arc);
        self.start_E * c + self.along_E * s
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    const RADIUS: f64 = 6_378_136.6;

    fn request() -> StripRequest {
        StripRequest {
            start_latitude_deg: 10.0,
            start_longitude_deg: 20.0,
            end_latitude_deg: 12.0,
            end_longitude_deg: 21.0,
            priority: 0.5,
            acquisition_speed_m_s: 3000.0,
            bidirectional: false,
        }
    }

    #[test]
    fn the_target_goes_from_start_to_end_at_the_acquisition_speed() {
        let request = request();
        let strip = request.to_strip(&RequestLimits::default(), RADIUS).unwrap();
        let (target, scan) = strip.target_E(strip.acquisition_time_s());
        assert_relative_eq!(target, direction_E(12.0, 21.0), epsilon = 1e-14);
        assert_relative_eq!(target, strip.end_E(), epsilon = 1e-14);
        assert_relative_eq!(target.dot(&scan), 0.0, epsilon = 1e-15);
        let (before, _) = strip.target_E(-1.0);
        assert_relative_eq!((strip.start_E - before).norm() * RADIUS, 3000.0, epsilon = 1e-3);
    }

    #[test]
    fn each_fault_has_its_own_error() {
        let limits = RequestLimits::default();
        let error = |change: fn(&mut StripRequest)| {
            let mut request = request();
            change(&mut request);
            request.to_strip(&limits, RADIUS).unwrap_err()
        };
        assert!(matches!(error(|r| r.priority = f64::NAN), StripError::NotFinite { field: "priority", .. }));
        assert!(matches!(error(|r| r.start_latitude_deg = 91.0), StripError::Latitude { value_deg: 91.0, .. }));
        assert!(matches!(error(|r| r.end_longitude_deg = -181.0), StripError::Longitude { value_deg: -181.0, .. }));
        assert!(matches!(error(|r| r.priority = 1.5), StripError::Priority { priority: 1.5 }));
        assert!(matches!(error(|r| r.acquisition_speed_m_s = 100.0), StripError::Speed { speed_m_s: 100.0, .. }));
        assert!(matches!(error(|r| r.end_latitude_deg = 60.0), StripError::Length { .. }));
        let opposite = error(|r| (r.end_latitude_deg, r.end_longitude_deg) = (-10.0, 200.0));
        assert_eq!(opposite, StripError::Antipodal);
        let point = error(|r| (r.end_latitude_deg, r.end_longitude_deg) = (10.0, 20.0));
        assert!(matches!(point, StripError::Length { length_km: 0.0, .. }));
    }

    #[test]
    fn a_reversed_strip_ends_where_the_strip_starts() {
        let limits = RequestLimits::default();
        let (request, reversed) = (request(), request().reversed());
        let strip = request.to_strip(&limits, RADIUS).unwrap();
        let twin = reversed.to_strip(&limits, RADIUS).unwrap();
        assert_relative_eq!(strip.start_E, twin.end_E(), epsilon = 1e-9);
        assert_relative_eq!(strip.end_E(), twin.start_E, epsilon = 1e-9);
        assert!((strip.start_E - twin.start_E).norm() > 1e-9);
    }

    #[test]
    fn identities_begin_at_one() {
        assert_eq!((StripId::from_index(0), StripId(1).index(), StripId(0).index()), (StripId(1), Some(0), None));
    }
}
