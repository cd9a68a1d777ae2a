//! Files as they come, in formats that are told apart by what is in them.

mod crs;
mod csv;
mod error;
mod flatgeobuf;
mod geojson;
mod gpkg;
mod gpx;
mod kml;
mod shapefile;
mod source;
mod wkb;
mod wkt;

pub use error::{Features, FormatError};
pub use source::{Beside, Source};

/// How the files of formats that are not read begin.
const UNREAD: [(&[u8], &str); 5] = [
    (b"PK\x03\x04", "a ZIP archive, such as KMZ or a packed Shapefile"),
    (b"\x1f\x8b", "compressed by gzip"),
    (b"PAR1", "GeoParquet"),
    (b"!table", "MapInfo TAB"),
    (b"  0\n", "DXF"),
];
/// Words of XML and JSON texts of formats that are not read.
const UNREAD_TEXTS: [(&str, &str); 4] = [
    ("opengis.net/gml", "GML"),
    ("<osm", "OpenStreetMap XML"),
    ("\"Topology\"", "TopoJSON"),
    ("\"esriGeometry", "Esri JSON"),
];
/// Where in a text those words stand.
const HEAD_LENGTH: usize = 2000;

/// Reads the features of a file.
///
/// # Errors
/// When the file as a whole cannot be read.
pub fn read(source: &Source) -> Result<Features, FormatError> {
    let bytes = &source.bytes;
    let extension = source.path.extension().map(|it| it.to_string_lossy().to_lowercase()).unwrap_or_default();
    if let Some((_, format)) = UNREAD.iter().find(|(begin, _)| bytes.starts_with(begin)) {
        return Err(FormatError::Unread { format });
    }
    if ["shx", "dbf"].contains(&extension.as_str()) {
        return Err(FormatError::Beside);
    }
    if bytes.starts_with(shapefile::MAGIC) {
        return shapefile::read(source);
    }
    if bytes.starts_with(gpkg::MAGIC) {
        return gpkg::read(source);
    }
    if bytes.starts_with(flatgeobuf::MAGIC) {
        return flatgeobuf::read(bytes);
    }
    read_text(&String::from_utf8_lossy(bytes), &extension)
}

fn read_text(text: &str, extension: &str) -> Result<Features, FormatError> {
    let text = text.trim_start_matches('\u{feff}').trim_start();
    let head: String = text.chars().take(HEAD_LENGTH).collect();
    let unread = UNREAD_TEXTS.iter().find(|(word, _)| head.contains(word));
    match text.chars().next() {
        Some('<') if text.contains("<gpx") => gpx::read(text),
        Some('<') if text.contains("<kml") || extension == "kml" => kml::read(text),
        Some('<' | '{') if let Some((_, format)) = unread => Err(FormatError::Unread { format }),
        Some('{' | '[' | '\u{1e}') => geojson::read(text),
        _ if wkt::is_one(text) => wkt::read(text),
        _ if ["csv", "tsv"].contains(&extension) || csv::is_one(text) => csv::read(text),
        // What calls itself GeoJSON is told what is wrong with it.
        _ if ["geojson", "json", "geojsons", "geojsonl"].contains(&extension) => geojson::read(text),
        _ => Err(FormatError::Unknown),
    }
}
