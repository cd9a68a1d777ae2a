//! The lines and areas of a feature, in degrees, become the ends of strips.

use swath_sim::config::SimConfig;

use super::rows::{Passes, Rows};
use super::short_lines::{Numbered, ShortLines, joined};
use crate::shapes::cover_area::{Cover, Headings, Polygon, Swath, cover};
use crate::shapes::cut_line::{Limits, follow};
use crate::shapes::sphere::{ANTIPODAL_ARC, Arc, Place, angle, direction, place};

/// How lines and areas become strips.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cutting {
    /// Shortest strip [km].
    pub shortest_km: f64,
    /// Longest strip [km].
    pub longest_km: f64,
    /// Width of what the camera shows [km].
    pub swath_km: f64,
    /// Greatest distance of a line from its strips [km].
    pub tolerance_km: f64,
    /// Direction of the strips of an area.
    pub rows: Rows,
    /// The satellite's way over the ground.
    pub passes: Passes,
    /// What becomes of lines that are shorter than the shortest strip.
    pub short_lines: ShortLines,
    /// Radius of the Earth [m].
    pub radius_m: f64,
}

/// Width of what the camera shows, unless a mission says otherwise [km].
pub const SWATH_KM: f64 = 12.0;
/// Share of the swath that neighbouring strips of an area both show.
const OVERLAP: f64 = 0.06;
/// A line that is longer by so small a share of the longest strip is not cut: what was cut is not cut again.
const CUT_SLACK: f64 = 1e-6;
/// Longest edge of an area that is not cut [deg]: edges are straight on the map (RFC 7946), great circles are not.
const EDGE_DEG: f64 = 0.5;
/// Points of a parallel are as far apart [deg].
const PARALLEL_DEG: f64 = 1.0;

/// A strip's ends, and its share of the worth of its line or area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CutStrip {
    /// Where it starts.
    pub start: Place,
    /// Where it ends.
    pub end: Place,
    /// Its share.
    pub share: f64,
}

/// The boundary of an area.
#[derive(Clone, Debug, PartialEq)]
pub struct Outline {
    rings: Vec<Vec<Place>>,
    polygon: Polygon,
}

/// The strips of a line.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CutLine {
    /// The strips, in the order of the line.
    pub strips: Vec<CutStrip>,
    /// Length of the line [km].
    pub length_km: f64,
    /// Greatest distance of the line from its strips [km].
    pub farthest_km: f64,
    /// What is left out, and why.
    pub left_out: Vec<String>,
    /// Whether its only strip is shorter than a strip may be.
    pub too_short: bool,
}

impl Cutting {
    /// What a configuration allows, with the usual swath.
    #[must_use]
    pub fn of(config: &SimConfig) -> Self {
        Self {
            shortest_km: config.requests.length_min_km,
            longest_km: config.requests.length_max_km,
            swath_km: SWATH_KM,
            tolerance_km: 0.5 * SWATH_KM,
            rows: Rows::default(),
            passes: Passes::of(config),
            short_lines: ShortLines::default(),
            radius_m: config.earth.radius_m,
        }
    }

    fn angle_of(&self, km: f64) -> f64 {
        km * 1e3 / self.radius_m
    }

    fn km(&self, angle: f64) -> f64 {
        angle * self.radius_m / 1e3
    }

    /// Cuts a line into the fewest strips that follow it. What is wrong with a place of a line of two, or with a line
    /// that is no line, is told when its strip is submitted.
    ///
    /// # Errors
    /// When it has no two points.
    pub fn line(&self, line: &[Place]) -> Result<CutLine, String> {
        let needed = || "a line needs two points of longitude and latitude".to_owned();
        if line.iter().flatten().any(|number| number.is_nan()) {
            return Err(needed());
        }
        let places = along_parallels_and_meridians(line.iter().map(|it| wrapped(*it)).collect());
        let [first, .., last] = places[..] else { return Err(needed()) };
        let as_it_is = CutLine { strips: vec![CutStrip { start: first, end: last, share: 1.0 }], ..CutLine::default() };
        if places.iter().any(|place| !is_on_earth(place)) {
            return Ok(as_it_is);
        }
        let points: Vec<_> = places.iter().map(|it| direction(*it)).collect();
        let followed = follow(&points, &self.limits());
        if followed.pieces.is_empty() {
            return Ok(as_it_is);
        }
        let total: f64 = followed.pieces.iter().map(|piece| piece.length).sum();
        let end = |end: crate::shapes::cut_line::End| end.vertex.map_or_else(|| place(&end.direction), |i| places[i]);
        let strips = followed.pieces.iter().map(|piece| {
            let strip = CutStrip { start: end(piece.start), end: end(piece.end), share: piece.length / total };
            self.stretched(strip)
        });
        let gap = |i: &usize| {
            let at = |place: Place| format!("{}, {}", place[0], place[1]);
            format!(
                "from {} to {}: the points are antipodal, no great circle is defined",
                at(places[*i]),
                at(places[i + 1])
            )
        };
        let strips: Vec<CutStrip> = strips.collect();
        let short = |strip: &CutStrip| {
            let length = angle(&direction(strip.start), &direction(strip.end));
            length < self.angle_of(self.shortest_km) * (1.0 - CUT_SLACK)
        };
        Ok(CutLine {
            too_short: strips.iter().any(short),
            strips,
            length_km: self.km(total),
            farthest_km: self.km(followed.pieces.iter().map(|piece| piece.farthest).fold(0.0, f64::max)),
            left_out: followed.antipodal.iter().map(gap).collect(),
        })
    }

    /// The lines of a feature, those that are too short joined to others if that is wanted.
    #[must_use]
    pub fn lines(&self, lines: Vec<Numbered>) -> Vec<Numbered> {
        match self.short_lines {
            ShortLines::Join => joined(lines, self.angle_of(self.shortest_km), self.angle_of(self.tolerance_km)),
            ShortLines::Refuse | ShortLines::Stretch => lines,
        }
    }

    fn limits(&self) -> Limits {
        Limits {
            shortest: self.angle_of(self.shortest_km),
            longest: self.angle_of(self.longest_km) * (1.0 + CUT_SLACK),
            tolerance: self.angle_of(self.tolerance_km),
        }
    }

    fn stretched(&self, strip: CutStrip) -> CutStrip {
        let least = self.angle_of(self.shortest_km);
        let arc = Arc::new(direction(strip.start), direction(strip.end));
        match arc.filter(|arc| self.short_lines != ShortLines::Refuse && arc.length < least) {
            Some(arc) => {
                let arc = arc.stretched(least);
                CutStrip { start: place(&arc.start), end: place(&arc.end), ..strip }
            }
            None => strip,
        }
    }

    /// An area as it is whoever wrote it.
    ///
    /// # Errors
    /// When a place is none.
    pub fn outline(&self, rings: &[Vec<Place>]) -> Result<Outline, String> {
        let rings = in_order(rings);
        let polygon = rings.iter().map(|ring| boundary(ring)).collect::<Result<Polygon, String>>()?;
        Ok(Outline { rings, polygon })
    }

    /// Covers areas as one: strips, each with the share of the area that it shows, and how well they cover it.
    ///
    /// # Errors
    /// When the areas cannot be laid out.
    pub fn area(&self, mut areas: Vec<Outline>) -> Result<(Vec<CutStrip>, Cover), String> {
        let first = |area: &Outline| area.rings.first().cloned().unwrap_or_default();
        areas.sort_by(|a, b| order(&first(a), &first(b)));
        let polygons: Vec<Polygon> = areas.into_iter().map(|area| area.polygon).collect();
        let swath = Swath {
            width: self.angle_of(self.swath_km),
            shortest: self.angle_of(self.shortest_km),
            longest: self.angle_of(self.longest_km),
            overlap: OVERLAP,
            headings: match self.rows {
                Rows::Fewest => Headings::Any,
                Rows::Passes => Headings::At(&|latitude| self.passes.headings(latitude).to_vec()),
                Rows::Heading(deg) => Headings::At(&move |_| vec![deg.to_radians()]),
            },
        };
        let cover = cover(&polygons, &swath).map_err(|error| error.to_string())?;
        // A strip that shows nothing of its own is not worth a look, unless it is the only one.
        let shown = cover.strips.iter().filter(|(_, share)| *share > 0.0 || cover.strips.len() == 1);
        let strips =
            shown.map(|(arc, share)| CutStrip { start: place(&arc.start), end: place(&arc.end), share: *share });
        Ok((strips.collect(), cover))
    }

    /// Size of an area [km²].
    #[must_use]
    pub fn square_km(&self, cover: &Cover) -> f64 {
        cover.area * (self.radius_m / 1e3).powi(2)
    }
}

/// The rings of an area as they are whoever wrote them: without repeated points, each from its westernmost place on and
/// in one sense, in the order of those places.
fn in_order(rings: &[Vec<Place>]) -> Vec<Vec<Place>> {
    let ring = |ring: &Vec<Place>| {
        let turned = |place: &Place| {
            let [longitude, latitude] = wrapped(*place);
            [if longitude > 180.0 { longitude - 360.0 } else { longitude }, latitude]
        };
        let mut ring: Vec<Place> = ring.iter().map(turned).collect();
        ring.dedup();
        while ring.len() > 1 && ring.first() == ring.last() {
            ring.pop();
        }
        let first = (0..ring.len()).min_by(|a, b| order(&ring[*a..=*a], &ring[*b..=*b])).unwrap_or(0);
        ring.rotate_left(first);
        if let [_, second, .., last] = ring[..]
            && order(&[last], &[second]).is_lt()
        {
            ring[1..].reverse();
        }
        ring
    };
    let mut rings: Vec<_> = rings.iter().map(ring).collect();
    rings.sort_by(|a, b| order(a, b));
    rings
}

fn order(a: &[Place], b: &[Place]) -> std::cmp::Ordering {
    let numbers = a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| a.total_cmp(b));
    numbers.fold(std::cmp::Ordering::Equal, std::cmp::Ordering::then).then(a.len().cmp(&b.len()))
}

/// A place whose longitude is brought to -180° to 180° when it is outside what a strip may say.
fn wrapped(place: Place) -> Place {
    let [longitude, latitude] = place;
    if (-180.0..=360.0).contains(&longitude) || longitude.abs() > 3600.0 {
        return place;
    }
    let turned = longitude.rem_euclid(360.0);
    [if turned > 180.0 { turned - 360.0 } else { turned }, latitude]
}

fn is_on_earth(place: &Place) -> bool {
    (-180.0..=360.0).contains(&place[0]) && (-90.0..=90.0).contains(&place[1])
}

/// A line along a whole parallel gets points of it, and neighbours that are antipodal on a meridian one in between:
/// there the way is clear although no great circle tells it.
fn along_parallels_and_meridians(places: Vec<Place>) -> Vec<Place> {
    let [first, .., last] = places[..] else { return places };
    let steps: Vec<f64> = places.windows(2).map(|two| two[1][0] - two[0][0]).collect();
    let level = places.iter().all(|place| place[1] == first[1]) && first[1].abs() < 90.0;
    let one_way = steps.iter().all(|step| *step > 0.0) || steps.iter().all(|step| *step < 0.0);
    if level && one_way && (last[0] - first[0]).abs() == 360.0 {
        let count = (360.0 / PARALLEL_DEG) as u32;
        let at = |k: u32| [first[0] + (last[0] - first[0]) * f64::from(k) / f64::from(count), first[1]];
        return (0..=count).map(at).map(wrapped).collect();
    }
    if !places.iter().all(is_on_earth) {
        return places;
    }
    let mut along = vec![first];
    for two in places.windows(2) {
        let [a, b] = [two[0], two[1]];
        let opposite = angle(&direction(a), &direction(b)) > ANTIPODAL_ARC;
        if opposite && a[0] == b[0] {
            along.push([a[0], f64::midpoint(a[1], b[1])]);
        }
        along.push(b);
    }
    along
}

/// A ring as directions, its long edges cut, its last point, which is its first, left out.
fn boundary(ring: &[Place]) -> Result<Vec<nalgebra::Vector3<f64>>, String> {
    let mut points = Vec::new();
    for (i, a) in ring.iter().enumerate() {
        let [longitude, latitude] = wrapped(*a);
        if !is_on_earth(&[longitude, latitude]) {
            return Err(format!("{longitude}, {latitude} is no longitude and latitude"));
        }
        let b = ring[(i + 1) % ring.len()];
        let east = (b[0] - longitude + 180.0).rem_euclid(360.0) - 180.0;
        let north = b[1] - latitude;
        if east == 0.0 && north == 0.0 {
            continue;
        }
        let cuts = (east.abs().max(north.abs()) / EDGE_DEG).ceil().clamp(1.0, 1000.0);
        let at = |k: u32| [longitude + east * f64::from(k) / cuts, latitude + north * f64::from(k) / cuts];
        points.extend((0..cuts as u32).map(at).map(direction));
    }
    Ok(points)
}
