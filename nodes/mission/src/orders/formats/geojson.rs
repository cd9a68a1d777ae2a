//! GeoJSON (RFC 7946), sequences of it (RFC 8142), and lines of it.

use geojson::{Feature as GeoFeature, Geometry, GeometryValue, Position};
use serde_json::Value;

use super::super::feature::{Feature, Part};
use super::crs;
use super::error::{Features, FormatError};
use crate::shapes::sphere::Place;

/// Reads a text that begins like JSON.
pub(super) fn read(text: &str) -> Result<Features, FormatError> {
    let wrong = |error: serde_json::Error| FormatError::GeoJson(Box::new(error.into()));
    // A sequence is one text after the other; most files are one.
    let mut texts = Vec::new();
    for part in text.split('\u{1e}') {
        for value in serde_json::Deserializer::from_str(part).into_iter::<Value>() {
            texts.push(value.map_err(wrong)?);
        }
    }
    if texts.is_empty() {
        // Says where the end came.
        serde_json::from_str::<Value>(text).map_err(wrong)?;
    }
    let mut features = Vec::new();
    for value in texts {
        check_crs(&value)?;
        collect(value, &mut features)?;
    }
    Ok(features)
}

fn collect(value: Value, features: &mut Features) -> Result<(), FormatError> {
    match value {
        Value::Object(mut object) if object.get("type").is_some_and(|it| it == "FeatureCollection") => {
            let Some(Value::Array(own)) = object.remove("features") else {
                let missing = <serde_json::Error as serde::de::Error>::missing_field("features");
                return Err(FormatError::GeoJson(Box::new(missing.into())));
            };
            features.extend(own.into_iter().map(|value| feature(value).map_err(|error| error.to_string())));
        }
        // A file that is one thing is refused as one thing.
        value => features.push(Ok(feature(value).map_err(|error| FormatError::GeoJson(Box::new(error)))?)),
    }
    Ok(())
}

fn feature(value: Value) -> Result<Feature, geojson::Error> {
    let is_feature = value.get("type").is_some_and(|it| it == "Feature");
    let read: GeoFeature =
        if is_feature { serde_json::from_value(value)? } else { serde_json::from_value::<Geometry>(value)?.into() };
    let mut feature = Feature { properties: read.properties.unwrap_or_default(), parts: Vec::new() };
    let id = read.id.map(|id| match id {
        geojson::feature::Id::String(id) => id,
        geojson::feature::Id::Number(id) => id.to_string(),
    });
    if let Some(id) = id {
        feature.properties.entry("client_ref").or_insert(id.into());
    }
    if let Some(geometry) = read.geometry {
        add(geometry.value, &mut feature.parts);
    }
    Ok(feature)
}

fn add(geometry: GeometryValue, parts: &mut Vec<Part>) {
    match geometry {
        GeometryValue::LineString { coordinates } => parts.push(Part::Line(places(&coordinates))),
        GeometryValue::MultiLineString { coordinates } => {
            parts.extend(coordinates.iter().map(|line| Part::Line(places(line))));
        }
        GeometryValue::Polygon { coordinates } => parts.push(area(&coordinates)),
        GeometryValue::MultiPolygon { coordinates } => parts.extend(coordinates.iter().map(|rings| area(rings))),
        GeometryValue::GeometryCollection { geometries } => {
            geometries.into_iter().for_each(|geometry| add(geometry.value, parts));
        }
        other => parts.push(Part::Other(other.type_name().to_owned())),
    }
}

fn area(rings: &[Vec<Position>]) -> Part {
    Part::Area(rings.iter().map(|ring| places(ring)).collect())
}

/// A position without two numbers has none that are finite, and is refused as such.
fn places(line: &[Position]) -> Vec<Place> {
    let at = |position: &Position, i: usize| position.as_slice().get(i).copied().unwrap_or(f64::NAN);
    line.iter().map(|position| [at(position, 0), at(position, 1)]).collect()
}

/// Refuses a reference system that is not WGS 84.
fn check_crs(value: &Value) -> Result<(), FormatError> {
    let Some(crs) = value.get("crs").filter(|crs| !crs.is_null()) else { return Ok(()) };
    match crs.pointer("/properties/name").and_then(Value::as_str) {
        Some(name) => crs::by_code(name),
        None => crs::by_code(&crs.to_string()),
    }
}
