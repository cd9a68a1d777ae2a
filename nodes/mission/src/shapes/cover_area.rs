//! Areas are covered: parallel great-circle strips, clipped to the area, in the direction that needs fewest of them.
//!
//! An area is laid out along an axis, a great circle through its middle: λ along the axis and φ across it are its
//! longitude and latitude there. Rows of strips follow parallels of the axis a little less than a swath apart; a row has
//! strips wherever its swath touches the area.

use nalgebra::{Matrix3, Vector3};

use super::sphere::{Arc, angle};

/// Which directions rows may have at an area's middle.
#[derive(Clone, Copy)]
pub enum Headings<'a> {
    /// Any: the one with the fewest strips is taken.
    Any,
    /// The one with the fewest strips of those at the middle's latitude [rad], clockwise from north [rad].
    At(&'a dyn Fn(f64) -> Vec<f64>),
}

/// How an area is covered.
#[derive(Clone, Copy)]
pub struct Swath<'a> {
    /// Width of what a strip shows [rad].
    pub width: f64,
    /// Shortest strip [rad].
    pub shortest: f64,
    /// Longest strip [rad].
    pub longest: f64,
    /// Share of the width that neighbouring rows both show.
    pub overlap: f64,
    /// Direction of the rows.
    pub headings: Headings<'a>,
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
/// Such points across a swath, at least: every strip has to have its share.
const WITHIN_SWATH: f64 = 3.0;
/// Least distance of those points [rad]: about 60 m, so that slivers cost no more than other areas.
const FINEST: f64 = 1e-5;
/// Most points of an edge that is cut into straight parts.
const CUTS_MAX: f64 = 10_000.0;

/// Covers the area of polygons; what lies in several counts once.
///
/// # Errors
/// When the area is empty or larger than can be laid out.
pub fn cover(polygons: &[Polygon], swath: &Swath<'_>) -> Result<Cover, CoverError> {
    let points = || polygons.iter().flatten().flatten();
    let middle = points().sum::<Vector3<f64>>().try_normalize(1e-9).ok_or(CoverError::Empty)?;
    let radius = points().map(|point| angle(&middle, point)).fold(0.0, f64::max);
    if radius > RADIUS_MAX {
        return Err(CoverError::TooLarge);
    }
    let directions: Vec<Vector3<f64>> = match swath.headings {
        Headings::At(headings) => {
            let headings = headings(libm::asin(middle.z.clamp(-1.0, 1.0)));
            headings.into_iter().map(|heading| turned(&middle, north(&middle), heading)).collect()
        }
        Headings::Any => {
            // From a direction of the area's own, so that it is covered alike wherever it lies.
            let far = points().max_by(|a, b| angle(&middle, a).total_cmp(&angle(&middle, b)));
            let far = far.and_then(|far| tangent(&middle, far)).ok_or(CoverError::Empty)?;
            // Where most strips are of full length, the direction changes little.
            let count = if radius > LARGE { 2 } else { HEADINGS };
            let turns = (0..count).map(|i| std::f64::consts::PI * f64::from(i) / f64::from(count));
            turns.map(|turn| turned(&middle, far, turn)).chain(longer_axis(polygons, &middle, &far)).collect()
        }
    };
    let layout = cheapest(polygons, middle, directions, swath).ok_or(CoverError::Empty)?;
    let arcs: Vec<_> = layout.rows(swath).iter().filter_map(|row| layout.strip(row, swath)).collect();
    layout.count(arcs, swath).ok_or(CoverError::Empty)
}

/// The layout along one of several directions that needs fewest strips; of those, the one with the shortest.
fn cheapest(
    polygons: &[Polygon],
    middle: Vector3<f64>,
    directions: Vec<Vector3<f64>>,
    swath: &Swath<'_>,
) -> Option<Layout> {
    let cost = |layout: &Layout| {
        let rows = layout.rows(swath);
        (rows.len(), rows.iter().map(|row| row.east - row.west).sum::<f64>())
    };
    let layouts = directions.into_iter().map(|along| Layout::new(polygons, middle, along, swath));
    let costs = layouts.map(|layout| (cost(&layout), layout));
    costs.min_by(|(a, _), (b, _)| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))).map(|(_, layout)| layout)
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
    fn new(polygons: &[Polygon], middle: Vector3<f64>, along: Vector3<f64>, swath: &Swath<'_>) -> Self {
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

    fn add_ring(&mut self, polygon: usize, ring: &[Vector3<f64>], swath: &Swath<'_>) {
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
    fn rows(&self, swath: &Swath<'_>) -> Vec<Row> {
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
    fn longest(&self, phi: f64, swath: &Swath<'_>) -> f64 {
        let bulge = swath.overlap * swath.width;
        let within = (8.0 * bulge / libm::tan(phi.abs()).max(1e-9)).sqrt();
        swath.longest.min(within).max(swath.shortest)
    }

    /// The strip of a row: half of it above its parallel, half below; one that is too short gets the least length.
    fn strip(&self, row: &Row, swath: &Swath<'_>) -> Option<Arc> {
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
    fn count(&self, arcs: Vec<Arc>, swath: &Swath<'_>) -> Option<Cover> {
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
        let step = (area / SAMPLES).sqrt().max(FINEST).min(swath.width / WITHIN_SWATH);
        let step = out_of_step(step, swath.width * (1.0 - swath.overlap));
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
    // A sine is less than its angle: most points are told to be outside without asking for that.
    if arc.normal().dot(point).abs() > 0.5 * width {
        return false;
    }
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
#[path = "cover_area_tests.rs"]
mod tests;
