//! What several commands take: strips from files, and who acts.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use swath_mission::orders::geojson::{self, Import, Lengths};
use swath_node::out;

/// Who acts.
#[derive(Debug, Args)]
pub struct Actor {
    /// Who asks for it.
    #[arg(long, default_value = "operator")]
    pub actor: String,
    /// Why.
    #[arg(long, default_value = "")]
    pub reason: String,
}

/// Reads the strips of GeoJSON files; features that are no strips are told on stderr.
pub fn read_files(files: &[PathBuf], lengths: Lengths) -> Result<Import> {
    let mut all = Import::default();
    for file in files {
        let import = geojson::import(file, lengths)?;
        for (feature, reason) in &import.refused {
            out::say(format_args!("requests {}, feature {feature}: {reason}", file.display()));
        }
        all.lines += import.lines;
        all.requests.extend(import.requests);
        all.cut.extend(import.cut);
        all.refused.extend(import.refused);
    }
    Ok(all)
}
