//! KML (OGC 12-007).

use kml::types::{Coord, Element, Geometry, Placemark};
use kml::{Kml, KmlReader};
use quick_xml::Reader;
use quick_xml::events::Event;
use serde_json::Value;

use super::super::feature::{Feature, Part};
use super::error::{Features, FormatError};
use crate::shapes::sphere::Place;

/// Reads a text that begins like XML and has a `kml` element.
pub(super) fn read(text: &str) -> Result<Features, FormatError> {
    let malformed = |error: kml::Error| FormatError::Malformed { format: "KML", reason: error.to_string() };
    check(text)?;
    let mut features = Vec::new();
    collect(KmlReader::<_, f64>::from_string(text).read().map_err(malformed)?, &mut features);
    if features.is_empty() {
        return Err(FormatError::Malformed { format: "KML", reason: "it has no placemark".to_owned() });
    }
    Ok(features)
}

/// Refuses what is no whole XML: the reader of KML would wait for its end for ever.
fn check(text: &str) -> Result<(), FormatError> {
    let malformed = |reason: String| FormatError::Malformed { format: "KML", reason };
    let mut reader = Reader::from_str(text);
    let mut depth = 0_usize;
    loop {
        match reader.read_event().map_err(|error| malformed(error.to_string()))? {
            Event::Start(_) => depth += 1,
            Event::End(_) => depth = depth.saturating_sub(1),
            Event::Eof if depth > 0 => return Err(malformed(format!("it ends within {depth} open elements"))),
            Event::Eof => return Ok(()),
            _ => {}
        }
    }
}

fn collect(element: Kml, features: &mut Features) {
    match element {
        Kml::KmlDocument(document) => document.elements.into_iter().for_each(|it| collect(it, features)),
        Kml::Document { elements, .. } => elements.into_iter().for_each(|it| collect(it, features)),
        Kml::Folder(folder) => folder.elements.into_iter().for_each(|it| collect(it, features)),
        Kml::Placemark(placemark) => features.push(Ok(feature(placemark))),
        Kml::LineString(line) => bare(Geometry::LineString(line), features),
        Kml::LinearRing(ring) => bare(Geometry::LinearRing(ring), features),
        Kml::Polygon(polygon) => bare(Geometry::Polygon(polygon), features),
        Kml::MultiGeometry(several) => bare(Geometry::MultiGeometry(several), features),
        Kml::Point(point) => bare(Geometry::Point(point), features),
        // Styles, views and what else is not on the ground.
        _ => {}
    }
}

fn bare(geometry: Geometry, features: &mut Features) {
    features.push(Ok(feature(Placemark { geometry: Some(geometry), ..Placemark::default() })));
}

fn feature(placemark: Placemark) -> Feature {
    let mut feature = Feature::default();
    for element in &placemark.children {
        properties(element, &mut feature);
    }
    if let Some(id) = placemark.attrs.get("id") {
        feature.properties.entry("client_ref").or_insert(id.as_str().into());
    }
    if let Some(name) = placemark.name {
        feature.properties.insert("name".to_owned(), name.into());
    }
    if let Some(geometry) = placemark.geometry {
        add(geometry, &mut feature.parts);
    }
    feature
}

/// `ExtendedData`: pairs of `Data` and of `SchemaData`.
fn properties(element: &Element, feature: &mut Feature) {
    let value = |content: &Option<String>| content.clone().map_or(Value::Null, Value::String);
    if let Some(name) = element.attrs.get("name").filter(|_| ["Data", "SimpleData"].contains(&element.name.as_str())) {
        let inner = element.children.iter().find(|child| child.name == "value");
        let content = inner.map_or(&element.content, |inner| &inner.content);
        feature.properties.insert(name.clone(), value(content));
    }
    element.children.iter().for_each(|child| properties(child, feature));
}

fn add(geometry: Geometry, parts: &mut Vec<Part>) {
    let places = |coords: &[Coord]| coords.iter().map(|at| [at.x, at.y]).collect::<Vec<Place>>();
    match geometry {
        Geometry::LineString(line) => parts.push(Part::Line(places(&line.coords))),
        Geometry::LinearRing(ring) => parts.push(Part::Line(places(&ring.coords))),
        Geometry::Polygon(polygon) => {
            let rings = std::iter::once(&polygon.outer).chain(&polygon.inner);
            parts.push(Part::Area(rings.map(|ring| places(&ring.coords)).collect()));
        }
        Geometry::MultiGeometry(several) => several.geometries.into_iter().for_each(|it| add(it, parts)),
        Geometry::Point(_) => parts.push(Part::Other("Point".to_owned())),
        Geometry::Element(element) => parts.push(Part::Other(element.name)),
        _ => parts.push(Part::Other("geometry of another kind".to_owned())),
    }
}
