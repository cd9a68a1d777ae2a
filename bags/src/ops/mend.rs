//! Closes the files of a bag whose recording was interrupted, and writes its `metadata.yaml` anew.

use std::fs::{self, File};
use std::io::{Read as _, Seek as _, SeekFrom};
use std::path::{Path, PathBuf};

use mcap::MAGIC;

use super::recover::recover;
use super::reindex::reindex;
use crate::error::{BagError, Result, chain};
use crate::file::source::ReadOptions;
use crate::metadata::BagInformation;
use crate::writer::BagOptions;

/// Where a file is saved before it takes its place.
const SAVED: &str = ".saved";

/// Saves what is whole in the files of a bag that were not closed, each in its place. Returns what could not be read.
///
/// # Errors
/// When the directory cannot be read or written.
pub fn mend(dir: &Path, options: ReadOptions) -> Result<(BagInformation, Vec<String>)> {
    let mut faults = Vec::new();
    let entries = fs::read_dir(dir).map_err(BagError::io("read", dir))?;
    let paths: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    for path in paths.iter().filter(|path| path.extension().is_some_and(|extension| extension == "mcap")) {
        if !is_closed(path).map_err(BagError::io("read", path))? {
            faults.extend(close(dir, path, options)?);
        }
    }
    let (information, more) = reindex(dir, options)?;
    faults.extend(more);
    Ok((information, faults))
}

/// Whether a file ends as it should.
fn is_closed(path: &Path) -> std::io::Result<bool> {
    let mut file = File::open(path)?;
    if file.metadata()?.len() < 2 * MAGIC.len() as u64 {
        return Ok(false);
    }
    let mut end = [0; MAGIC.len()];
    file.seek(SeekFrom::End(-(MAGIC.len() as i64)))?;
    file.read_exact(&mut end)?;
    Ok(end == MAGIC)
}

fn close(dir: &Path, path: &Path, options: ReadOptions) -> Result<Vec<String>> {
    let saved = dir.join(SAVED);
    // One of an attempt before.
    let _ = fs::remove_dir_all(&saved);
    let bag = BagOptions { max_file_bytes: None, max_file_duration: None, ..BagOptions::default() };
    let faults = match recover(path, &saved, bag, options) {
        Ok(recovery) => {
            let whole = saved.join(format!("{SAVED}_0.mcap"));
            fs::rename(&whole, path).map_err(BagError::io("replace", path))?;
            recovery.faults
        }
        // It was interrupted before anything was in it.
        Err(error) => {
            fs::remove_file(path).map_err(BagError::io("remove", path))?;
            vec![chain(&error)]
        }
    };
    fs::remove_dir_all(&saved).map_err(BagError::io("remove", &saved))?;
    Ok(faults)
}
