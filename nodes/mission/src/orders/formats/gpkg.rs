//! GeoPackage (OGC 12-128): layers of features.

use geozero::GeozeroGeometry as _;
use geozero::wkb::GpkgWkb;
use serde_json::Value;
pub(super) use swath_gpkg::MAGIC;
use swath_gpkg::{Cell, Error, Layer, Row, layers};

use super::super::feature::{Feature, Part};
use super::crs;
use super::error::{Features, FormatError};
use super::source::Source;
use super::wkb::Parts;

/// Reads a file.
pub(super) fn read(source: &Source) -> Result<Features, FormatError> {
    let malformed = |reason: String| FormatError::Malformed { format: "GeoPackage", reason };
    if source.beside.log.as_ref().is_some_and(|log| !log.is_empty()) {
        let open = "another program has it open and has not written all of it: close it there".to_owned();
        return Err(malformed(open));
    }
    let layers = layers(&source.bytes).map_err(|error| match error {
        Error::NoPackage => FormatError::Unread { format: "a SQLite file that is no GeoPackage" },
        Error::Sqlite(error) => malformed(error.to_string()),
    })?;
    let mut features = Vec::new();
    for layer in layers {
        check_crs(&layer)?;
        features.extend(layer.rows.into_iter().map(feature));
    }
    Ok(features)
}

fn check_crs(layer: &Layer) -> Result<(), FormatError> {
    // 0 is a reference system of longitudes and latitudes that nobody named.
    if [0, 4326].contains(&layer.srs_id) {
        return Ok(());
    }
    let unknown = ("srs".to_owned(), layer.srs_id, "unknown".to_owned());
    let (organization, code, name) = layer.srs.clone().unwrap_or(unknown);
    crs::by_code(&format!("{organization}:{code}"))
        .map_err(|_| FormatError::Crs { crs: format!("{organization}:{code} ({name})") })
}

fn feature(row: Row) -> Result<Feature, String> {
    let value = |cell: Cell| match cell {
        Cell::Integer(number) => number.into(),
        Cell::Real(number) => number.into(),
        Cell::Text(text) => Value::String(text),
    };
    let properties = row.cells.into_iter().map(|(name, cell)| (name, value(cell))).collect();
    let parts = row.geometry.as_deref().map(parts).transpose()?.unwrap_or_default();
    Ok(Feature { properties, parts })
}

fn parts(blob: &[u8]) -> Result<Vec<Part>, String> {
    let mut parts = Parts::default();
    GpkgWkb(blob).process_geom(&mut parts).map_err(|error| format!("its geometry is damaged: {error}"))?;
    Ok(parts.parts)
}
