//! Files as they come: GeoJSON, text sequences of it, KML, GPX, WKT and CSV, told apart by what is in them.

mod csv;
mod error;
mod geojson;
mod gpx;
mod kml;
mod wkt;

use std::path::Path;

pub use error::{Features, FormatError};

/// How the files of formats that are not read begin.
const UNREAD: [(&[u8], &str); 6] = [
    (b"\x00\x00\x27\x0a", "a shapefile"),
    (b"SQLite format 3", "a GeoPackage or another SQLite file"),
    (b"fgb", "FlatGeobuf"),
    (b"PK\x03\x04", "a ZIP archive, such as KMZ"),
    (b"\x1f\x8b", "compressed by gzip"),
    (b"PAR1", "GeoParquet"),
];

/// Reads the features of a file; the ending of `path` helps where the text does not tell.
///
/// # Errors
/// When the file as a whole cannot be read.
pub fn read(bytes: &[u8], path: &Path) -> Result<Features, FormatError> {
    if let Some((_, format)) = UNREAD.iter().find(|(begin, _)| bytes.starts_with(begin)) {
        return Err(FormatError::Unread { format });
    }
    let text = String::from_utf8_lossy(bytes);
    let text = text.trim_start_matches('\u{feff}').trim_start();
    let extension = path.extension().map(|it| it.to_string_lossy().to_lowercase()).unwrap_or_default();
    match text.chars().next() {
        Some('{' | '[' | '\u{1e}') => geojson::read(text),
        Some('<') if text.contains("<gpx") => gpx::read(text),
        Some('<') if text.contains("<kml") || extension == "kml" => kml::read(text),
        Some('<') if text.contains("opengis.net/gml") => Err(FormatError::Unread { format: "GML" }),
        _ if wkt::is_one(text) => wkt::read(text),
        _ if ["csv", "tsv"].contains(&extension.as_str()) || csv::is_one(text) => csv::read(text),
        // What calls itself GeoJSON is told what is wrong with it.
        _ if ["geojson", "json", "geojsons", "geojsonl"].contains(&extension.as_str()) => geojson::read(text),
        _ => Err(FormatError::Unknown),
    }
}
