//! FlatGeobuf (flatgeobuf.org, version 3): FlatBuffers one after the other, checked before they are looked into.
//!
//! The frames are walked here instead of by the crate's reader, which believes their sizes and those of properties.

use ::flatgeobuf::packed_r_tree::PackedRTree;
use ::flatgeobuf::{
    ColumnType, Geometry, GeometryType, Header, size_prefixed_root_as_feature, size_prefixed_root_as_header,
};
use serde_json::Value;

use super::super::feature::{Feature, Part};
use super::crs;
use super::error::{Features, FormatError};
use crate::shapes::sphere::Place;

/// Beginnings of files: the fourth letter is the version.
pub(super) const MAGIC: &[u8] = b"fgb";
const MAGIC_LENGTH: usize = 8;
/// Most features that the header may tell of: the index of more than that is larger than any file that is read.
const FEATURES_MAX: u64 = 1 << 32;

/// Reads a file.
pub(super) fn read(bytes: &[u8]) -> Result<Features, FormatError> {
    let malformed = |reason: String| FormatError::Malformed { format: "FlatGeobuf", reason };
    if bytes.get(4..7) != Some(MAGIC) || bytes.get(3).is_none_or(|version| *version > ::flatgeobuf::VERSION) {
        return Err(malformed(format!("it is not of version {} or before", ::flatgeobuf::VERSION)));
    }
    let ends = || malformed("it ends in the middle".to_owned());
    let mut rest = bytes.get(MAGIC_LENGTH..).ok_or_else(ends)?;
    let header = frame(&mut rest).ok_or_else(ends)?;
    let header = size_prefixed_root_as_header(header).map_err(|error| malformed(first_line(&error)))?;
    check_crs(&header)?;
    let index = index_size(&header).ok_or_else(|| malformed("its index cannot be".to_owned()))?;
    let mut rest = rest.get(index..).ok_or_else(ends)?;
    let mut features = Vec::new();
    while !rest.is_empty() {
        let Some(feature) = frame(&mut rest) else {
            features.push(Err("the file ends in the middle of it".to_owned()));
            break;
        };
        features.push(read_feature(feature, &header));
    }
    Ok(features)
}

/// Takes a buffer with its size before it off the front.
fn frame<'a>(rest: &mut &'a [u8]) -> Option<&'a [u8]> {
    let (size, _) = rest.split_first_chunk()?;
    let size = usize::try_from(u32::from_le_bytes(*size)).ok()?;
    let (frame, after) = rest.split_at_checked(size.checked_add(size_of::<u32>())?)?;
    *rest = after;
    Some(frame)
}

fn index_size(header: &Header<'_>) -> Option<usize> {
    let (count, node) = (header.features_count(), header.index_node_size());
    if count == 0 || node == 0 {
        return Some(0);
    }
    let count = usize::try_from(count).ok().filter(|_| count <= FEATURES_MAX)?;
    (node >= 2).then(|| PackedRTree::index_size(count, node))
}

fn check_crs(header: &Header<'_>) -> Result<(), FormatError> {
    let Some(crs) = header.crs() else { return Ok(()) };
    match (crs.code(), crs.code_string(), crs.wkt()) {
        (0, None, None) => Ok(()),
        (0, None, Some(text)) => crs::by_text(text),
        (0, Some(code), _) => crs::by_code(&format!("{}:{code}", crs.org().unwrap_or("EPSG"))),
        (code, ..) => crs::by_code(&format!("{}:{code}", crs.org().unwrap_or("EPSG"))),
    }
}

fn first_line(error: &impl ToString) -> String {
    error.to_string().lines().next().unwrap_or_default().to_owned()
}

fn read_feature(bytes: &[u8], header: &Header<'_>) -> Result<Feature, String> {
    let read = size_prefixed_root_as_feature(bytes).map_err(|error| first_line(&error))?;
    let mut feature = Feature::default();
    if let Some(geometry) = read.geometry() {
        let of_all = header.geometry_type();
        let kind = if of_all == GeometryType::Unknown { geometry.type_() } else { of_all };
        add(&geometry, kind, &mut feature.parts)?;
    }
    let columns = read.columns().or_else(|| header.columns());
    let mut rest = read.properties().map_or(&[][..], |properties| properties.bytes());
    while let Some(column) = take(&mut rest).map(u16::from_le_bytes) {
        let column = columns.filter(|columns| usize::from(column) < columns.len()).map(|it| it.get(column.into()));
        let column = column.ok_or("a property of it has no column")?;
        let value = value(&mut rest, column.type_()).ok_or("its properties end in the middle")?;
        feature.properties.insert(column.name().to_owned(), value);
    }
    Ok(feature)
}

fn take<const N: usize>(rest: &mut &[u8]) -> Option<[u8; N]> {
    let (first, after) = rest.split_first_chunk::<N>()?;
    *rest = after;
    Some(*first)
}

/// Takes a value off the front.
fn value(rest: &mut &[u8], kind: ColumnType) -> Option<Value> {
    Some(match kind {
        ColumnType::Byte => i8::from_le_bytes(take(rest)?).into(),
        ColumnType::UByte => u8::from_le_bytes(take(rest)?).into(),
        ColumnType::Bool => (u8::from_le_bytes(take(rest)?) != 0).into(),
        ColumnType::Short => i16::from_le_bytes(take(rest)?).into(),
        ColumnType::UShort => u16::from_le_bytes(take(rest)?).into(),
        ColumnType::Int => i32::from_le_bytes(take(rest)?).into(),
        ColumnType::UInt => u32::from_le_bytes(take(rest)?).into(),
        ColumnType::Long => i64::from_le_bytes(take(rest)?).into(),
        ColumnType::ULong => u64::from_le_bytes(take(rest)?).into(),
        ColumnType::Float => f32::from_le_bytes(take(rest)?).into(),
        ColumnType::Double => f64::from_le_bytes(take(rest)?).into(),
        ColumnType::String | ColumnType::Json | ColumnType::DateTime | ColumnType::Binary => {
            let length = usize::try_from(u32::from_le_bytes(take(rest)?)).ok()?;
            let (text, after) = rest.split_at_checked(length)?;
            *rest = after;
            if kind == ColumnType::Binary { Value::Null } else { String::from_utf8_lossy(text).into() }
        }
        _ => return None,
    })
}

fn add(geometry: &Geometry<'_>, kind: GeometryType, parts: &mut Vec<Part>) -> Result<(), String> {
    let inner = || geometry.parts().into_iter().flatten();
    match kind {
        GeometryType::LineString => parts.push(Part::Line(places(geometry))),
        GeometryType::MultiLineString => parts.extend(runs(geometry)?.into_iter().map(Part::Line)),
        GeometryType::Polygon => parts.push(Part::Area(runs(geometry)?)),
        GeometryType::MultiPolygon => {
            for polygon in inner() {
                parts.push(Part::Area(runs(&polygon)?));
            }
        }
        GeometryType::GeometryCollection => {
            for one in inner() {
                add(&one, one.type_(), parts)?;
            }
        }
        other => parts.push(Part::Other(other.variant_name().unwrap_or("geometry of another kind").to_owned())),
    }
    Ok(())
}

fn places(geometry: &Geometry<'_>) -> Vec<Place> {
    let numbers: Vec<f64> = geometry.xy().into_iter().flatten().collect();
    numbers.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect()
}

/// The places of a geometry, cut where its runs end: without such ends it is one.
fn runs(geometry: &Geometry<'_>) -> Result<Vec<Vec<Place>>, String> {
    let places = places(geometry);
    let ends: Vec<usize> = match geometry.ends() {
        Some(ends) if !ends.is_empty() => ends.iter().map(|end| end as usize).collect(),
        _ => vec![places.len()],
    };
    let starts = std::iter::once(0).chain(ends.iter().copied());
    let run = |(start, end): (usize, &usize)| places.get(start..*end).map(<[Place]>::to_vec);
    starts.zip(&ends).map(|ends| run(ends).ok_or_else(|| "its lines end beyond its points".to_owned())).collect()
}
