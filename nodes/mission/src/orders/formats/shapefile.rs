//! Shapefiles: lines and polygons of the `.shp`, attributes of the `.dbf` beside it.

use std::io::Cursor;
use std::path::Path;

use serde_json::{Map, Value};
use shapefile::dbase::FieldValue;
use shapefile::record::traits::HasXY;
use shapefile::{Shape, ShapeReader};

use super::super::feature::{Feature, Part};
use super::{Features, FormatError};

/// Whether a file begins like the geometry of a shapefile.
pub(super) fn is_one(bytes: &[u8]) -> bool {
    bytes.starts_with(&9994_i32.to_be_bytes())
}

/// Reads the shapes, and the attributes if they are there.
pub(super) fn read(bytes: &[u8], path: &Path) -> Result<Features, FormatError> {
    let malformed = |reason: String| FormatError::Malformed { format: "a shapefile", reason };
    let projection = std::fs::read_to_string(path.with_extension("prj")).unwrap_or_default();
    if projection.trim_start().starts_with("PROJCS") {
        let name = projection.split('"').nth(1).unwrap_or("a projection");
        return Err(FormatError::Crs { crs: name.to_owned() });
    }
    let mut shapes = ShapeReader::new(Cursor::new(bytes)).map_err(|error| malformed(error.to_string()))?;
    let attributes = path.with_extension("dbf");
    let rows = if attributes.exists() {
        let read = shapefile::dbase::read(&attributes);
        read.map_err(|error| malformed(format!("{}: {error}", attributes.display())))?
    } else {
        Vec::new()
    };
    let mut rows = rows.into_iter();
    let feature = |shape: Result<Shape, shapefile::Error>| {
        let row = rows.next();
        let fields = row.into_iter().flatten().filter_map(|(name, field)| Some((name, value(field)?)));
        let properties: Map<String, Value> = fields.collect();
        Ok(Feature { properties, parts: parts(shape.map_err(|error| error.to_string())?) })
    };
    Ok(shapes.iter_shapes().map(feature).collect())
}

fn value(field: FieldValue) -> Option<Value> {
    match field {
        FieldValue::Character(text) => text.map(|text| text.trim_end().into()),
        FieldValue::Numeric(number) => number.map(Value::from),
        FieldValue::Float(number) => number.map(Value::from),
        FieldValue::Logical(flag) => flag.map(Value::from),
        FieldValue::Integer(number) => Some(number.into()),
        FieldValue::Double(number) | FieldValue::Currency(number) => Some(number.into()),
        FieldValue::Memo(text) => Some(text.into()),
        _ => None,
    }
}

fn places<P: HasXY>(points: &[P]) -> Vec<[f64; 2]> {
    points.iter().map(|point| [point.x(), point.y()]).collect()
}

fn parts(shape: Shape) -> Vec<Part> {
    macro_rules! lines {
        ($lines:expr) => {
            $lines.parts().iter().map(|line| Part::Line(places(line))).collect()
        };
    }
    // Rings are told apart by which lies in which: one area of all of them.
    macro_rules! area {
        ($polygon:expr) => {
            vec![Part::Area($polygon.rings().iter().map(|ring| places(ring.points())).collect())]
        };
    }
    match shape {
        Shape::NullShape => Vec::new(),
        Shape::Polyline(lines) => lines!(lines),
        Shape::PolylineM(lines) => lines!(lines),
        Shape::PolylineZ(lines) => lines!(lines),
        Shape::Polygon(polygon) => area!(polygon),
        Shape::PolygonM(polygon) => area!(polygon),
        Shape::PolygonZ(polygon) => area!(polygon),
        other => vec![Part::Other(format!("{}", other.shapetype()))],
    }
}
