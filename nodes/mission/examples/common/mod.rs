//! What long figures of orders have in common: their plan, their seeds, and shapes at random.
#![allow(dead_code, reason = "not every figure needs all of it")]

use rand::rngs::StdRng;
use rand::{RngExt as _, SeedableRng as _};
use serde_json::{Value, json};

/// What a figure was asked for: seeds from the first one on.
pub enum Asked {
    /// To tell how many seeds there are.
    Plan,
    /// To do some.
    Seeds(u64, u64),
}

/// Reads the command line.
pub fn asked() -> anyhow::Result<Asked> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    match &words.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["--plan"] => Ok(Asked::Plan),
        [first, count] => Ok(Asked::Seeds(first.parse()?, count.parse()?)),
        _ => anyhow::bail!("expected --plan, or FIRST and COUNT"),
    }
}

/// Two GeoJSON texts of features at random: lines, and areas.
pub fn features(seed: u64) -> [Value; 2] {
    let mut rng = StdRng::seed_from_u64(seed);
    let lines: Vec<_> = (0..rng.random_range(1..6)).map(|i| feature(&mut rng, i, false)).collect();
    let areas: Vec<_> = (0..rng.random_range(1..3)).map(|i| feature(&mut rng, i, true)).collect();
    [lines, areas].map(|features| json!({ "type": "FeatureCollection", "features": features }))
}

fn feature(rng: &mut StdRng, number: u32, area: bool) -> Value {
    let several = rng.random_bool(0.4);
    let place = [rng.random_range(-170.0..165.0), rng.random_range(-60.0..60.0)];
    let one = if area { polygon } else { line };
    let count = if several { 3 } else { 1 };
    let coordinates: Vec<Value> = (0..count).map(|k| one(rng, [place[0] + 2.0 * f64::from(k), place[1]])).collect();
    let (kind, coordinates) = match (area, several) {
        (false, false) => ("LineString", coordinates[0].clone()),
        (false, true) => ("MultiLineString", coordinates.into()),
        (true, false) => ("Polygon", coordinates[0].clone()),
        (true, true) => ("MultiPolygon", coordinates.into()),
    };
    json!({
        "type": "Feature",
        "properties": {
            "name": format!("Übung №{number}"),
            "client_ref": format!("ref-{number}"),
            "priority": f64::from(rng.random_range(1..=100)) / 100.0,
            "acquisition_speed_m_s": f64::from(rng.random_range(2000..=4000)),
            "bidirectional": rng.random_bool(0.5),
            "hold_for_approval": rng.random_bool(0.5),
            "max_attempts": rng.random_range(1..20),
        },
        "geometry": { "type": kind, "coordinates": coordinates },
    })
}

/// A number with as many digits as every format keeps.
fn kept(degrees: f64) -> f64 {
    (degrees * 1e6).round() / 1e6
}

fn line(rng: &mut StdRng, mut at: [f64; 2]) -> Value {
    let mut heading = rng.random_range(0.0..std::f64::consts::TAU);
    let points = (0..rng.random_range(2..40)).map(|_| {
        let step = rng.random_range(0.05..0.6);
        heading += rng.random_range(-0.7..0.7_f64);
        at = [(at[0] + step * heading.sin()).clamp(-179.9, 179.9), (at[1] + step * heading.cos()).clamp(-80.0, 80.0)];
        json!(at.map(kept))
    });
    points.collect::<Vec<_>>().into()
}

/// A star, maybe with a hole; areas of one feature lie apart.
fn polygon(rng: &mut StdRng, middle: [f64; 2]) -> Value {
    let radii: Vec<f64> = (0..rng.random_range(3..15)).map(|_| rng.random_range(0.2..0.8)).collect();
    let ring = |scale: f64| {
        let point = |(i, radius): (usize, &f64)| {
            let (sin, cos) = (std::f64::consts::TAU * i as f64 / radii.len() as f64).sin_cos();
            json!([middle[0] - scale * radius * sin, middle[1] + scale * radius * cos].map(kept))
        };
        let mut ring: Vec<Value> = radii.iter().enumerate().map(point).collect();
        ring.push(ring[0].clone());
        ring
    };
    let mut rings = vec![ring(1.0)];
    if rng.random_bool(0.4) {
        // Formats tell holes by their sense; GDAL makes areas of their own of those that leave their area.
        rings.push(ring(0.4).into_iter().rev().collect());
    }
    json!(rings)
}
