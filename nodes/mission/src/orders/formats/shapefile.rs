//! Shapefiles (Esri, July 1998): the shapes of a `.shp`, with the rows of the `.dbf` beside it.

use std::io::{Cursor, Read, Seek};

use ::shapefile::dbase::encoding::EncodingRs;
use ::shapefile::dbase::{
    ErrorKind, FieldError, FieldIterator, FieldValue, NamedValue, ReadableRecord, Reader, ReaderBuilder, encoding_rs,
};
use ::shapefile::record::traits::HasXY;
use ::shapefile::{PolygonRing, ReadableShape as _, Shape};
use serde_json::{Map, Value};

use super::super::feature::{Feature, PROPERTIES, Part};
use super::crs;
use super::error::{Features, FormatError};
use super::source::{Beside, Source};
use crate::shapes::sphere::Place;

/// Beginning of every `.shp`.
pub(super) const MAGIC: &[u8] = b"\x00\x00\x27\x0a";
const HEADER_LENGTH: usize = 100;
/// Letters of a column's name: longer names are cut.
const NAME_LENGTH: usize = 10;
/// Whole numbers up to this one are told as such.
const WHOLE_MAX: f64 = 9.0e15;

/// Reads a `.shp` and what lies beside it.
pub(super) fn read(source: &Source) -> Result<Features, FormatError> {
    let Beside { table, reference_system, .. } = &source.beside;
    if let Some(text) = reference_system {
        crs::by_text(&String::from_utf8_lossy(text))?;
    }
    let mut rest = source.bytes.get(HEADER_LENGTH..).unwrap_or_default();
    let mut table = table.as_deref().map(|bytes| Table::new(bytes, &source.beside)).transpose()?;
    let mut rows = table.as_mut().map(|table| (table.deleted(), table.reader.iter_records_as::<Row>()));
    let mut features = Vec::new();
    while !rest.is_empty() {
        let mut row = None;
        if let Some((deleted, rows)) = &mut rows {
            if deleted.next() == Some(true) {
                record(&mut rest);
                continue;
            }
            row = rows.next();
        }
        let Some(shape) = record(&mut rest) else {
            features.push(Err("the file ends in the middle of it".to_owned()));
            break;
        };
        features.push(feature(shape, row.transpose().map_err(|error| error.to_string())));
    }
    Ok(features)
}

/// Takes a record off the front, without its number and length.
fn record<'a>(rest: &mut &'a [u8]) -> Option<&'a [u8]> {
    let (_, after) = rest.split_at_checked(size_of::<i32>())?;
    let (words, after) = after.split_first_chunk()?;
    let length = usize::try_from(i32::from_be_bytes(*words)).ok()?.checked_mul(2)?;
    let taken = after.split_at_checked(length);
    *rest = taken.map_or(&[], |(_, after)| after);
    taken.map(|(record, _)| record)
}

/// The rows of a `.dbf`.
struct Table<'a> {
    bytes: &'a [u8],
    reader: Reader<Cursor<&'a [u8]>>,
}

impl<'a> Table<'a> {
    fn new(bytes: &'a [u8], beside: &Beside) -> Result<Self, FormatError> {
        let builder = match beside.encoding.as_deref().and_then(encoding) {
            Some(encoding) => ReaderBuilder::new().with_encoding(EncodingRs::from(encoding)),
            None => ReaderBuilder::new(),
        };
        let malformed = |reason: String| FormatError::Malformed { format: "the table of a Shapefile", reason };
        let reader = builder.build(Cursor::new(bytes)).map_err(|error| malformed(error.to_string()))?;
        Ok(Self { bytes, reader })
    }

    /// Of each row, whether it is deleted: its shape is, too.
    fn deleted(&self) -> impl Iterator<Item = bool> + use<'a> {
        let number = |at: usize| match self.bytes.get(at..at + 2) {
            Some(&[low, high]) => usize::from(u16::from_le_bytes([low, high])),
            _ => 0,
        };
        let (bytes, first, length) = (self.bytes, number(8), number(10).max(1));
        (0..).map_while(move |i: usize| bytes.get(first + i * length)).map(|flag| *flag == b'*')
    }
}

/// The encoding that a `.cpg` names, such as `UTF-8`, `ISO-8859-1` or `1252`.
fn encoding(label: &[u8]) -> Option<&'static encoding_rs::Encoding> {
    let digits = label.iter().filter(|it| it.is_ascii_digit()).copied();
    let windows: Vec<u8> = b"windows-".iter().copied().chain(digits).collect();
    encoding_rs::Encoding::for_label(label).or_else(|| encoding_rs::Encoding::for_label(&windows))
}

fn feature(shape: &[u8], row: Result<Option<Row>, String>) -> Result<Feature, String> {
    let size = i32::try_from(shape.len()).map_err(|error| error.to_string())?;
    let shape = Shape::read_from(&mut Cursor::new(shape), size).map_err(|error| error.to_string())?;
    let properties = row?.map(|row| row.0).unwrap_or_default();
    Ok(Feature { properties, parts: parts(shape) })
}

/// The properties of a row.
struct Row(Map<String, Value>);

impl ReadableRecord for Row {
    fn read_using<S: Read + Seek, M: Read + Seek>(fields: &mut FieldIterator<'_, S, M>) -> Result<Self, FieldError> {
        let mut row = Map::new();
        for field in fields {
            match field {
                Ok(NamedValue { name, value }) => drop(row.insert(full_name(name), property(value))),
                // GDAL writes `00000000` for none.
                Err(error) if matches!(error.kind(), ErrorKind::InvalidDate(_)) => {}
                Err(error) => return Err(error),
            }
        }
        Ok(Self(row))
    }
}

/// The property that a cut name, or one in other letters, stands for.
fn full_name(name: &str) -> String {
    let is_meant = |full: &&&str| full[..full.len().min(NAME_LENGTH)].eq_ignore_ascii_case(name);
    PROPERTIES.iter().find(is_meant).map_or(name, |full| *full).to_owned()
}

fn property(value: FieldValue) -> Value {
    let number = |number: f64| {
        if number.fract() == 0.0 && number.abs() < WHOLE_MAX { (number as i64).into() } else { number.into() }
    };
    match value {
        FieldValue::Character(text) => text.into(),
        FieldValue::Memo(text) => text.into(),
        FieldValue::Numeric(it) => it.map_or(Value::Null, number),
        FieldValue::Float(it) => it.map_or(Value::Null, |it| number(it.into())),
        FieldValue::Double(it) | FieldValue::Currency(it) => number(it),
        FieldValue::Integer(it) => it.into(),
        FieldValue::Logical(it) => it.into(),
        FieldValue::Date(it) => it.map(|it| format!("{:04}-{:02}-{:02}", it.year(), it.month(), it.day())).into(),
        FieldValue::DateTime(_) => Value::Null,
    }
}

fn parts(shape: Shape) -> Vec<Part> {
    match shape {
        Shape::Polyline(line) => lines(line.into_inner()),
        Shape::PolylineM(line) => lines(line.into_inner()),
        Shape::PolylineZ(line) => lines(line.into_inner()),
        Shape::Polygon(polygon) => areas(polygon.into_inner()),
        Shape::PolygonM(polygon) => areas(polygon.into_inner()),
        Shape::PolygonZ(polygon) => areas(polygon.into_inner()),
        Shape::NullShape => Vec::new(),
        Shape::Point(_) | Shape::PointM(_) | Shape::PointZ(_) => vec![Part::Other("Point".to_owned())],
        Shape::Multipoint(_) | Shape::MultipointM(_) | Shape::MultipointZ(_) => {
            vec![Part::Other("MultiPoint".to_owned())]
        }
        Shape::Multipatch(_) => vec![Part::Other("MultiPatch".to_owned())],
    }
}

fn places(points: &[impl HasXY]) -> Vec<Place> {
    points.iter().map(|point| [point.x(), point.y()]).collect()
}

fn lines(lines: Vec<Vec<impl HasXY>>) -> Vec<Part> {
    lines.iter().map(|line| Part::Line(places(line))).collect()
}

/// Areas of outer rings, each with the holes that lie in it: a Shapefile does not say which do.
fn areas(rings: Vec<PolygonRing<impl HasXY>>) -> Vec<Part> {
    let (mut areas, mut holes) = (Vec::new(), Vec::new());
    for ring in &rings {
        match ring {
            PolygonRing::Outer(points) => areas.push(vec![places(points)]),
            PolygonRing::Inner(points) => holes.push(places(points)),
        }
    }
    let outers: Vec<Outer> = areas.iter().map(|rings| Outer::new(&rings[0])).collect();
    let found: Vec<_> = holes.iter().map(|hole| outers.iter().rposition(|outer| outer.holds(hole))).collect();
    for (hole, outer) in holes.into_iter().zip(found) {
        match outer {
            Some(outer) => areas[outer].push(hole),
            None => areas.push(vec![hole]),
        }
    }
    areas.into_iter().map(Part::Area).collect()
}

/// An outer ring and the box around it.
struct Outer {
    ring: Vec<Place>,
    low: Place,
    high: Place,
}

impl Outer {
    fn new(ring: &[Place]) -> Self {
        let fold = |with: fn(f64, f64) -> f64, from: f64| {
            let of = |axis: usize| ring.iter().map(|at| at[axis]).fold(from, with);
            [of(0), of(1)]
        };
        Self { ring: ring.to_vec(), low: fold(f64::min, f64::INFINITY), high: fold(f64::max, f64::NEG_INFINITY) }
    }

    /// Whether most points of a hole lie within: one or two may be points of the ring, too.
    fn holds(&self, hole: &[Place]) -> bool {
        let in_box = |at: &Place| (0..2).all(|axis| (self.low[axis]..=self.high[axis]).contains(&at[axis]));
        if !hole.iter().all(in_box) {
            return false;
        }
        let asked: Vec<_> = hole.iter().take(5).collect();
        2 * asked.iter().filter(|at| self.inside(at)).count() > asked.len()
    }

    fn inside(&self, [x, y]: &Place) -> bool {
        let edges = self.ring.iter().zip(self.ring.iter().cycle().skip(1));
        let crossed =
            edges.filter(|(a, b)| (a[1] > *y) != (b[1] > *y) && *x < a[0] + (b[0] - a[0]) * (y - a[1]) / (b[1] - a[1]));
        crossed.count() % 2 == 1
    }
}
