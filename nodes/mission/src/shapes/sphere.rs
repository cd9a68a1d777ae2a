//! The unit sphere: directions, arcs between them, and the plane in which great circles are straight.

use nalgebra::Vector3;
use swath_sim::world::frames::{direction_E, latitude_longitude_deg};

/// Arc beyond which two points have no great circle between them [rad].
pub const ANTIPODAL_ARC: f64 = std::f64::consts::PI - 1e-6;

/// A place as people write it: longitude and latitude [deg].
pub type Place = [f64; 2];

/// Direction of a place.
#[must_use]
pub fn direction(place: Place) -> Vector3<f64> {
    direction_E(place[1], place[0])
}

/// Place of a direction.
#[must_use]
pub fn place(direction: &Vector3<f64>) -> Place {
    let (latitude_deg, longitude_deg) = latitude_longitude_deg(direction);
    [longitude_deg, latitude_deg]
}

/// Angle between two directions [rad].
#[must_use]
pub fn angle(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    libm::atan2(a.cross(b).norm(), a.dot(b))
}

/// The point at a share of the arc from `a` to `b`, which are not antipodal.
#[must_use]
pub fn between(a: &Vector3<f64>, b: &Vector3<f64>, share: f64) -> Vector3<f64> {
    let arc = angle(a, b);
    if arc < 1e-12 {
        return *a;
    }
    ((a * libm::sin((1.0 - share) * arc) + b * libm::sin(share * arc)) / libm::sin(arc)).normalize()
}

/// A great-circle arc that is shorter than half a turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arc {
    /// Unit vector to the start.
    pub start: Vector3<f64>,
    /// Unit vector to the end.
    pub end: Vector3<f64>,
    normal: Vector3<f64>,
    along: Vector3<f64>,
    /// Length [rad].
    pub length: f64,
}

impl Arc {
    /// The arc between two directions; none when they are the same or antipodal.
    #[must_use]
    pub fn new(start: Vector3<f64>, end: Vector3<f64>) -> Option<Self> {
        let length = angle(&start, &end);
        if !(1e-12..=ANTIPODAL_ARC).contains(&length) {
            return None;
        }
        let normal = start.cross(&end).normalize();
        Some(Self { start, end, normal, along: normal.cross(&start), length })
    }

    /// Unit normal of its great circle: the arc runs counter-clockwise about it.
    #[must_use]
    pub fn normal(&self) -> &Vector3<f64> {
        &self.normal
    }

    /// Distance across its great circle, to the left [rad], and along it from the start, -π to π [rad].
    #[must_use]
    pub fn across_along(&self, point: &Vector3<f64>) -> (f64, f64) {
        let across = libm::asin(self.normal.dot(point).clamp(-1.0, 1.0));
        (across, libm::atan2(point.dot(&self.along), point.dot(&self.start)))
    }

    /// The point of its great circle at a distance from the start [rad].
    #[must_use]
    pub fn at(&self, along: f64) -> Vector3<f64> {
        self.start * libm::cos(along) + self.along * libm::sin(along)
    }

    /// Distance of a point from the arc [rad].
    #[must_use]
    pub fn distance(&self, point: &Vector3<f64>) -> f64 {
        let (across, along) = self.across_along(point);
        if (0.0..=self.length).contains(&along) {
            across.abs()
        } else {
            angle(&self.start, point).min(angle(&self.end, point))
        }
    }

    /// The same arc made longer on both sides until it has a length [rad].
    #[must_use]
    pub fn stretched(&self, length: f64) -> Self {
        let more = 0.5 * (length - self.length).max(0.0);
        let (start, end) = (self.at(-more), self.at(self.length + more));
        Self::new(start.normalize(), end.normalize()).unwrap_or(*self)
    }
}

/// The plane that touches the sphere at a point; seen from the sphere's centre, great circles are straight there.
#[derive(Clone, Copy, Debug)]
pub struct Plane {
    centre: Vector3<f64>,
    x: Vector3<f64>,
    y: Vector3<f64>,
}

impl Plane {
    /// The plane at a point.
    #[must_use]
    pub fn at(centre: Vector3<f64>) -> Self {
        // Any direction that is not near the centre's.
        let other = if centre.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
        let x = other.cross(&centre).normalize();
        Self { centre, x, y: centre.cross(&x) }
    }

    /// Where a direction pierces the plane; none behind or near the horizon.
    #[must_use]
    pub fn project(&self, direction: &Vector3<f64>) -> Option<[f64; 2]> {
        let depth = direction.dot(&self.centre);
        (depth > 0.2).then(|| [direction.dot(&self.x) / depth, direction.dot(&self.y) / depth])
    }

    /// The direction of a point of the plane.
    #[must_use]
    pub fn lift(&self, point: [f64; 2]) -> Vector3<f64> {
        (self.centre + self.x * point[0] + self.y * point[1]).normalize()
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    #[test]
    fn arcs_measure_across_along_and_beyond_their_ends() {
        let arc = Arc::new(direction([0.0, 0.0]), direction([10.0, 0.0])).unwrap();
        let (across, along) = arc.across_along(&direction([4.0, 1.0]));
        assert_relative_eq!(across.to_degrees(), 1.0, epsilon = 1e-12);
        assert_relative_eq!(along.to_degrees(), 4.0, epsilon = 1e-12);
        assert_relative_eq!(arc.distance(&direction([13.0, 0.0])).to_degrees(), 3.0, epsilon = 1e-12);
        assert_relative_eq!(arc.distance(&direction([-180.0, 0.0])).to_degrees(), 170.0, epsilon = 1e-9);
        let longer = arc.stretched(12_f64.to_radians());
        assert_relative_eq!(place(&longer.end)[0], 11.0, epsilon = 1e-12);
        assert!(Arc::new(arc.start, -arc.start).is_none() && Arc::new(arc.start, arc.start).is_none());
    }

    #[test]
    fn great_circles_are_straight_in_the_plane() {
        let (a, b) = (direction([170.0, 60.0]), direction([-170.0, 70.0]));
        let plane = Plane::at(between(&a, &b, 0.4));
        let [p, q, r] = [0.0, 0.3, 1.0].map(|share| plane.project(&between(&a, &b, share)).unwrap());
        let cross = (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
        assert_relative_eq!(cross, 0.0, epsilon = 1e-15);
        assert_relative_eq!(plane.lift(q), between(&a, &b, 0.3), epsilon = 1e-15);
        assert_eq!(plane.project(&-a), None);
    }
}
