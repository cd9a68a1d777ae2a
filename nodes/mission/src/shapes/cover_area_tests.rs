//! Areas are covered: shapes thrown at the cover, and what it must do with each.

use nalgebra::{Rotation3, Unit};
use proptest::prelude::*;

use super::*;
use crate::shapes::sphere::direction;

const EARTH_KM: f64 = 6378.1366;

fn swath() -> Swath<'static> {
    Swath {
        width: 12.0 / EARTH_KM,
        shortest: 20.0 / EARTH_KM,
        longest: 500.0 / EARTH_KM,
        overlap: 0.06,
        headings: Headings::Any,
    }
}

fn ring(places: &[[f64; 2]]) -> Vec<Vector3<f64>> {
    places.iter().map(|place| direction(*place)).collect()
}

/// A star about a place: distances of its points [km].
fn star(middle: [f64; 2], radii_km: &[f64]) -> Vec<Vector3<f64>> {
    let at = direction(middle);
    let along = north(&at);
    let point = |(i, radius): (usize, &f64)| {
        let along = turned(&at, along, std::f64::consts::TAU * i as f64 / radii_km.len() as f64);
        at * (radius / EARTH_KM).cos() + along * (radius / EARTH_KM).sin()
    };
    radii_km.iter().enumerate().map(point).collect()
}

/// Whether a point lies in a star-shaped or convex ring: it sees an odd number of edges on its way to a far point.
fn inside(ring: &[Vector3<f64>], point: &Vector3<f64>, outside: &Vector3<f64>) -> bool {
    let Some(way) = Arc::new(*point, *outside) else { return false };
    let edges = (0..ring.len()).filter_map(|i| Arc::new(ring[i], ring[(i + 1) % ring.len()]));
    let crosses = |edge: &Arc| {
        let side = |arc: &Arc, p: &Vector3<f64>| arc.normal().dot(p) > 0.0;
        side(edge, &way.start) != side(edge, &way.end) && side(&way, &edge.start) != side(&way, &edge.end)
    };
    edges.filter(crosses).count() % 2 == 1
}

/// Shares of an area that strips show at all and more than once, by points thrown at it.
fn looked_at(polygon: &Polygon, cover: &Cover, middle: [f64; 2], radius_km: f64) -> (f64, f64) {
    let (at, mut all, mut once, mut twice) = (direction(middle), 0, 0, 0);
    let far = turned(&at, north(&at), 1.0) * 1.0_f64.sin() + at * 1.0_f64.cos();
    for i in 0..16_000 {
        // Fibonacci's spiral fills the cap evenly.
        let cos = 1.0 - (1.0 - (radius_km / EARTH_KM).cos()) * (f64::from(i) + 0.5) / 16_000.0;
        let along = turned(&at, north(&at), 2.399_963 * f64::from(i));
        let point = at * cos + along * (1.0 - cos * cos).max(0.0).sqrt();
        if polygon.iter().filter(|ring| inside(ring, &point, &far)).count() % 2 == 1 {
            let seen = cover.strips.iter().filter(|(arc, _)| shows(arc, &point, swath().width)).count();
            all += 1;
            once += i32::from(seen > 0);
            twice += i32::from(seen > 1);
        }
    }
    (f64::from(once) / f64::from(all), f64::from(twice) / f64::from(all))
}

#[test]
fn a_rectangle_is_covered_along_its_longer_side() {
    let side = 4.5; // degrees of a great circle, 501 km
    let rectangle = vec![ring(&[[0.0, 0.0], [side, 0.0], [side, 0.3], [0.0, 0.3]])];
    let cover = cover(std::slice::from_ref(&rectangle), &swath()).unwrap();
    assert!(cover.covered > 0.995 && cover.twice < 0.10, "{} {}", cover.covered, cover.twice);
    assert_eq!(cover.strips.len(), 6, "three rows of 12 km, each in two");
    let area = 4.5_f64.to_radians() * 0.3_f64.to_radians().sin();
    assert!((cover.area / area - 1.0).abs() < 1e-3, "{} {area}", cover.area);
    let shares: f64 = cover.strips.iter().map(|(_, share)| share).sum();
    assert!((shares - cover.covered).abs() < 1e-9);
}

#[test]
fn a_hole_is_left_out_and_what_lies_in_two_polygons_counts_once() {
    let outer = star([179.5, 60.0], &[300.0; 40]);
    let whole = cover(&[vec![outer.clone()]], &swath()).unwrap();
    let holed: Polygon = vec![outer.clone(), star([179.5, 60.0], &[200.0; 40])];
    let with_hole = cover(std::slice::from_ref(&holed), &swath()).unwrap();
    assert!((with_hole.area / whole.area - 5.0 / 9.0).abs() < 0.01);
    let length = |cover: &Cover| cover.strips.iter().map(|(arc, _)| arc.length).sum::<f64>();
    assert!(length(&with_hole) < 0.75 * length(&whole));
    let (shown, twice) = looked_at(&holed, &with_hole, [179.5, 60.0], 310.0);
    assert!(shown > 0.99 && twice < 0.15, "{shown} {twice}");
    let double = cover(&[vec![outer.clone()], vec![outer]], &swath()).unwrap();
    assert_eq!(double.strips.len(), whole.strips.len());
    assert!((double.area / whole.area - 1.0).abs() < 1e-9);
}

#[test]
fn rows_follow_a_heading_that_is_given() {
    let square = star([20.0, 50.0], &[100.0, 100.0, 100.0, 100.0]);
    let cover = cover(&[vec![square]], &Swath { headings: Headings::At(&|_| vec![0.5]), ..swath() }).unwrap();
    for (arc, _) in &cover.strips {
        let north = north(&arc.start);
        let along = tangent(&arc.start, &arc.end).unwrap();
        let heading = along.dot(&north.cross(&arc.start)).atan2(along.dot(&north));
        assert!((heading - 0.5).abs() < 0.05, "{heading}");
    }
}

#[test]
fn what_is_no_area_is_refused() {
    assert_eq!(cover(&[], &swath()), Err(CoverError::Empty));
    let line = vec![ring(&[[0.0, 0.0], [1.0, 0.0]])];
    assert_eq!(cover(&[line], &swath()), Err(CoverError::Empty));
    let half = vec![ring(&[[0.0, 0.0], [120.0, 0.0], [-120.0, 10.0]])];
    assert!(cover(&[half], &swath()).is_err());
}

fn stars() -> impl Strategy<Value = ([f64; 2], Vec<f64>, Option<f64>)> {
    let place = (-180.0..180.0, -90.0..=90.0).prop_map(|(longitude, latitude)| [longitude, latitude]);
    let place = prop_oneof![place, Just([180.0, 10.0]), Just([0.0, 90.0]), Just([-90.0, -89.5])];
    (place, prop::collection::vec(40.0..500.0, 3..12), prop::option::of(0.2..0.9))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn areas_are_covered_without_much_overlap((middle, radii, hole) in stars()) {
        let outer = star(middle, &radii);
        let mut polygon = vec![outer];
        polygon.extend(hole.map(|hole| star(middle, &radii.iter().map(|radius| radius * hole).collect::<Vec<_>>())));
        let cover = cover(std::slice::from_ref(&polygon), &swath()).unwrap();
        prop_assert!(cover.strips.iter().all(|(arc, _)| (20.0 - 1e-3..=500.0 + 1e-3).contains(&(arc.length * EARTH_KM))));
        prop_assert!(cover.covered > 0.99 && cover.twice < 0.15, "{} {}", cover.covered, cover.twice);
        let (shown, twice) = looked_at(&polygon, &cover, middle, 500.0);
        prop_assert!((shown - cover.covered).abs() < 0.02 && (twice - cover.twice).abs() < 0.06, "{} {}", shown, twice);
    }

    #[test]
    fn a_turned_globe_is_covered_alike((middle, radii, _) in stars(), angle in 0.0..6.0, axis in (0.0..1.0, -1.0..1.0)) {
        let outer = star(middle, &radii);
        let turn = Rotation3::from_axis_angle(&Unit::new_normalize(Vector3::new(axis.0, axis.1, 0.5)), angle);
        let turned = outer.iter().map(|point| turn * point).collect();
        let (one, other) = (cover(&[vec![outer]], &swath()).unwrap(), cover(&[vec![turned]], &swath()).unwrap());
        prop_assert_eq!(one.strips.len(), other.strips.len());
        prop_assert!((one.covered - other.covered).abs() < 1e-3);
    }

    #[test]
    fn slivers_and_repeated_points_are_covered_too(
        (middle, mut radii, hole) in stars(),
        thin in prop::collection::vec((0_usize..12, 0.02..3.0), 0..8),
        repeats in 1_usize..4,
    ) {
        let count = radii.len();
        thin.into_iter().for_each(|(i, radius)| radii[i % count] = radius);
        let repeated = |ring: Vec<Vector3<f64>>| ring.into_iter().flat_map(|point| vec![point; repeats]).collect();
        let mut polygon: Polygon = vec![repeated(star(middle, &radii))];
        polygon.extend(hole.map(|hole| {
            repeated(star(middle, &radii.iter().map(|radius| radius * hole).collect::<Vec<_>>()))
        }));
        let again = cover(std::slice::from_ref(&polygon), &swath());
        match cover(&[polygon], &swath()) {
            Ok(cover) => {
                let within = |(arc, _): &(Arc, f64)| (20.0 - 1e-3..=500.0 + 1e-3).contains(&(arc.length * EARTH_KM));
                prop_assert!(cover.strips.iter().all(within));
                prop_assert!(cover.covered > 0.99, "{}", cover.covered);
                prop_assert_eq!(Ok(cover), again, "the same whenever it is asked for");
            }
            Err(error) => prop_assert_eq!(error, CoverError::Empty),
        }
    }
}
