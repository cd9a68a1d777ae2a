//! What several commands share: how bags are read, exit codes, output.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;

use crate::error::{BagError, Result};
use crate::file::source::{MAX_RECORD_BYTES, ReadOptions};
use crate::out::{print, say};
use crate::qos::QosOverride;

/// The exit code of a command that has done its work, with loss.
pub(super) const WITH_LOSS: u8 = 3;

/// How bags are read.
#[derive(Debug, Args)]
pub(super) struct ReadArgs {
    /// Largest message, and largest chunk once unpacked, that is read into memory [bytes]
    #[arg(
        long,
        value_name = "BYTES",
        default_value_t = MAX_RECORD_BYTES,
        value_parser = clap::value_parser!(u64).range(1024..=u64::from(u32::MAX))
    )]
    max_record_size: u64,
    /// Kind of files, for scripts that name it; it is seen from the files themselves
    #[arg(short, long, value_name = "KIND", value_parser = ["mcap", "sqlite3"])]
    storage: Option<String>,
}

impl ReadArgs {
    pub(super) fn options(&self) -> ReadOptions {
        ReadOptions { max_record_bytes: self.max_record_size }
    }
}

/// The bags of `--input BAG [KIND]`, which stands as often as there are bags: kinds are seen from the files.
pub(super) fn bags(words: Vec<String>) -> Vec<PathBuf> {
    let mut bags: Vec<PathBuf> = Vec::new();
    for word in words {
        let is_kind = matches!(word.as_str(), "mcap" | "sqlite3") && !bags.is_empty() && !Path::new(&word).exists();
        if !is_kind {
            bags.push(word.into());
        }
    }
    bags
}

/// QoS by topic, from a YAML file.
pub(super) fn overrides(path: Option<&Path>) -> Result<BTreeMap<String, QosOverride>> {
    let Some(path) = path else { return Ok(BTreeMap::new()) };
    let text = fs::read_to_string(path).map_err(BagError::io("read", path))?;
    yaml_serde::from_str(&text).map_err(|e| BagError::Option {
        option: "--qos-profile-overrides-path",
        reason: format!("{}: {e}", path.display()),
    })
}

/// The exit code of a command that has done its work; tells what was lost on the way.
pub(super) fn done(faults: &[String]) -> ExitCode {
    for fault in faults {
        say(&format!("warning: {fault}"));
    }
    if faults.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(WITH_LOSS) }
}

/// Prints a value as one line of JSON.
pub(super) fn print_json(value: &impl serde::Serialize) -> Result<()> {
    let text =
        serde_json::to_string(value).map_err(|e| BagError::Option { option: "--json", reason: e.to_string() })?;
    print(&(text + "\n"))
}
