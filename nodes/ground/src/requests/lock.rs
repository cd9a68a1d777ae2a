//! One request manager a store: a lock that is held as long as a process writes there.

use std::ffi::OsString;
use std::fs::{File, OpenOptions, TryLockError};
use std::path::Path;

use anyhow::{Context, Result, bail};

/// The right to write a store. It ends with the process, however that ends; the file beside the store stays.
#[derive(Debug)]
pub struct StoreLock {
    _file: File,
}

impl StoreLock {
    /// Takes a store, which need not exist, for this process. One that `replaces` another does not wait for its end.
    ///
    /// # Errors
    /// When another request manager has it, whatever its domain, or the file system cannot lock.
    pub fn take(store: &Path, replaces: bool) -> Result<Self> {
        let mut path = OsString::from(store);
        path.push(".lock");
        let failed = || format!("store {}: cannot lock {}", store.display(), Path::new(&path).display());
        let open = OpenOptions::new().write(true).create(true).truncate(false).open(&path);
        let file = open.with_context(failed)?;
        match file.try_lock() {
            Ok(()) => Ok(Self { _file: file }),
            // The one before is stopped and keeps its lock; the store does not take from it any more.
            Err(TryLockError::WouldBlock) if replaces => Ok(Self { _file: file }),
            Err(TryLockError::WouldBlock) => {
                bail!("store {}: another request manager writes it", store.display())
            }
            Err(TryLockError::Error(error)) => Err(error).with_context(failed),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_store_has_one_writer_at_a_time_and_is_free_afterwards() {
        let folder = tempfile::tempdir().unwrap();
        let store = folder.path().join("requests.sqlite");
        let held = StoreLock::take(&store, false).unwrap();
        let error = StoreLock::take(&store, false).unwrap_err().to_string();
        assert!(error.contains("requests.sqlite: another request manager writes it"), "{error}");
        StoreLock::take(&store, true).unwrap();
        drop(held);
        StoreLock::take(&store, false).unwrap();
    }
}
