//! GeoPackage (OGC 12-128): a SQLite file with tables of features.

use geozero::GeozeroGeometry as _;
use geozero::wkb::GpkgWkb;
use rusqlite::limits::Limit;
use rusqlite::types::ValueRef;
use rusqlite::{Connection, MAIN_DB, OptionalExtension as _, Row};
use serde_json::Value;

use super::super::feature::{Feature, Part};
use super::crs;
use super::error::{Features, FormatError};
use super::source::Source;
use super::wkb::Parts;

/// Beginning of every SQLite file.
pub(super) const MAGIC: &[u8] = b"SQLite format 3\0";
/// Where a file says whether changes are written to a log beside it first.
const WRITE_AHEAD: std::ops::Range<usize> = 18..20;
/// Steps of SQLite after which a file is given up, in thousands: ten times what the largest file needs.
const THOUSAND_STEPS_MAX: u32 = 200_000;

/// Reads a file.
pub(super) fn read(source: &Source) -> Result<Features, FormatError> {
    let malformed = |reason: String| FormatError::Malformed { format: "GeoPackage", reason };
    if source.beside.log.as_ref().is_some_and(|log| !log.is_empty()) {
        let open = "another program has it open and has not written all of it: close it there".to_owned();
        return Err(malformed(open));
    }
    let failed = |error: rusqlite::Error| malformed(error.to_string());
    let database = open(&source.bytes).map_err(failed)?;
    let tables = "SELECT table_name, column_name, srs_id FROM gpkg_geometry_columns ORDER BY table_name";
    let Ok(mut tables) = database.prepare(tables) else {
        return Err(FormatError::Unread { format: "a SQLite file that is no GeoPackage" });
    };
    let tables = tables.query_map([], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?))).map_err(failed)?;
    let tables: Vec<(String, String, i64)> = tables.collect::<Result<_, _>>().map_err(failed)?;
    let mut features = Vec::new();
    for (table, column, srs) in tables {
        check_crs(&database, srs)?;
        read_table(&database, &table, &column, &mut features).map_err(failed)?;
    }
    Ok(features)
}

/// Opens a file in memory; whatever its tables and views ask for, neither time nor memory runs out.
fn open(bytes: &[u8]) -> rusqlite::Result<Connection> {
    let mut database = Connection::open_in_memory()?;
    let mut bytes = bytes.to_vec();
    if let Some(ways) = bytes.get_mut(WRITE_AHEAD) {
        // All of the log is in the file: it can be read like any other.
        ways.fill(1);
    }
    database.deserialize_read_exact(MAIN_DB, &bytes[..], bytes.len(), true)?;
    database.set_limit(Limit::SQLITE_LIMIT_LENGTH, i32::try_from(bytes.len()).unwrap_or(i32::MAX))?;
    let mut steps = 0_u32;
    let given_up = move || {
        steps += 1;
        steps > THOUSAND_STEPS_MAX
    };
    database.progress_handler(1000, Some(given_up))?;
    database.pragma_update(None, "trusted_schema", false)?;
    Ok(database)
}

fn check_crs(database: &Connection, srs: i64) -> Result<(), FormatError> {
    // 0 is a reference system of longitudes and latitudes that nobody named.
    if [0, 4326].contains(&srs) {
        return Ok(());
    }
    let query = "SELECT organization, organization_coordsys_id, srs_name FROM gpkg_spatial_ref_sys WHERE srs_id = ?1";
    let one =
        |row: &Row<'_>| -> rusqlite::Result<(String, i64, String)> { Ok((row.get(0)?, row.get(1)?, row.get(2)?)) };
    let named = database.query_row(query, [srs], one).optional().unwrap_or_default();
    let (organization, code, name) = named.unwrap_or_else(|| ("srs".to_owned(), srs, "unknown".to_owned()));
    crs::by_code(&format!("{organization}:{code}"))
        .map_err(|_| FormatError::Crs { crs: format!("{organization}:{code} ({name})") })
}

fn read_table(database: &Connection, table: &str, column: &str, features: &mut Features) -> rusqlite::Result<()> {
    // The names of a statement's columns are believed to be UTF-8; those of this table are values.
    let mut names = database.prepare("SELECT name FROM pragma_table_info(?1)")?;
    let names = names.query_map([table], |row| Ok(text(row.get_ref(0)?.as_bytes().unwrap_or_default())))?;
    let names: Vec<String> = names.collect::<Result<_, _>>()?;
    let mut rows = database.prepare(&format!("SELECT * FROM \"{}\"", table.replace('"', "\"\"")))?;
    let mut rows = rows.query([])?;
    while let Some(row) = rows.next()? {
        features.push(read_row(row, &names, column));
    }
    Ok(())
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn read_row(row: &Row<'_>, names: &[String], geometry: &str) -> Result<Feature, String> {
    let mut feature = Feature::default();
    for (i, name) in names.iter().enumerate() {
        let value = row.get_ref(i).map_err(|error| error.to_string())?;
        match value {
            ValueRef::Blob(blob) if name.eq_ignore_ascii_case(geometry) => feature.parts = parts(blob)?,
            ValueRef::Integer(number) => drop(feature.properties.insert(name.clone(), number.into())),
            ValueRef::Real(number) => drop(feature.properties.insert(name.clone(), number.into())),
            ValueRef::Text(bytes) => drop(feature.properties.insert(name.clone(), Value::String(text(bytes)))),
            ValueRef::Null | ValueRef::Blob(_) => {}
        }
    }
    Ok(feature)
}

fn parts(blob: &[u8]) -> Result<Vec<Part>, String> {
    let mut parts = Parts::default();
    GpkgWkb(blob).process_geom(&mut parts).map_err(|error| format!("its geometry is damaged: {error}"))?;
    Ok(parts.parts)
}
