//! How near lines are to their strips, and how many strips they need at least.

use nalgebra::Vector3;
use serde_json::{Value, json};
use swath_mission::orders::feature_strips::Cutting;
use swath_mission::orders::found::Import;
use swath_mission::shapes::sphere::{ANTIPODAL_ARC, Arc, Place, Plane, angle, between, direction};

/// Lines are looked at as often [km].
const STEP_KM: f64 = 1.0;
/// Points of a line between which ordered stabbing may part it [km].
const PART_KM: f64 = 4.0;
/// Directions and offsets that are tried for one straight line through the discs of a run.
const DIRECTIONS: u32 = 96;
const OFFSETS: [f64; 5] = [0.5, 0.25, 0.75, 0.05, 0.95];
/// Strips and lines are the same to this share of the tolerance.
const SLACK: f64 = 1e-3;

/// What became of the lines of a set.
#[derive(Default)]
pub struct Lines {
    lines: usize,
    length_km: f64,
    within_km: f64,
    farthest_km: f64,
    strips: usize,
    fewest: usize,
    /// Lines with less than 99 % of their length within the tolerance.
    astray: Vec<Value>,
}

impl Lines {
    /// Adds a line and its strips.
    pub fn add(&mut self, line: &[Place], import: &Import, cutting: &Cutting) {
        let points: Vec<_> = line.iter().map(|place| direction(*place)).collect();
        let km = cutting.radius_m / 1e3;
        let arcs = super::strips(import);
        let (mut length, mut within) = (0.0, 0.0);
        let mut last = 0;
        for edge in points.windows(2) {
            let arc = angle(&edge[0], &edge[1]);
            if arc > ANTIPODAL_ARC {
                continue;
            }
            let steps = (arc * km / STEP_KM).ceil().max(1.0);
            for k in 0..steps as u32 {
                let point = between(&edge[0], &edge[1], (f64::from(k) + 0.5) / steps);
                let distance = nearest(&arcs, &mut last, &point) * km;
                self.farthest_km = self.farthest_km.max(distance);
                within += f64::from(distance <= cutting.tolerance_km * (1.0 + SLACK)) * arc / steps;
            }
            length += arc;
        }
        if length > 0.0 && within < 0.99 * length {
            let reasons: Vec<_> = import.refused.iter().map(|fault| fault.reason.clone()).collect();
            self.astray
                .push(json!({ "from": line.first(), "km": length * km, "within": within / length, "why": reasons }));
        }
        self.lines += 1;
        self.length_km += length * km;
        self.within_km += within * km;
        self.strips += arcs.len();
        self.fewest += fewest(&points, cutting.tolerance_km / km, cutting.longest_km / km);
    }

    /// What is told of them.
    pub fn told(self) -> Value {
        json!({
            "lines": self.lines,
            "km": self.length_km,
            "within": self.within_km / self.length_km.max(1e-9),
            "farthest_km": self.farthest_km,
            "strips": self.strips,
            "fewest": self.fewest,
            "strips_over_fewest": self.strips as f64 / self.fewest.max(1) as f64,
            "astray": self.astray,
        })
    }
}

/// Distance of a point from the nearest strip [rad]; the one that was nearest last is asked first.
fn nearest(arcs: &[Arc], last: &mut usize, point: &Vector3<f64>) -> f64 {
    let mut least = arcs.get(*last).map_or(f64::INFINITY, |arc| arc.distance(point));
    for (i, arc) in arcs.iter().enumerate() {
        // A strip that is further away with all of it cannot be nearer.
        if angle(&arc.start, point) - arc.length > least {
            continue;
        }
        let distance = arc.distance(point);
        if distance < least {
            (least, *last) = (distance, i);
        }
    }
    least
}

/// The fewest straight pieces, of some length at most, that stab the discs around a line's points in their order: the
/// longest run that one piece stabs, again and again (Guibas et al. 1993).
fn fewest(points: &[Vector3<f64>], tolerance: f64, longest: f64) -> usize {
    let mut dense: Vec<Vector3<f64>> = points.first().copied().into_iter().collect();
    for edge in points.windows(2) {
        let arc = angle(&edge[0], &edge[1]);
        let cuts = (arc * 6378.0 / PART_KM).ceil().max(1.0);
        let broken = arc > ANTIPODAL_ARC;
        (1..=cuts as u32)
            .filter(|_| !broken)
            .for_each(|k| dense.push(between(&edge[0], &edge[1], f64::from(k) / cuts)));
    }
    let (mut count, mut begin) = (0, 0);
    while begin + 1 < dense.len() {
        let fits = |end: usize| stabbed(&dense[begin..=end], tolerance, longest);
        let (mut good, mut step) = (begin + 1, 1);
        while good + step < dense.len() && fits(good + step) {
            good += step;
            step *= 2;
        }
        while step > 0 {
            if good + step < dense.len() && fits(good + step) {
                good += step;
            } else {
                step /= 2;
            }
        }
        (begin, count) = (good, count + 1);
    }
    count
}

fn stabbed(run: &[Vector3<f64>], tolerance: f64, longest: f64) -> bool {
    let (first, last) = (run[0], run[run.len() - 1]);
    if run.iter().any(|point| angle(&first, point) > longest + 2.0 * tolerance) {
        return false;
    }
    let plane = Plane::at(run.iter().sum::<Vector3<f64>>().normalize());
    let Some(flat) = run.iter().map(|point| plane.project(point)).collect::<Option<Vec<_>>>() else { return false };
    let (a, b) = (flat[0], flat[flat.len() - 1]);
    let chord = angle(&first, &last);
    let half = if chord > 2.0 * tolerance { (2.0 * tolerance / chord).asin() } else { std::f64::consts::PI };
    let along = (b[1] - a[1]).atan2(b[0] - a[0]);
    (0..=DIRECTIONS).any(|i| {
        let turn = along + half * (2.0 * f64::from(i) / f64::from(DIRECTIONS) - 1.0);
        stabbed_along(&flat, turn, tolerance, longest)
    })
}

fn stabbed_along(flat: &[[f64; 2]], turn: f64, tolerance: f64, longest: f64) -> bool {
    let (s, c) = turn.sin_cos();
    let across = |p: &[f64; 2]| p[1] * c - p[0] * s;
    let (low, high) = flat.iter().map(across).fold((f64::MAX, f64::MIN), |(l, h), a| (l.min(a), h.max(a)));
    let room = 2.0 * tolerance - (high - low);
    room >= 0.0
        && OFFSETS.iter().any(|share| {
            let middle = high - tolerance + share * room;
            let (mut furthest, mut nearest) = (f64::MIN, f64::MAX);
            let ordered = flat.iter().all(|p| {
                let off = across(p) - middle;
                let (along, reach) = (p[0] * c + p[1] * s, (tolerance * tolerance - off * off).max(0.0).sqrt());
                furthest = furthest.max(along - reach);
                nearest = nearest.min(along + reach);
                furthest <= along + reach
            });
            ordered && furthest - nearest <= longest
        })
}
