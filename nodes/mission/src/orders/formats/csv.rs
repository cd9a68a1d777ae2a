//! Tables: a column of well-known text, or columns of the ends' latitudes and longitudes.

use csv::{ReaderBuilder, StringRecord};
use serde_json::Value;

use super::super::feature::{Feature, Part};
use super::error::{Features, FormatError};
use super::wkt;

/// Names of a column of well-known text.
const WKT_COLUMNS: [&str; 4] = ["wkt", "geometry", "geom", "the_geom"];
/// Names of the columns of both ends: longitude and latitude of the start, longitude and latitude of the end.
const END_COLUMNS: [[&str; 3]; 4] = [
    ["start_lon", "start_longitude", "start_longitude_deg"],
    ["start_lat", "start_latitude", "start_latitude_deg"],
    ["end_lon", "end_longitude", "end_longitude_deg"],
    ["end_lat", "end_latitude", "end_latitude_deg"],
];

/// Whether a text begins with a line of columns that tell of places.
pub(super) fn is_one(text: &str) -> bool {
    reader(text).headers().is_ok_and(|head| Columns::new(head).is_some())
}

/// Reads a table.
pub(super) fn read(text: &str) -> Result<Features, FormatError> {
    let malformed = |reason: String| FormatError::Malformed { format: "CSV", reason };
    let mut table = reader(text);
    let head = table.headers().map_err(|error| malformed(error.to_string()))?.clone();
    let Some(columns) = Columns::new(&head) else {
        let needed = "it needs a column `wkt`, or columns `start_lon`, `start_lat`, `end_lon` and `end_lat`";
        return Err(malformed(needed.to_owned()));
    };
    let row = |row: Result<StringRecord, csv::Error>| columns.feature(&head, &row.map_err(|error| error.to_string())?);
    Ok(table.records().map(row).collect())
}

fn reader(text: &str) -> csv::Reader<&[u8]> {
    let head = text.lines().next().unwrap_or_default();
    let count = |letter: char| head.matches(letter).count();
    let delimiter = if count('\t') > count(',') {
        b'\t'
    } else if count(';') > count(',') {
        b';'
    } else {
        b','
    };
    ReaderBuilder::new().delimiter(delimiter).flexible(true).trim(csv::Trim::All).from_reader(text.as_bytes())
}

/// The columns that tell of places.
enum Columns {
    Wkt(usize),
    Ends([usize; 4]),
}

impl Columns {
    fn new(head: &StringRecord) -> Option<Self> {
        let find = |names: &[&str]| head.iter().position(|it| names.iter().any(|name| it.eq_ignore_ascii_case(name)));
        let ends = || {
            let [a, b, c, d] = END_COLUMNS.map(|names| find(&names));
            Some(Self::Ends([a?, b?, c?, d?]))
        };
        find(&WKT_COLUMNS).map(Self::Wkt).or_else(ends)
    }

    fn feature(&self, head: &StringRecord, row: &StringRecord) -> Result<Feature, String> {
        let (parts, own) = match self {
            Self::Wkt(column) => (wkt::parts(row.get(*column).unwrap_or_default())?, vec![*column]),
            Self::Ends(columns) => {
                let number = |i: usize| {
                    let text = row.get(columns[i]).unwrap_or_default();
                    text.parse::<f64>().map_err(|_| format!("`{}` must be a number", END_COLUMNS[i][0]))
                };
                (vec![Part::Line(vec![[number(0)?, number(1)?], [number(2)?, number(3)?]])], columns.to_vec())
            }
        };
        let cells =
            head.iter().zip(row).enumerate().filter(|(column, (_, cell))| !own.contains(column) && !cell.is_empty());
        let properties = cells.map(|(_, (name, cell))| (name.to_owned(), Value::String(cell.to_owned())));
        Ok(Feature { properties: properties.collect(), parts })
    }
}
