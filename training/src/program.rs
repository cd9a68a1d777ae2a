//! Which program made a result.

use serde::Serialize;

use crate::weights::REVISION;

/// The program, as results name it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Program {
    /// Its name.
    pub name: &'static str,
    /// Its version.
    pub version: &'static str,
    /// Its revision in version control.
    pub revision: &'static str,
}

impl Program {
    /// This one.
    pub const THIS: Self = Self { name: "swath-train", version: env!("CARGO_PKG_VERSION"), revision: REVISION };
}

impl std::fmt::Display for Program {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {}, revision {}", self.name, self.version, self.revision)
    }
}
