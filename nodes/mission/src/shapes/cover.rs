//! Areas are covered: parallel great-circle strips, clipped to the area, in the direction that needs fewest of them.
//!
//! An area is laid out along an axis, a great circle through its middle: λ along the axis and φ across it are its
//! longitude and latitude there. Rows of strips follow parallels of the axis a little less than a swath apart; a row has
//! strips wherever its swath touches the area.

use nalgebra::{Matrix3, Vector3};

use super::sphere::{Arc, angle};

/// How an area is covered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Swath {
    /// Width of what a strip shows [rad].
    pub width: f64,
    /// Shortest strip [rad].
    pub shortest: f64,
    /// Longest strip [rad].
    pub longest: f64,
    /// Share of the width that neighbouring rows both show.
    pub overlap: f64,
    /// Direction of the rows at the area's middle, clockwise from north [rad]; none for the one with the fewest strips.
    pub heading: Option<f64>,
}

/// A polygon: its rings, the outer one and those of holes, in any order and sense, without their last points, which are
/// their first.
pub type Polygon = Vec<Vec<Vector3<f64>>>;

/// How an area is covered.
#[derive(Clone, Debug, PartialEq)]
pub struct Cover {
    /// The strips, and of each the share of the area that it alone shows, or its part of what several show.
    pub strips: Vec<(Arc, f64)>,
    /// Share of the area that is shown.
    pub covered: f64,
    /// Share of the area that is shown more than once.
    pub twice: f64,
    /// Size of the area [sr].
    pub area: f64,
}

/// Why an area cannot be covered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CoverError {
    /// It has no three points that are apart.
    #[error("an area needs three points that are apart")]
    Empty,
    /// It is too large to have an inside.
    #[error("an area that spans more than 140 degrees is too large to be covered as one")]
    TooLarge,
}

/// Greatest distance of a point from the middle of its area [rad].
const RADIUS_MAX: f64 = 70.0 / 180.0 * std::f64::consts::PI;
/// Distance of a point from the middle of an area beyond which few directions are tried [rad].
const LARGE: f64 = 0.25;
/// Directions that are tried.
const HEADINGS: u32 = 18;
/// Points at which what is shown is counted, about.
const SAMPLES: f64 = 20_000.0;
/// Least distance of those points [rad]: about 60 m, so that slivers cost no more than other areas.
const FINEST: f64 = 1e-5;
/// Most points of an edge that is cut into straight parts.
const CUTS_MAX: f64 = 10_000.0;

/// Covers the area of polygons; what lies in several counts once.
///
/// # Errors
/// When the area is empty or larger than can be laid out.
pub fn cover(polygons: &[Polygon], swath: &Swath) -> Result<Cover, CoverError> {
    let points = || polygons.iter().flatten().flatten();
    let middle = points().sum::<Vector3<f64>>().try_normalize(1e-9).ok_or(CoverError::Empty)?;
    let radius = points().map(|point| angle(&middle, point)).fold(0.0, f64::max);
    if radius > RADIUS_MAX {
        return Err(CoverError::TooLarge);
    }
    let lay = |along: Vector3<f64>| Layout::new(polygons, middle, along, swath);
    let layout = match swath.heading {
        Some(heading) => lay(turned(&middle, north(&middle), heading)),
        None => {
            // From a direction of the area's own, so that it is covered alike wherever it lies.
            let far = points().max_by(|a, b| angle(&middle, a).total_cmp(&angle(&middle, b)));
            let far = far.and_then(|far| tangent(&middle, far)).ok_or(CoverError::Empty)?;
            // Where most strips are of full length, the direction changes little.
            let count = if radius > LARGE { 2 } else { HEADINGS };
            let turns = (0..count).map(|i| std::f64::consts::PI * f64::from(i) / f64::from(count));
            let directions = turns.map(|turn| turned(&middle, far, turn)).chain(longer_axis(polygons, &middle, &far));
            let cost = |layout: &Layout| {
                let rows = layout.rows(swath);
                (rows.len(), rows.iter().map(|row| row.east - row.west).sum::<f64>())
            };
            let layouts = directions.map(lay).map(|layout| (cost(&layout), layout));
            let best = layouts.min_by(|(a, _), (b, _)| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
            best.map(|(_, layout)| layout).ok_or(CoverError::Empty)?
        }
    };
    let arcs: Vec<_> = layout.rows(swath).iter().filter_map(|row| layout.strip(row, swath)).collect();
    layout.count(arcs, swath).ok_or(CoverError::Empty)
}

/// The direction in which an area's boundary extends most, if it has one; `along` is any direction at its middle.
fn longer_axis(polygons: &[Polygon], middle: &Vector3<f64>, along: &Vector3<f64>) -> Option<Vector3<f64>> {
    let across = middle.cross(along);
    let rings = polygons.iter().flatten();
    let edges = rings.flat_map(|ring| (0..ring.len()).map(move |i| (ring[i], ring[(i + 1) % ring.len()])));
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for (a, b) in edges {
        let (weight, at) = ((b - a).norm(), 0.5 * (a + b));
        let (x, y) = (at.dot(along), at.dot(&across));
        (xx, xy, yy) = (xx + weight * x * x, xy + weight * x * y, yy + weight * y * y);
    }
    let spread = (xx - yy).hypot(2.0 * xy);
    // What is round has no longer side.
    (spread > 0.05 * (xx + yy)).then(|| {
        let angle = 0.5 * libm::atan2(2.0 * xy, xx - yy);
        along * libm::cos(angle) + across * libm::sin(angle)
    })
}

/// The direction from a point towards another one.
fn tangent(at: &Vector3<f64>, towards: &Vector3<f64>) -> Option<Vector3<f64>> {
    (towards - at * at.dot(towards)).try_normalize(1e-9)
}

/// North at a point; at a pole, the meridian of longitude 0.
fn north(at: &Vector3<f64>) -> Vector3<f64> {
    tangent(at, &Vector3::z()).or_else(|| tangent(at, &Vector3::x())).unwrap_or_else(Vector3::y)
}

/// A direction at a point turned clockwise.
fn turned(at: &Vector3<f64>, along: Vector3<f64>, angle: f64) -> Vector3<f64> {
    along * libm::cos(angle) + along.cross(at) * libm::sin(angle)
}

/// An area along an axis.
struct Layout {
    /// Rows are the axes' x, y and z in the sphere's own frame: x is the area's middle, z the axis' pole.
    dcm_AE: Matrix3<f64>,
    /// Edges of the rings: of which polygon, and λ and φ of both ends.
    edges: Vec<(usize, [f64; 2], [f64; 2])>,
    south: f64,
    north: f64,
}

/// A strip of a row: φ of the row, λ of both ends.
struct Row {
    phi: f64,
    west: f64,
    east: f64,
}

impl Layout {
    fn new(polygons: &[Polygon], middle: Vector3<f64>, along: Vector3<f64>, swath: &Swath) -> Self {
        let across = middle.cross(&along);
        let dcm_AE = Matrix3::from_rows(&[middle.transpose(), along.transpose(), across.transpose()]);
        let mut layout = Self { dcm_AE, edges: Vec::new(), south: f64::INFINITY, north: f64::NEG_INFINITY };
        for (number, polygon) in polygons.iter().enumerate() {
            for ring in polygon {
                layout.add_ring(number, ring, swath);
            }
        }
        layout
    }

    fn add_ring(&mut self, polygon: usize, ring: &[Vector3<f64>], swath: &Swath) {
        for (i, a) in ring.iter().enumerate() {
            let b = &ring[(i + 1) % ring.len()];
            // A great circle is straight in λ and φ as long as it is short.
            let Some(arc) = Arc::new(*a, *b) else { continue };
            let cuts = (arc.length / swath.width).ceil().clamp(1.0, CUTS_MAX);
            let mut from = self.place(a);
            for k in 1..=cuts as u32 {
                let to = self.place(&if f64::from(k) < cuts { arc.at(arc.length * f64::from(k) / cuts) } else { *b });
                self.edges.push((polygon, from, to));
                self.south = self.south.min(from[1]);
                self.north = self.north.max(from[1]);
                from = to;
            }
        }
    }

    /// λ and φ of a direction.
    fn place(&self, direction: &Vector3<f64>) -> [f64; 2] {
        let at = self.dcm_AE * direction;
        [libm::atan2(at.y, at.x), libm::asin(at.z.clamp(-1.0, 1.0))]
    }

    fn direction(&self, lambda: f64, phi: f64) -> Vector3<f64> {
        let (cos_phi, sin_phi) = (libm::cos(phi), libm::sin(phi));
        let at = Vector3::new(cos_phi * libm::cos(lambda), cos_phi * libm::sin(lambda), sin_phi);
        self.dcm_AE.transpose() * at
    }

    /// Where each of equally spaced parallels lies within the area: intervals of λ that do not touch, in order.
    fn inside(&self, first: f64, step: f64, count: usize) -> Vec<Vec<[f64; 2]>> {
        let mut crossings: Vec<Vec<(usize, f64)>> = vec![Vec::new(); count];
        for &(polygon, a, b) in &self.edges {
            let (low, high) = if a[1] <= b[1] { (a, b) } else { (b, a) };
            // Those with low ≤ φ < high, so that a point that two edges share counts once.
            let from = ((low[1] - first) / step).ceil().max(0.0) as usize;
            for (k, row) in crossings.iter_mut().enumerate().skip(from) {
                let phi = first + step * k as f64;
                if phi < low[1] {
                    continue;
                }
                if phi >= high[1] {
                    break;
                }
                let share = (phi - low[1]) / (high[1] - low[1]);
                row.push((polygon, low[0] + share * (high[0] - low[0])));
            }
        }
        let intervals = |mut at: Vec<(usize, f64)>| {
            at.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
            let by_polygon = at.chunk_by(|a, b| a.0 == b.0);
            union(by_polygon.flat_map(|own| own.chunks_exact(2)).map(|pair| [pair[0].1, pair[1].1]).collect())
        };
        crossings.into_iter().map(intervals).collect()
    }

    /// The strips of all rows.
    fn rows(&self, swath: &Swath) -> Vec<Row> {
        let step = swath.width * (1.0 - swath.overlap);
        let height = self.north - self.south;
        let count = (((height - swath.width) / step).ceil().max(0.0) as usize) + 1;
        // What the rows show beyond the area is shared between both sides.
        let beyond = swath.width + step * (count - 1) as f64 - height;
        let bottom = self.south - 0.5 * beyond;
        let mut touched = self.within_rows(bottom, step, swath.width, count);
        for offset in [0.0, swath.width] {
            for (row, inside) in touched.iter_mut().zip(self.inside(bottom + offset, step, count)) {
                row.extend(inside);
            }
        }
        let mut rows = Vec::new();
        for (k, intervals) in touched.into_iter().enumerate() {
            let phi = bottom + 0.5 * swath.width + step * k as f64;
            for [west, east] in nearer_than(union(intervals), swath.shortest / libm::cos(phi)) {
                let longest = self.longest(phi, swath) / libm::cos(phi);
                let pieces = ((east - west) / longest - 1e-9).ceil().max(1.0);
                let at = |i: u32| west + (east - west) * f64::from(i) / pieces;
                rows.extend((0..pieces as u32).map(|i| Row { phi, west: at(i), east: at(i + 1) }));
            }
        }
        rows
    }

    /// λ of the parts of edges that lie within each row.
    fn within_rows(&self, bottom: f64, step: f64, width: f64, count: usize) -> Vec<Vec<[f64; 2]>> {
        let mut rows: Vec<Vec<[f64; 2]>> = vec![Vec::new(); count];
        for &(_, a, b) in &self.edges {
            let (low, high) = if a[1] <= b[1] { (a, b) } else { (b, a) };
            let first = ((low[1] - bottom - width) / step).floor().max(0.0) as usize;
            for (k, row) in rows.iter_mut().enumerate().skip(first) {
                let south = bottom + step * k as f64;
                if south > high[1] {
                    break;
                }
                let (from, to) = (low[1].max(south), high[1].min(south + width));
                if from > to {
                    continue;
                }
                let at = |phi: f64| {
                    let share = if high[1] > low[1] { (phi - low[1]) / (high[1] - low[1]) } else { 0.0 };
                    low[0] + share * (high[0] - low[0])
                };
                let ends = if high[1] > low[1] { [at(from), at(to)] } else { [low[0], high[0]] };
                row.push([ends[0].min(ends[1]), ends[0].max(ends[1])]);
            }
        }
        rows
    }

    /// Longest strip of a row: a great circle leaves its parallel by length²/8·tan φ, and what rows share must hold it.
    fn longest(&self, phi: f64, swath: &Swath) -> f64 {
        let bulge = swath.overlap * swath.width;
        let within = (8.0 * bulge / libm::tan(phi.abs()).max(1e-9)).sqrt();
        swath.longest.min(within).max(swath.shortest)
    }

    /// The strip of a row: half of it above its parallel, half below; one that is too short gets the least length.
    fn strip(&self, row: &Row, swath: &Swath) -> Option<Arc> {
        let bulge = libm::atan(libm::tan(row.phi) / libm::cos(0.5 * (row.east - row.west))) - row.phi;
        let phi = row.phi - 0.5 * bulge;
        let arc = Arc::new(self.direction(row.west, phi), self.direction(row.east, phi));
        // A part that is only a point still is a place to look at.
        let arc = arc.or_else(|| {
            let half = 0.5 * swath.shortest / libm::cos(phi);
            Arc::new(self.direction(row.west - half, phi), self.direction(row.west + half, phi))
        })?;
        Some(if arc.length < swath.shortest { arc.stretched(swath.shortest) } else { arc })
    }

    /// Counts at a lattice of points of the area what strips show.
    fn count(&self, arcs: Vec<Arc>, swath: &Swath) -> Option<Cover> {
        // First how large it is, then a lattice as fine as that allows.
        let lines = |step: f64| {
            let count = ((self.north - self.south) / step).ceil().max(1.0) as usize;
            let first = self.south + 0.5 * step;
            let lines = self.inside(first, step, count).into_iter().enumerate();
            lines.map(move |(k, intervals)| (first + step * k as f64, intervals)).collect::<Vec<_>>()
        };
        let size = |lines: &[(f64, Vec<[f64; 2]>)], step: f64| {
            let length = |(phi, intervals): &(f64, Vec<[f64; 2]>)| {
                libm::cos(*phi) * intervals.iter().map(|[west, east]| east - west).sum::<f64>()
            };
            step * lines.iter().map(length).sum::<f64>()
        };
        let coarse = (self.north - self.south) / 1000.0;
        let area = size(&lines(coarse), coarse);
        if area.is_nan() || area <= 0.0 {
            return None;
        }
        let step = out_of_step((area / SAMPLES).sqrt().max(FINEST), swath.width * (1.0 - swath.overlap));
        let index = Rows::new(&arcs, |direction| self.place(direction)[1], self.south, swath.width);
        let (mut all, mut covered, mut twice) = (0.0, 0.0, 0.0);
        let mut shares = vec![0.0; arcs.len()];
        let mut seen = Vec::new();
        for (phi, intervals) in lines(step) {
            for [west, east] in intervals {
                let count = ((east - west) * libm::cos(phi) / step).ceil().max(1.0);
                let weight = (east - west) * libm::cos(phi) / count;
                for i in 0..count as u32 {
                    let point = self.direction(west + (east - west) * (f64::from(i) + 0.5) / count, phi);
                    seen.clear();
                    seen.extend(index.near(phi).iter().copied().filter(|&i| shows(&arcs[i], &point, swath.width)));
                    all += weight;
                    covered += if seen.is_empty() { 0.0 } else { weight };
                    twice += if seen.len() > 1 { weight } else { 0.0 };
                    seen.iter().for_each(|&i| shares[i] += weight / seen.len() as f64);
                }
            }
        }
        let strips = arcs.into_iter().zip(shares).map(|(arc, share)| (arc, share / all)).collect();
        Some(Cover { strips, covered: covered / all, twice: twice / all, area })
    }
}

/// About the same spacing, with a ratio to the rows' that no small whole numbers make: a lattice in step with the rows
/// would meet too much or too little of what two of them show.
fn out_of_step(step: f64, rows: f64) -> f64 {
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    if step < rows { rows / ((rows / step).floor() + golden) } else { rows * ((step / rows).floor() + golden) }
}

/// Whether a strip shows a point.
#[must_use]
pub fn shows(arc: &Arc, point: &Vector3<f64>, width: f64) -> bool {
    let (across, along) = arc.across_along(point);
    across.abs() <= 0.5 * width && (0.0..=arc.length).contains(&along)
}

/// Strips by the parallels that they may show.
struct Rows {
    south: f64,
    width: f64,
    rows: Vec<Vec<usize>>,
}

impl Rows {
    fn new(arcs: &[Arc], phi: impl Fn(&Vector3<f64>) -> f64, south: f64, width: f64) -> Self {
        let mut rows = Self { south, width, rows: Vec::new() };
        for (i, arc) in arcs.iter().enumerate() {
            let along = [0.0, 0.5, 1.0].map(|share| phi(&arc.at(share * arc.length)));
            let (low, high) = (along.into_iter().fold(1.0, f64::min), along.into_iter().fold(-1.0, f64::max));
            let (first, last) = (rows.row(low - 0.51 * width), rows.row(high + 0.51 * width));
            if rows.rows.len() <= last {
                rows.rows.resize(last + 1, Vec::new());
            }
            rows.rows[first..=last].iter_mut().for_each(|row| row.push(i));
        }
        rows
    }

    fn row(&self, phi: f64) -> usize {
        ((phi - self.south) / self.width).max(0.0) as usize
    }

    fn near(&self, phi: f64) -> &[usize] {
        self.rows.get(self.row(phi)).map_or(&[], Vec::as_slice)
    }
}

/// Intervals that do not touch, in order, of any that may.
fn union(intervals: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    nearer_than(intervals, 0.0)
}

/// The same with those as one that are no further apart than `gap`.
fn nearer_than(mut intervals: Vec<[f64; 2]>, gap: f64) -> Vec<[f64; 2]> {
    intervals.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]));
    let mut apart: Vec<[f64; 2]> = Vec::new();
    for [west, east] in intervals {
        match apart.last_mut().filter(|last| west <= last[1] + gap) {
            Some(last) => last[1] = last[1].max(east),
            None => apart.push([west, east]),
        }
    }
    apart
}

#[cfg(test)]
mod tests {
    use nalgebra::{Rotation3, Unit};
    use proptest::prelude::*;

    use super::super::sphere::direction;
    use super::*;

    const EARTH_KM: f64 = 6378.1366;

    fn swath() -> Swath {
        Swath {
            width: 12.0 / EARTH_KM,
            shortest: 20.0 / EARTH_KM,
            longest: 500.0 / EARTH_KM,
            overlap: 0.06,
            heading: None,
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
        let cover = cover(&[vec![square]], &Swath { heading: Some(0.5), ..swath() }).unwrap();
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
    }
}
