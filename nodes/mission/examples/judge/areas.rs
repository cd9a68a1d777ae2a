//! What share of areas their strips show, by points thrown at them.

use rand::rngs::StdRng;
use rand::{RngExt as _, SeedableRng as _};
use serde_json::{Value, json};
use swath_mission::orders::feature::Part;
use swath_mission::orders::feature_strips::Cutting;
use swath_mission::orders::found::{Import, Shown};
use swath_mission::shapes::cover_area::shows;
use swath_mission::shapes::sphere::{Place, angle, direction};

/// Points that hit an area, at most.
const HITS: usize = 3000;
/// Points that are thrown at it.
const THROWS: usize = 300_000;
/// An area is looked at this little beyond what strips show: points of its edge are no one's [km].
const EDGE_KM: f64 = 0.01;

/// What became of the areas of a set.
#[derive(Default)]
pub struct Areas {
    areas: usize,
    square_km: f64,
    shown_km2: f64,
    twice_km2: f64,
    strips: usize,
    least_shown: Option<f64>,
    most_twice: f64,
    /// Areas of which less than 99 % is shown, or more than 15 % twice.
    astray: Vec<Value>,
    refused: Vec<String>,
}

impl Areas {
    /// Adds the areas of a feature and their strips.
    pub fn add(&mut self, parts: &[Part], import: &Import, cutting: &Cutting) {
        self.refused.extend(import.refused.iter().map(|fault| fault.reason.clone()));
        let Some(cut) = import.cut.first() else { return };
        let Shown::Area { square_km, covered, twice } = cut.shown else { return };
        let rings: Vec<&Vec<Vec<Place>>> =
            parts.iter().filter_map(|part| if let Part::Area(rings) = part { Some(rings) } else { None }).collect();
        let arcs = super::strips(import);
        let width = (cutting.swath_km + 2.0 * EDGE_KM) * 1e3 / cutting.radius_m;
        let (mut hits, mut once, mut more) = (0_usize, 0_usize, 0_usize);
        for place in thrown(&rings) {
            let point = direction(place);
            // Ten strips are seldom longer than the way to the point.
            let near = arcs.iter().filter(|arc| angle(&arc.start, &point) < arc.length + width);
            let seen = near.filter(|arc| shows(arc, &point, width)).count();
            hits += 1;
            once += usize::from(seen > 0);
            more += usize::from(seen > 1);
        }
        let share = |count: usize| if hits > 0 { count as f64 / hits as f64 } else { 1.0 };
        // The coarser count is known to a percent or so: the finer one is the strips' own.
        let (shown, twice_seen) = (share(once).min(covered), share(more).max(twice));
        self.areas += 1;
        self.square_km += square_km;
        self.shown_km2 += shown * square_km;
        self.twice_km2 += twice_seen * square_km;
        self.strips += arcs.len();
        self.least_shown = Some(self.least_shown.map_or(shown, |least| least.min(shown)));
        self.most_twice = self.most_twice.max(twice_seen);
        if shown < 0.99 || twice_seen > 0.15 {
            self.astray.push(json!({
                "from": rings[0].first().and_then(|ring| ring.first()), "km2": square_km, "strips": arcs.len(),
                "shown": covered, "twice": twice, "points": hits, "points_shown": share(once), "points_twice": share(more),
            }));
        }
    }

    /// What is told of them.
    pub fn told(self) -> Value {
        let share = |part: f64| part / self.square_km.max(1e-9);
        json!({
            "areas": self.areas,
            "km2": self.square_km,
            "shown": share(self.shown_km2),
            "twice": share(self.twice_km2),
            "least_shown": self.least_shown,
            "most_twice": self.most_twice,
            "strips": self.strips,
            "astray": self.astray,
            "refused": self.refused,
        })
    }
}

/// Places within polygons, evenly on the sphere; edges are straight in longitude and latitude (RFC 7946).
fn thrown(polygons: &[&Vec<Vec<Place>>]) -> Vec<Place> {
    let places = || polygons.iter().flat_map(|rings| rings.iter().flatten());
    let range = |axis: usize| {
        places().map(|place| place[axis]).fold((f64::MAX, f64::MIN), |(low, high), it| (low.min(it), high.max(it)))
    };
    let ((west, east), (south, north)) = (range(0), range(1));
    let mut rng = StdRng::seed_from_u64(1);
    let mut hits = Vec::new();
    for _ in 0..THROWS {
        let sin = south.to_radians().sin()
            + rng.random_range(0.0..1.0) * (north.to_radians().sin() - south.to_radians().sin());
        let place = [west + rng.random_range(0.0..1.0) * (east - west), sin.asin().to_degrees()];
        if polygons.iter().any(|rings| rings.iter().filter(|ring| inside(ring, place)).count() % 2 == 1) {
            hits.push(place);
        }
        if hits.len() == HITS {
            break;
        }
    }
    hits
}

fn inside(ring: &[Place], [x, y]: Place) -> bool {
    let edges = ring.iter().zip(ring.iter().cycle().skip(1));
    let crossed =
        edges.filter(|(a, b)| (a[1] > y) != (b[1] > y) && x < a[0] + (b[0] - a[0]) * (y - a[1]) / (b[1] - a[1]));
    crossed.count() % 2 == 1
}
