//! Well-known text: one geometry a line, or several lines of one.

use std::str::FromStr as _;

use wkt::Wkt;
use wkt::types::{LineString, Polygon};

use super::super::feature::{Feature, Part};
use super::error::{Features, FormatError};

/// How geometries begin.
const WORDS: [&str; 5] = ["LINESTRING", "MULTILINESTRING", "POLYGON", "MULTIPOLYGON", "GEOMETRYCOLLECTION"];
const OTHER_WORDS: [&str; 3] = ["POINT", "MULTIPOINT", "SRID="];

/// Whether a text is a geometry.
pub(super) fn is_one(text: &str) -> bool {
    let begins = |word: &str| text.get(..word.len()).is_some_and(|begin| begin.eq_ignore_ascii_case(word));
    WORDS.iter().chain(&OTHER_WORDS).any(|word| begins(word))
}

/// Reads a text of geometries.
pub(super) fn read(text: &str) -> Result<Features, FormatError> {
    let mut features = Vec::new();
    let mut rest = String::new();
    for line in text.lines() {
        if is_one(line.trim()) && !rest.trim().is_empty() {
            features.push(feature(&std::mem::take(&mut rest)));
        }
        rest += line;
        rest.push(' ');
    }
    features.push(feature(&rest));
    if let [Err(reason)] = &features[..] {
        return Err(FormatError::Malformed { format: "WKT", reason: reason.clone() });
    }
    Ok(features)
}

fn feature(text: &str) -> Result<Feature, String> {
    Ok(Feature { parts: parts(text)?, ..Feature::default() })
}

/// The parts of a geometry, which may say EWKT's `SRID=4326;` first.
pub(super) fn parts(text: &str) -> Result<Vec<Part>, String> {
    let mut text = text.trim();
    if let Some((srid, rest)) = text.split_once(';').filter(|(begin, _)| begin.to_uppercase().starts_with("SRID=")) {
        if !["4326", "4979"].contains(&srid[5..].trim()) {
            return Err(format!("it is in {srid}, not in EPSG:4326"));
        }
        text = rest;
    }
    let mut parts = Vec::new();
    add(Wkt::<f64>::from_str(text).map_err(str::to_owned)?, &mut parts);
    Ok(parts)
}

fn add(geometry: Wkt<f64>, parts: &mut Vec<Part>) {
    let line = |line: &LineString<f64>| line.coords().iter().map(|at| [at.x, at.y]).collect();
    let area = |polygon: &Polygon<f64>| Part::Area(polygon.rings().iter().map(line).collect());
    match geometry {
        Wkt::LineString(one) => parts.push(Part::Line(line(&one))),
        Wkt::MultiLineString(several) => parts.extend(several.line_strings().iter().map(line).map(Part::Line)),
        Wkt::Polygon(one) => parts.push(area(&one)),
        Wkt::MultiPolygon(several) => parts.extend(several.polygons().iter().map(area)),
        Wkt::GeometryCollection(several) => several.geometries().iter().for_each(|it| add(it.clone(), parts)),
        Wkt::Point(_) | Wkt::MultiPoint(_) => parts.push(Part::Other("Point".to_owned())),
    }
}
