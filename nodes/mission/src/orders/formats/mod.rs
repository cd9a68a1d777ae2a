//! Files as they come: GeoJSON, text sequences of it, KML, GPX, WKT, CSV and shapefiles, told apart by what is in them.

mod csv;
mod geojson;
mod gpx;
mod kml;
mod shapefile;
mod wkt;

use std::path::Path;

use thiserror::Error;

use super::feature::Feature;

/// The features of a file, each or why it cannot be read.
pub type Features = Vec<Result<Feature, String>>;

/// Why a file as a whole cannot be read.
#[derive(Debug, Error)]
pub enum FormatError {
    /// It is no GeoJSON although it looks like it.
    #[error("is not GeoJSON: {0}")]
    GeoJson(Box<::geojson::Error>),
    /// It is not what it looks like.
    #[error("is not {format}: {reason}")]
    Malformed {
        /// The format that it looks like.
        format: &'static str,
        /// What is wrong.
        reason: String,
    },
    /// Its places are not longitudes and latitudes.
    #[error("is in {crs}: convert it with `ogr2ogr -t_srs EPSG:4326 OUT.geojson IN`")]
    Crs {
        /// The reference system.
        crs: String,
    },
    /// It is of a format that is not read.
    #[error("is {format}, which is not read: convert it with `ogr2ogr -t_srs EPSG:4326 OUT.geojson IN`")]
    Unread {
        /// The format.
        format: &'static str,
    },
    /// Nobody knows what it is.
    #[error("is of no format that is known: GeoJSON, KML, GPX, WKT, CSV and shapefiles are read")]
    Unknown,
}

/// How the files of formats that are not read begin.
const UNREAD: [(&[u8], &str); 5] = [
    (b"SQLite format 3", "a GeoPackage or another SQLite file"),
    (b"fgb", "FlatGeobuf"),
    (b"PK\x03\x04", "a ZIP archive, such as KMZ"),
    (b"\x1f\x8b", "compressed by gzip"),
    (b"PAR1", "GeoParquet"),
];

/// Reads the features of a file; `path` is where its companions, such as a shapefile's attributes, are looked for.
///
/// # Errors
/// When the file as a whole cannot be read.
pub fn read(bytes: &[u8], path: &Path) -> Result<Features, FormatError> {
    if let Some((_, format)) = UNREAD.iter().find(|(begin, _)| bytes.starts_with(begin)) {
        return Err(FormatError::Unread { format });
    }
    if shapefile::is_one(bytes) {
        return shapefile::read(bytes, path);
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
