//! Files of a mission that flies on while there is no room for them: what cannot be written yet waits.

use std::fs::File;
use std::io::{self, ErrorKind, Write};
use std::path::Path;

use anyhow::{Context, Result};

/// Whether there is no room where a file is.
fn is_full(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::StorageFull | ErrorKind::QuotaExceeded)
}

/// A file to which is added; what there is no room for waits in memory and is written before all that comes later.
#[derive(Debug)]
pub struct Appended<W = File> {
    file: W,
    waits: Vec<u8>,
    /// Whether there was no room when it was tried last.
    full: bool,
}

impl<W: Write> Appended<W> {
    /// Adds to a file where it stands.
    #[must_use]
    pub fn new(file: W) -> Self {
        Self { file, waits: Vec::new(), full: false }
    }

    /// Adds bytes, and tells whether there is nothing left that waits.
    ///
    /// # Errors
    /// When they cannot be written for another reason than that there is no room.
    pub fn add(&mut self, bytes: &[u8]) -> io::Result<bool> {
        self.waits.extend_from_slice(bytes);
        let outcome = self.write();
        match outcome {
            Ok(()) if self.full => tracing::info!("there is room again for what is kept"),
            Err(ref error) if is_full(error) && !self.full => {
                tracing::error!("there is no room for what is kept: it waits in memory until there is some");
            }
            _ => {}
        }
        self.full = outcome.as_ref().is_err_and(is_full);
        match outcome {
            Err(error) if is_full(&error) => Ok(false),
            other => other.map(|()| true),
        }
    }

    fn write(&mut self) -> io::Result<()> {
        let (mut written, mut outcome) = (0, Ok(()));
        while written < self.waits.len() && outcome.is_ok() {
            match self.file.write(&self.waits[written..]) {
                Ok(0) => outcome = Err(ErrorKind::WriteZero.into()),
                Ok(more) => written += more,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => outcome = Err(error),
            }
        }
        self.waits.drain(..written);
        outcome
    }
}

/// Keeps a text in a file, whole or not at all; tells whether there was room for it.
///
/// # Errors
/// When it cannot be written for another reason than that there is no room.
pub fn keep(path: &Path, text: &str) -> Result<bool> {
    let partial = path.with_extension("partial");
    match std::fs::write(&partial, text).and_then(|()| std::fs::rename(&partial, path)) {
        Err(error) if is_full(&error) => {
            // It takes room from others, and is written anew the next time.
            let _ = std::fs::remove_file(&partial);
            tracing::debug!("there is no room for {}", path.display());
            Ok(false)
        }
        outcome => outcome.map(|()| true).with_context(|| format!("cannot write {}", path.display())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A disk with room for so many bytes.
    struct Disk {
        room: usize,
        holds: Vec<u8>,
    }

    impl Write for Disk {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let count = bytes.len().min(self.room);
            if count == 0 && !bytes.is_empty() {
                return Err(ErrorKind::StorageFull.into());
            }
            self.room -= count;
            self.holds.extend(&bytes[..count]);
            Ok(count)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn what_there_is_no_room_for_is_written_later_in_order() {
        let mut file = Appended::new(Disk { room: 5, holds: Vec::new() });
        assert!(file.add(b"abc").unwrap());
        assert!(!file.add(b"def").unwrap());
        assert_eq!(file.file.holds, b"abcde");
        assert!(!file.add(b"ghi").unwrap());
        file.file.room = 100;
        assert!(file.add(b"").unwrap());
        assert_eq!(file.file.holds, b"abcdefghi");
        assert!(file.add(b"").unwrap(), "nothing is written twice");
        assert_eq!(file.file.holds, b"abcdefghi");
    }

    #[test]
    fn a_full_device_is_no_error_and_another_one_is() {
        let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        assert!(!Appended::new(full).add(b"a").unwrap());
        let unwritable = File::open("/dev/null").unwrap();
        assert!(Appended::new(unwritable).add(b"a").is_err());
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("kept.json");
        assert!(keep(&path, "1").unwrap() && keep(&path, "2").unwrap());
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "2");
        std::os::unix::fs::symlink("/dev/full", folder.path().join("other.partial")).unwrap();
        assert!(!keep(&folder.path().join("other.json"), "1").unwrap());
        assert!(keep(&folder.path().join("no/kept.json"), "1").is_err());
    }
}
