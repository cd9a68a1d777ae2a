//! Lines are followed: the fewest great-circle strips, in the line's order, from which no point of it is further than a
//! tolerance.
//!
//! A strip covers a part of the line if a straight line stabs the discs of the tolerance's radius around its points in
//! their order (Guibas et al. 1993, *Approximating polygons and subdivisions with minimum-link paths*). From where the
//! last strip ended, the next one is the one that reaches furthest. Straightness is judged in the plane that touches the
//! sphere there, in which great circles are straight.

use nalgebra::Vector3;

use super::sphere::{ANTIPODAL_ARC, Arc, Plane, angle, between};

/// What strips may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Shortest strip [rad].
    pub shortest: f64,
    /// Longest strip [rad].
    pub longest: f64,
    /// Greatest distance of the line from its strip [rad].
    pub tolerance: f64,
}

/// An end of a strip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct End {
    /// Unit vector.
    pub direction: Vector3<f64>,
    /// The point of the line that it is, if it is one.
    pub vertex: Option<usize>,
}

/// A strip along a part of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// Where it starts.
    pub start: End,
    /// Where it ends.
    pub end: End,
    /// Greatest distance of the part from the strip [rad].
    pub farthest: f64,
    /// Length of the part along the line [rad].
    pub length: f64,
}

/// How a line is followed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Followed {
    /// The strips, in the order of the line.
    pub pieces: Vec<Piece>,
    /// Numbers, from 0, of points that have no great circle to the next one.
    pub antipodal: Vec<usize>,
}

/// A position along a line: the number of a point, and the share of the way to the next one, below 1.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
struct At {
    vertex: usize,
    share: f64,
}

/// The part of a line between two positions, and the strip that follows it.
struct Part {
    from: At,
    to: At,
    arc: Arc,
    /// Whether the strip goes from the part's first point to its last.
    chord: bool,
    /// Whether it ends where it does because strips may be no longer.
    full: bool,
}

/// Why a strip cannot follow a part of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Unfit {
    /// It would be too long.
    Long,
    /// It would be too far from it, or run against it.
    Far,
}

/// Share of the tolerance that is used: what is left is for what the plane distorts.
const USED: f64 = 0.999;
/// How exactly the end of a part is sought within an edge [rad]: 1 m.
const EXACT: f64 = 1.6e-7;
/// Most halvings of an edge in that search.
const HALVINGS_MAX: f64 = 20.0;

/// Follows a line; where two neighbouring points are antipodal, it is followed before and after.
#[must_use]
pub fn follow(points: &[Vector3<f64>], limits: &Limits) -> Followed {
    let mut followed = Followed::default();
    let mut begin = 0;
    for i in 1..=points.len() {
        let broken = i < points.len() && angle(&points[i - 1], &points[i]) > ANTIPODAL_ARC;
        if broken {
            followed.antipodal.push(i - 1);
        }
        if broken || i == points.len() {
            let line = Line::new(&points[begin..i], begin);
            followed.pieces.extend(line.pieces(limits));
            begin = i;
        }
    }
    followed
}

/// A line without points that repeat.
struct Line {
    points: Vec<Vector3<f64>>,
    /// Number of each point as it was given.
    numbers: Vec<usize>,
    /// Length up to each point [rad].
    lengths: Vec<f64>,
}

impl Line {
    fn new(points: &[Vector3<f64>], first: usize) -> Self {
        let mut line = Self { points: Vec::new(), numbers: Vec::new(), lengths: Vec::new() };
        for (number, point) in (first..).zip(points) {
            let step = line.points.last().map_or(0.0, |last| angle(last, point));
            if line.points.is_empty() || step > 1e-12 {
                line.lengths.push(line.lengths.last().copied().unwrap_or(0.0) + step);
                line.points.push(*point);
                line.numbers.push(number);
            }
        }
        line
    }

    fn last(&self) -> At {
        At { vertex: self.points.len() - 1, share: 0.0 }
    }

    fn point(&self, at: At) -> Vector3<f64> {
        match self.points.get(at.vertex + 1).filter(|_| at.share > 0.0) {
            Some(next) => between(&self.points[at.vertex], next, at.share),
            None => self.points[at.vertex],
        }
    }

    /// Length of the line up to a position [rad].
    fn length(&self, at: At) -> f64 {
        let before = self.lengths[at.vertex];
        self.lengths.get(at.vertex + 1).map_or(before, |next| before + at.share * (next - before))
    }

    /// The position at a length [rad].
    fn position(&self, length: f64) -> At {
        let vertex = self.lengths.partition_point(|before| *before <= length).saturating_sub(1);
        match self.lengths.get(vertex + 1) {
            Some(next) => At { vertex, share: (length - self.lengths[vertex]) / (next - self.lengths[vertex]) },
            None => self.last(),
        }
    }

    /// The points of a part, its ends included.
    fn part(&self, from: At, to: At) -> Vec<Vector3<f64>> {
        let mut points = vec![self.point(from)];
        let inner = from.vertex + 1..=to.vertex;
        points.extend(self.points.get(inner).unwrap_or(&[]));
        if to.share > 0.0 {
            points.push(self.point(to));
        }
        points
    }

    fn pieces(&self, limits: &Limits) -> Vec<Piece> {
        if self.points.len() < 2 {
            return Vec::new();
        }
        let mut parts = Vec::new();
        let mut at = At { vertex: 0, share: 0.0 };
        let mut guess = 1;
        while at < self.last() {
            let Some(part) = self.furthest(at, guess, limits) else { break };
            guess = (part.to.vertex - part.from.vertex).max(1);
            at = part.to;
            parts.push(part);
        }
        self.even_out(&mut parts, limits);
        self.join(&mut parts, limits);
        let whole = self.lengths.last().copied().unwrap_or(0.0);
        parts.into_iter().map(|part| self.piece(&part, whole, limits)).collect()
    }

    /// The part from a position on that reaches furthest with one strip: about so many points far.
    fn furthest(&self, from: At, guess: usize, limits: &Limits) -> Option<Part> {
        let fits = |to: At| fit(&self.part(from, to), limits).map(|(arc, chord)| (to, arc, chord));
        let vertex = |vertex: usize| At { vertex, share: 0.0 };
        // Twice as far each time, and then back by halves.
        let (mut good, mut bad, mut step) = (None, None, guess);
        let mut good_vertex = from.vertex;
        while bad.is_none() && good_vertex < self.last().vertex {
            let next = (good_vertex + step).min(self.last().vertex);
            match fits(vertex(next)) {
                Ok(found) => (good, good_vertex, step) = (Some(found), next, 2 * step),
                Err(unfit) => bad = Some((next, unfit)),
            }
        }
        while let Some((far, _)) = bad.filter(|(far, _)| far - good_vertex > 1) {
            let middle = usize::midpoint(good_vertex, far);
            match fits(vertex(middle)) {
                Ok(found) => (good, good_vertex) = (Some(found), middle),
                Err(unfit) => bad = Some((middle, unfit)),
            }
        }
        let mut full = false;
        if let Some((_, unfit)) = bad {
            full = unfit == Unfit::Long;
            let start = if good_vertex == from.vertex { from.share } else { 0.0 };
            let (mut near, mut far) = (start, 1.0);
            let edge = self.lengths[good_vertex + 1] - self.lengths[good_vertex];
            for _ in 0..(edge / EXACT).log2().ceil().clamp(1.0, HALVINGS_MAX) as u32 {
                let share = f64::midpoint(near, far);
                match fits(At { vertex: good_vertex, share }) {
                    Ok(found) => (good, near) = (Some(found), share),
                    Err(_) => far = share,
                }
            }
        }
        good.map(|(to, arc, chord)| Part { from, to, arc, chord, full })
    }

    /// Parts that ended only because strips may be no longer become equally long together with the one after them.
    fn even_out(&self, parts: &mut [Part], limits: &Limits) {
        let mut begin = 0;
        while begin < parts.len() {
            let end = (begin..parts.len()).find(|&i| !parts[i].full).unwrap_or(parts.len() - 1);
            let count = end + 1 - begin;
            let (from, to) = (self.length(parts[begin].from), self.length(parts[end].to));
            let cut = |k: usize| match k {
                0 => parts[begin].from,
                k if k == count => parts[end].to,
                k => self.position(from + (to - from) * k as f64 / count as f64),
            };
            let even: Option<Vec<_>> = (0..count)
                .map(|k| {
                    let (from, to) = (cut(k), cut(k + 1));
                    let (arc, chord) = fit(&self.part(from, to), limits).ok()?;
                    Some(Part { from, to, arc, chord, full: false })
                })
                .collect();
            if let Some(even) = even.filter(|_| count > 1) {
                for (part, even) in parts[begin..=end].iter_mut().zip(even) {
                    *part = even;
                }
            }
            begin = end + 1;
        }
    }

    /// Neighbouring strips are brought to meet where their great circles cross, if that is near where their parts do.
    fn join(&self, parts: &mut [Part], limits: &Limits) {
        for i in 1..parts.len() {
            let (one, next) = (parts[i - 1].arc, parts[i].arc);
            if parts[i - 1].chord && parts[i].chord {
                continue;
            }
            let crossing = one.normal().cross(next.normal());
            if crossing.norm() < 1e-9 {
                continue;
            }
            let near = self.point(parts[i].from);
            let crossing = crossing.normalize() * crossing.dot(&near).signum();
            if angle(&crossing, &near) > 4.0 * limits.tolerance {
                continue;
            }
            let (Some(one), Some(next)) = (Arc::new(one.start, crossing), Arc::new(crossing, next.end)) else {
                continue;
            };
            let good = |arc: &Arc, part: &Part| {
                let forward = arc.normal().dot(part.arc.normal()) > 0.0;
                forward && arc.length <= limits.longest && self.farthest(arc, part) <= limits.tolerance
            };
            if good(&one, &parts[i - 1]) && good(&next, &parts[i]) {
                (parts[i - 1].arc, parts[i].arc) = (one, next);
            }
        }
    }

    fn farthest(&self, arc: &Arc, part: &Part) -> f64 {
        self.part(part.from, part.to).iter().map(|point| arc.distance(point)).fold(0.0, f64::max)
    }

    /// The strip of a part. A part that is too short, of a line that is not, gets a strip of the least length.
    fn piece(&self, part: &Part, whole: f64, limits: &Limits) -> Piece {
        let mut arc = part.arc;
        if arc.length < limits.shortest && whole >= limits.shortest {
            arc = arc.stretched(limits.shortest);
        }
        let end = |direction: Vector3<f64>, at: At| {
            let exact = direction == self.point(at) && at.share == 0.0;
            End { direction, vertex: exact.then(|| self.numbers[at.vertex]) }
        };
        Piece {
            start: end(arc.start, part.from),
            end: end(arc.end, part.to),
            farthest: self.farthest(&arc, part),
            length: self.length(part.to) - self.length(part.from),
        }
    }
}

/// A strip that follows points, and whether it goes from the first to the last of them.
fn fit(points: &[Vector3<f64>], limits: &Limits) -> Result<(Arc, bool), Unfit> {
    let (Some(&first), Some(&last)) = (points.first(), points.last()) else { return Err(Unfit::Far) };
    // What is further away than a strip is long is on no strip with the first point.
    let reach = (limits.longest + 2.0 * limits.tolerance).min(std::f64::consts::PI);
    let nearest = libm::cos(reach);
    if points.iter().any(|point| first.dot(point) < nearest) {
        return Err(Unfit::Long);
    }
    let tolerance = limits.tolerance * USED;
    if let Some(arc) = Arc::new(first, last)
        && points.iter().all(|point| arc.normal().dot(point).abs() <= tolerance)
        && follows(points.iter().map(|point| arc.across_along(point)), arc.length, tolerance)
    {
        return if arc.length <= limits.longest { Ok((arc, true)) } else { Err(Unfit::Long) };
    }
    let plane = Plane::at(points.iter().sum::<Vector3<f64>>().try_normalize(1e-9).ok_or(Unfit::Far)?);
    let flat = points.iter().map(|point| plane.project(point)).collect::<Option<Vec<_>>>().ok_or(Unfit::Far)?;
    let (offset, normal) = narrowest(&flat, 2.0 * tolerance).ok_or(Unfit::Far)?;
    let mut along = [-normal[1], normal[0]];
    let dot = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
    if dot(along, flat[flat.len() - 1]) < dot(along, flat[0]) {
        along = [normal[1], -normal[0]];
    }
    let places = flat.iter().map(|point| (dot(normal, *point) - offset, dot(along, *point)));
    let low = places.clone().map(|(_, s)| s).fold(f64::INFINITY, f64::min);
    let high = places.clone().map(|(_, s)| s).fold(f64::NEG_INFINITY, f64::max);
    if !follows(places.map(|(d, s)| (d, s - low)), high - low, tolerance) {
        return Err(Unfit::Far);
    }
    let lift = |s: f64| plane.lift([normal[0] * offset + along[0] * s, normal[1] * offset + along[1] * s]);
    let arc = Arc::new(lift(low), lift(high)).ok_or(Unfit::Far)?;
    if arc.length > limits.longest {
        return Err(Unfit::Long);
    }
    // What the plane distorts counts on the sphere.
    let far = points.iter().any(|point| arc.distance(point) > limits.tolerance);
    if far { Err(Unfit::Far) } else { Ok((arc, false)) }
}

/// Whether a segment stabs the discs around points in their order; of each point the distance across and along.
fn follows(mut places: impl Iterator<Item = (f64, f64)>, length: f64, tolerance: f64) -> bool {
    let mut furthest = 0.0_f64;
    places.all(|(across, along)| {
        let reach = tolerance * tolerance - across * across;
        if reach < 0.0 {
            return false;
        }
        let reach = reach.sqrt();
        furthest = furthest.max(along - reach);
        furthest <= along + reach && furthest <= length && along + reach >= 0.0
    })
}

/// The middle of the narrowest band that holds points: its offset along its unit normal; none when it is wider than
/// `widest`. One of the band's edges is an edge of the points' hull.
fn narrowest(points: &[[f64; 2]], widest: f64) -> Option<(f64, [f64; 2])> {
    let hull = hull(points);
    let count = hull.len();
    let height = |i: usize, normal: [f64; 2], j: usize| {
        (hull[j][0] - hull[i][0]) * normal[0] + (hull[j][1] - hull[i][1]) * normal[1]
    };
    let mut best: Option<(f64, f64, [f64; 2])> = None;
    let mut top = 1;
    for i in 0..count {
        let (a, b) = (hull[i], hull[(i + 1) % count]);
        let length = (b[0] - a[0]).hypot(b[1] - a[1]);
        if length == 0.0 {
            continue;
        }
        let normal = [-(b[1] - a[1]) / length, (b[0] - a[0]) / length];
        for _ in 0..count {
            let next = (top + 1) % count;
            if height(i, normal, next) <= height(i, normal, top) {
                break;
            }
            top = next;
        }
        let width = height(i, normal, top);
        if best.is_none_or(|(narrowest, ..)| width < narrowest) {
            best = Some((width, a[0] * normal[0] + a[1] * normal[1] + 0.5 * width, normal));
        }
    }
    best.filter(|(width, ..)| *width <= widest).map(|(_, offset, normal)| (offset, normal))
}

/// Convex hull, counter-clockwise (Andrew's monotone chain).
fn hull(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut sorted = points.to_vec();
    sorted.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    sorted.dedup();
    let turns_left =
        |a: [f64; 2], b: [f64; 2], c: [f64; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0.0;
    let chain = |points: &mut dyn Iterator<Item = &[f64; 2]>| {
        let mut chain: Vec<[f64; 2]> = Vec::new();
        for &point in points {
            while let [.., a, b] = chain[..]
                && !turns_left(a, b, point)
            {
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let mut hull = chain(&mut sorted.iter());
    hull.extend(chain(&mut sorted.iter().rev()));
    if hull.is_empty() { sorted } else { hull }
}

#[cfg(test)]
#[path = "cut_line_tests.rs"]
mod tests;
