//! Strips as GeoJSON geometries, cut at the antimeridian (RFC 7946).

use serde_json::{Value, json};

/// Longitude and latitude [deg] of both ends.
pub type Ends = [[f64; 2]; 2];

/// A strip.
#[must_use]
pub fn line(ends: &Ends) -> Value {
    match cut(ends) {
        None => json!({ "type": "LineString", "coordinates": ends }),
        Some(halves) => json!({ "type": "MultiLineString", "coordinates": halves }),
    }
}

/// Several strips.
#[must_use]
pub fn lines(strips: &[Ends]) -> Value {
    match strips {
        [ends] => line(ends),
        _ => {
            let parts: Vec<_> = strips.iter().flat_map(|ends| cut(ends).map_or(vec![*ends], Vec::from)).collect();
            json!({ "type": "MultiLineString", "coordinates": parts })
        }
    }
}

/// West, south, east, north [deg] of the ends; west is greater than east across the antimeridian.
#[must_use]
pub fn bbox(strips: &[Ends]) -> [f64; 4] {
    let places = || strips.iter().flatten();
    let least = |at: usize| places().map(|it| it[at]).fold(f64::INFINITY, f64::min);
    let greatest = |at: usize| places().map(|it| it[at]).fold(f64::NEG_INFINITY, f64::max);
    let (south, north) = (least(1), greatest(1));
    if strips.iter().any(crosses) {
        let east_of = |lon: f64| if lon < 0.0 { lon + 360.0 } else { lon };
        let west = places().map(|it| east_of(it[0])).fold(f64::INFINITY, f64::min);
        let east = places().map(|it| east_of(it[0])).fold(f64::NEG_INFINITY, f64::max);
        let back = |lon: f64| if lon > 180.0 { lon - 360.0 } else { lon };
        return [back(west), south, back(east), north];
    }
    [least(0), south, greatest(0), north]
}

fn crosses([start, end]: &Ends) -> bool {
    (start[0] - end[0]).abs() > 180.0
}

/// Both sides of the antimeridian; the latitude there is that of a straight line on the map.
fn cut(ends: &Ends) -> Option<[Ends; 2]> {
    if !crosses(ends) {
        return None;
    }
    let [start, end] = *ends;
    let edge = if start[0] > 0.0 { 180.0 } else { -180.0 };
    let beyond = end[0] + 2.0 * edge;
    let share = (edge - start[0]) / (beyond - start[0]);
    let latitude = start[1] + share * (end[1] - start[1]);
    Some([[start, [edge, latitude]], [[-edge, latitude], end]])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_strip_across_the_antimeridian_is_cut_there() {
        let ends = [[179.0, 10.0], [-178.0, 13.0]];
        let expected = json!({ "type": "MultiLineString",
            "coordinates": [[[179.0, 10.0], [180.0, 11.0]], [[-180.0, 11.0], [-178.0, 13.0]]] });
        assert_eq!(line(&ends), expected);
        assert_eq!(bbox(&[ends]), [179.0, 10.0, -178.0, 13.0]);
        let back = [[-179.0, 0.0], [179.0, 2.0]];
        assert_eq!(line(&back)["coordinates"][0][1], json!([-180.0, 1.0]));
        assert_eq!(lines(&[ends, back])["coordinates"].as_array().map(Vec::len), Some(4));
    }

    #[test]
    fn others_are_lines() {
        let ends = [[1.0, 2.0], [3.0, -4.0]];
        assert_eq!(line(&ends), json!({ "type": "LineString", "coordinates": ends }));
        assert_eq!(bbox(&[ends, [[5.0, 0.0], [6.0, 9.0]]]), [1.0, -4.0, 6.0, 9.0]);
    }
}
