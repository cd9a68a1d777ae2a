//! GeoPackages (OGC 12-128) as layers of rows: SQLite files, opened in memory with bounds on time and size.

/// SQLite, for those who write such files.
pub use rusqlite;
use rusqlite::limits::Limit;
use rusqlite::types::ValueRef;
use rusqlite::{Connection, MAIN_DB, OptionalExtension as _, Row as SqlRow};

/// Beginning of every SQLite file.
pub const MAGIC: &[u8] = b"SQLite format 3\0";
/// Where a file says whether changes are written to a log beside it first.
const WRITE_AHEAD: std::ops::Range<usize> = 18..20;
/// Steps of SQLite after which a file is given up, in thousands: ten times what the largest file needs.
const THOUSAND_STEPS_MAX: u32 = 200_000;

/// Why a file cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// It has no layers of features.
    #[error("it is no GeoPackage")]
    NoPackage,
    /// SQLite cannot read it.
    #[error(transparent)]
    Sqlite(#[from] rusqlite::Error),
}

/// A table of features.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// Number of its reference system: 0 is one of longitudes and latitudes that nobody named.
    pub srs_id: i64,
    /// Organization, code and name of its reference system, if the file knows it.
    pub srs: Option<(String, i64, String)>,
    /// Its rows, in order.
    pub rows: Vec<Row>,
}

/// A feature.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Row {
    /// What is neither null nor binary, by the names of columns.
    pub cells: Vec<(String, Cell)>,
    /// Its geometry: a header and well-known binary.
    pub geometry: Option<Vec<u8>>,
}

/// A value.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    /// A whole number, or a flag.
    Integer(i64),
    /// A number.
    Real(f64),
    /// A text.
    Text(String),
}

/// Reads all layers of a file.
///
/// # Errors
/// When the file is none, damaged, or takes too long.
pub fn layers(bytes: &[u8]) -> Result<Vec<Layer>, Error> {
    let database = open(bytes)?;
    let tables = "SELECT table_name, column_name, srs_id FROM gpkg_geometry_columns ORDER BY table_name";
    let Ok(mut tables) = database.prepare(tables) else { return Err(Error::NoPackage) };
    let tables = tables.query_map([], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?)))?;
    let tables: Vec<(String, String, i64)> = tables.collect::<Result<_, _>>()?;
    let layer = |(table, column, srs_id): (String, String, i64)| {
        Ok(Layer { srs_id, srs: named(&database, srs_id), rows: rows(&database, &table, &column)? })
    };
    tables.into_iter().map(layer).collect()
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

fn named(database: &Connection, srs: i64) -> Option<(String, i64, String)> {
    let query = "SELECT organization, organization_coordsys_id, srs_name FROM gpkg_spatial_ref_sys WHERE srs_id = ?1";
    let one =
        |row: &SqlRow<'_>| -> rusqlite::Result<(String, i64, String)> { Ok((row.get(0)?, row.get(1)?, row.get(2)?)) };
    database.query_row(query, [srs], one).optional().unwrap_or_default()
}

fn rows(database: &Connection, table: &str, geometry: &str) -> rusqlite::Result<Vec<Row>> {
    // The names of a statement's columns are believed to be UTF-8; those of this table are values.
    let mut names = database.prepare("SELECT name FROM pragma_table_info(?1)")?;
    let names = names.query_map([table], |row| Ok(text(row.get_ref(0)?.as_bytes().unwrap_or_default())))?;
    let names: Vec<String> = names.collect::<Result<_, _>>()?;
    let mut statement = database.prepare(&format!("SELECT * FROM \"{}\"", table.replace('"', "\"\"")))?;
    let mut found = statement.query([])?;
    let mut rows = Vec::new();
    while let Some(row) = found.next()? {
        rows.push(read(row, &names, geometry)?);
    }
    Ok(rows)
}

fn read(row: &SqlRow<'_>, names: &[String], geometry: &str) -> rusqlite::Result<Row> {
    let mut read = Row::default();
    for (i, name) in names.iter().enumerate() {
        match row.get_ref(i)? {
            ValueRef::Blob(blob) if name.eq_ignore_ascii_case(geometry) => read.geometry = Some(blob.to_vec()),
            ValueRef::Integer(number) => read.cells.push((name.clone(), Cell::Integer(number))),
            ValueRef::Real(number) => read.cells.push((name.clone(), Cell::Real(number))),
            ValueRef::Text(bytes) => read.cells.push((name.clone(), Cell::Text(text(bytes)))),
            ValueRef::Null | ValueRef::Blob(_) => {}
        }
    }
    Ok(read)
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}
