//! What is read: the bytes of a file, and what lies beside it and belongs to it.

use std::path::PathBuf;

/// A file that is read.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Source {
    /// Its path; the ending helps where the contents do not tell the format.
    pub path: PathBuf,
    /// What is in it.
    pub bytes: Vec<u8>,
    /// What lies beside it.
    pub beside: Beside,
}

/// Files that belong to another one.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Beside {
    /// Properties of a Shapefile: its `.dbf`.
    pub table: Option<Vec<u8>>,
    /// Encoding of their texts: its `.cpg`.
    pub encoding: Option<Vec<u8>>,
    /// Reference system of a Shapefile: its `.prj`.
    pub reference_system: Option<Vec<u8>>,
    /// What was last written to a GeoPackage and is not in it yet: its `-wal`.
    pub log: Option<Vec<u8>>,
}

impl Source {
    /// A file with nothing beside it.
    #[must_use]
    pub fn alone(path: impl Into<PathBuf>, bytes: impl Into<Vec<u8>>) -> Self {
        Self { path: path.into(), bytes: bytes.into(), beside: Beside::default() }
    }
}
