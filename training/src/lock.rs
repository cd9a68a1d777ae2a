//! One run a folder: a lock that is held as long as a process writes there.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read, Write};
use std::path::Path;

use crate::error::{Result, TrainingError};

/// The file that is locked. It stays when the run is over: what counts is the lock, which ends with the process.
const NAME: &str = "run.lock";

/// The right to write into a run's folder.
#[derive(Debug)]
pub struct RunLock {
    _file: File,
}

impl RunLock {
    /// Takes the folder, which exists, for this process.
    ///
    /// # Errors
    /// [`TrainingError::Busy`] while another run holds it; a file system that cannot lock.
    pub fn take(folder: &Path) -> Result<Self> {
        let path = folder.join(NAME);
        let open = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&path);
        let mut file = open.map_err(TrainingError::file("write", &path))?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Err(busy(folder, file)),
            Err(TryLockError::Error(error)) => return Err(TrainingError::file("lock", &path)(error)),
        }
        // For whoever is refused.
        let written = file.set_len(0).and_then(|()| write!(file, "{}", std::process::id()));
        written.map_err(TrainingError::file("write", &path))?;
        Ok(Self { _file: file })
    }
}

fn busy(folder: &Path, mut file: File) -> TrainingError {
    let mut process = String::new();
    // The holder may be about to write it; the refusal is as good without.
    if file.read_to_string(&mut process).is_err() || process.is_empty() {
        process = "unknown".into();
    }
    TrainingError::Busy { path: folder.to_path_buf(), process }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_has_one_holder_at_a_time_and_is_free_afterwards() {
        let folder = tempfile::tempdir().unwrap();
        let held = RunLock::take(folder.path()).unwrap();
        let error = RunLock::take(folder.path()).unwrap_err().to_string();
        assert!(error.contains(&format!("process {}", std::process::id())), "{error}");
        assert!(error.contains(&folder.path().display().to_string()), "{error}");
        drop(held);
        RunLock::take(folder.path()).unwrap();
    }
}
