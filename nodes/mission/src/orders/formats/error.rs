//! What a file gives: features, or why it cannot be read.

use thiserror::Error;

use crate::orders::feature::Feature;

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
    /// It belongs to a Shapefile and is not the file that tells of its places.
    #[error("belongs to a Shapefile: the .shp beside it is read")]
    Beside,
    /// Nobody knows what it is.
    #[error(
        "is of no format that is known: GeoJSON, KML, GPX, WKT, CSV, Shapefile, FlatGeobuf and GeoPackage are read"
    )]
    Unknown,
}
