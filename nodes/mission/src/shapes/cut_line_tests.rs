//! Lines are followed: walks over the sphere, and what their strips must keep.

use nalgebra::{Rotation3, Unit};
use proptest::prelude::*;

use super::*;
use crate::shapes::sphere::direction;

const EARTH_KM: f64 = 6378.1366;

fn limits() -> Limits {
    Limits { shortest: 20.0 / EARTH_KM, longest: 500.0 / EARTH_KM, tolerance: 6.0 / EARTH_KM }
}

fn line(places: &[[f64; 2]]) -> Vec<Vector3<f64>> {
    places.iter().map(|place| direction(*place)).collect()
}

fn km(pieces: &[Piece]) -> Vec<f64> {
    pieces.iter().map(|piece| angle(&piece.start.direction, &piece.end.direction) * EARTH_KM).collect()
}

/// Greatest distance of points all along a line from the nearest of the strips [rad].
fn farthest(points: &[Vector3<f64>], pieces: &[Piece]) -> f64 {
    let arcs: Vec<_> = pieces.iter().filter_map(|it| Arc::new(it.start.direction, it.end.direction)).collect();
    let edges = points.windows(2).filter(|ends| angle(&ends[0], &ends[1]) <= ANTIPODAL_ARC);
    let along = edges.flat_map(|ends| (0..=20).map(|k| between(&ends[0], &ends[1], f64::from(k) / 20.0)));
    let distance = |point| arcs.iter().map(|arc| arc.distance(&point)).fold(f64::INFINITY, f64::min);
    along.map(distance).fold(0.0, f64::max)
}

/// The fewest pieces of ordered stabbing of a line's points, found by trying directions: the longest run that some
/// straight line stabs in order, again and again.
fn fewest(points: &[Vector3<f64>], tolerance: f64) -> usize {
    let stabbed = |run: &[Vector3<f64>]| {
        let plane = Plane::at(run.iter().sum::<Vector3<f64>>().normalize());
        let Some(flat) = run.iter().map(|point| plane.project(point)).collect::<Option<Vec<_>>>() else {
            return false;
        };
        (0..2880).any(|i| {
            let (s, c) = (std::f64::consts::TAU * f64::from(i) / 2880.0).sin_cos();
            let across: Vec<_> = flat.iter().map(|p| p[1] * c - p[0] * s).collect();
            let (low, high) = across.iter().fold((f64::MAX, f64::MIN), |(l, h), a| (l.min(*a), h.max(*a)));
            let mut furthest = f64::MIN;
            high - low <= 2.0 * tolerance
                && flat.iter().zip(&across).all(|(p, a)| {
                    let off = a - 0.5 * (low + high);
                    let (along, reach) = (p[0] * c + p[1] * s, (tolerance * tolerance - off * off).max(0.0).sqrt());
                    furthest = furthest.max(along - reach);
                    furthest <= along + reach
                })
        })
    };
    let (mut count, mut begin) = (0, 0);
    while begin + 1 < points.len() {
        let end = (begin + 2..=points.len()).take_while(|end| stabbed(&points[begin..*end])).last();
        begin = end.map_or(begin + 1, |end| end - 1);
        count += 1;
    }
    count
}

/// A walk with bends: steps [km] and turns [deg] from a place in a direction.
fn walk(start: [f64; 2], heading_deg: f64, steps: &[(f64, f64)]) -> Vec<Vector3<f64>> {
    let mut at = direction(start);
    let east = Vector3::z().cross(&at).try_normalize(1e-9).unwrap_or_else(Vector3::y);
    let mut along = Rotation3::from_axis_angle(&Unit::new_normalize(at), heading_deg.to_radians()) * east;
    let mut points = vec![at];
    for (step_km, turn_deg) in steps {
        along = Rotation3::from_axis_angle(&Unit::new_normalize(at), turn_deg.to_radians()) * along;
        let step = step_km / EARTH_KM;
        (at, along) = (at * step.cos() + along * step.sin(), along * step.cos() - at * step.sin());
        points.push(at);
    }
    points
}

#[test]
fn a_bend_is_followed_and_a_straight_line_is_one_strip() {
    let bend = line(&[[100.0, 20.0], [101.0, 22.0], [102.0, 20.0]]);
    let followed = follow(&bend, &limits());
    assert_eq!(followed.pieces.len(), 2, "{followed:?}");
    assert!(farthest(&bend, &followed.pieces) <= limits().tolerance);
    let straight = line(&[[100.0, 20.0], [101.0, 20.001], [102.0, 20.0]]);
    let [piece] = follow(&straight, &limits()).pieces[..] else { panic!("one strip") };
    assert_eq!((piece.start.vertex, piece.end.vertex), (Some(0), Some(2)));
}

#[test]
fn long_lines_become_equal_strips_that_meet() {
    let pieces = follow(&line(&[[0.0, 0.0], [12.0, 0.0]]), &limits()).pieces;
    assert_eq!(pieces.len(), 3);
    assert!(pieces.windows(2).all(|two| two[0].end.direction == two[1].start.direction));
    assert!(km(&pieces).iter().all(|length| (length - 4_f64.to_radians() * EARTH_KM).abs() < 1e-6));
}

#[test]
fn whole_circles_work_and_only_antipodal_neighbours_do_not() {
    let equator: Vec<_> = (0..=36).map(|k| direction([-180.0 + 10.0 * f64::from(k), 0.0])).collect();
    let followed = follow(&equator, &limits());
    assert!(followed.antipodal.is_empty() && followed.pieces.len() == 81, "{}", followed.pieces.len());
    assert!(farthest(&equator, &followed.pieces) < 1e-9);
    let followed = follow(&line(&[[0.0, 0.0], [180.0, 0.0], [180.0, 10.0]]), &limits());
    assert_eq!(followed.antipodal, [0]);
    assert_eq!(followed.pieces.len(), 3, "10 degrees of the meridian are left");
    assert!(follow(&line(&[[3.0, 4.0]]), &limits()).pieces.is_empty());
    assert!(follow(&line(&[[3.0, 4.0], [3.0, 4.0]]), &limits()).pieces.is_empty());
}

#[test]
fn a_hundred_thousand_points_of_a_coast_are_few_strips() {
    let bends = (0..100_000).map(f64::from).map(|i| (0.5, 30.0 * (i * 0.37).sin() * (i * 0.011).cos()));
    let coast = walk([10.0, 45.0], 20.0, &bends.collect::<Vec<_>>());
    let followed = follow(&coast, &limits());
    assert!(farthest(&coast, &followed.pieces) <= limits().tolerance);
    assert!(followed.pieces.len() < 2000, "{}", followed.pieces.len());
}

fn walks() -> impl Strategy<Value = Vec<Vector3<f64>>> {
    let place = (-180.0..180.0, -90.0..=90.0).prop_map(|(longitude, latitude)| [longitude, latitude]);
    let place = prop_oneof![place, Just([180.0, 0.0]), Just([0.0, 90.0]), Just([-179.9, -89.99])];
    let step = (prop_oneof![0.0..30.0, 100.0..1500.0, Just(0.0)], prop_oneof![-40.0..40.0, -180.0..180.0]);
    (place, 0.0..360.0, prop::collection::vec(step, 1..60)).prop_map(|(at, heading, steps)| walk(at, heading, &steps))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn every_line_is_followed_within_the_tolerance_by_strips_that_may_be(points in walks()) {
        let followed = follow(&points, &limits());
        let length: f64 = points.windows(2).map(|ends| angle(&ends[0], &ends[1])).sum();
        for (piece, km) in followed.pieces.iter().zip(km(&followed.pieces)) {
            prop_assert!(km <= 500.0 + 1e-3, "{km} km");
            prop_assert!(km >= 20.0 - 1e-3 || length * EARTH_KM < 20.0, "{km} km");
            prop_assert!(piece.farthest <= limits().tolerance);
        }
        if !followed.pieces.is_empty() {
            prop_assert!(farthest(&points, &followed.pieces) <= limits().tolerance * 1.001);
        }
        let sum: f64 = followed.pieces.iter().map(|piece| piece.length).sum();
        prop_assert!((sum - length).abs() < 1e-6, "nothing is left out");
    }

    #[test]
    fn a_turned_globe_is_followed_alike(points in walks(), axis in (0.0..1.0, -1.0..1.0, 0.1..1.0), angle in 0.0..6.0) {
        let axis = Unit::new_normalize(Vector3::new(axis.0, axis.1, axis.2));
        let turn = Rotation3::from_axis_angle(&axis, angle);
        let turned: Vec<_> = points.iter().map(|point| turn * point).collect();
        let (one, other) = (follow(&points, &limits()), follow(&turned, &limits()));
        prop_assert_eq!(one.pieces.len(), other.pieces.len());
        for (piece, turned) in one.pieces.iter().zip(&other.pieces) {
            prop_assert!((turn * piece.start.direction - turned.start.direction).norm() < 1e-4);
            prop_assert!((turn * piece.end.direction - turned.end.direction).norm() < 1e-4);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20))]

    #[test]
    fn no_more_strips_than_ordered_stabbing_needs(
        place in (-180.0..180.0, -60.0..60.0),
        steps in prop::collection::vec((2.0..12.0, -50.0..50.0), 30..120),
    ) {
        let points = walk([place.0, place.1], 0.0, &steps);
        let strips = follow(&points, &Limits { shortest: 0.0, ..limits() }).pieces.len();
        let needed = fewest(&points, limits().tolerance);
        prop_assert!(strips as f64 <= (1.15 * needed as f64).max(needed as f64 + 1.0), "{strips} for {needed}");
    }
}
