//! The commands that were flown, kept so that a spacecraft that is started again goes on where the one before was: the
//! state follows from them.

use std::fs::OpenOptions;
use std::io::{Read as _, Seek as _, SeekFrom, Write as _};
use std::path::Path;

use anyhow::{Context, Result};
use nalgebra::Vector3;

/// Length of a command [B].
const LENGTH: usize = 24;

/// A file to which each command is added before the state that follows from it is told.
pub struct Journal {
    file: std::fs::File,
}

impl Journal {
    /// Opens the file of a spacecraft; `again` is whether there was one before. Returns what it has flown [N m].
    ///
    /// # Errors
    /// When the file cannot be read or written.
    pub fn open(path: &Path, again: bool) -> Result<(Self, Vec<Vector3<f64>>)> {
        let failed = || format!("cannot use {}", path.display());
        let open = OpenOptions::new().read(true).write(true).create(true).truncate(!again).open(path);
        let mut file = open.with_context(failed)?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).with_context(failed)?;
        let flown: Vec<_> = bytes.chunks_exact(LENGTH).map(command).collect();
        // A command that was written in part was not flown.
        let whole = (flown.len() * LENGTH) as u64;
        file.set_len(whole).with_context(failed)?;
        file.seek(SeekFrom::Start(whole)).with_context(failed)?;
        Ok((Self { file }, flown))
    }

    /// Adds a command [N m].
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn add(&mut self, command: &Vector3<f64>) -> Result<()> {
        let mut bytes = [0; LENGTH];
        for (place, component) in bytes.chunks_exact_mut(8).zip(command) {
            place.copy_from_slice(&component.to_le_bytes());
        }
        self.file.write_all(&bytes).context("cannot keep the commands of the spacecraft")
    }
}

fn command(bytes: &[u8]) -> Vector3<f64> {
    let mut components = bytes.chunks_exact(8).map(|it| it.try_into().map_or(0.0, f64::from_le_bytes));
    Vector3::from_fn(|_, _| components.next().unwrap_or(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_written_whole_is_read_again() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("spacecraft.commands");
        let commands = [Vector3::new(0.1, -0.2, 0.3), Vector3::new(f64::MIN_POSITIVE, -0.0, 1e300)];
        let (mut journal, before) = Journal::open(&path, false).unwrap();
        assert!(before.is_empty());
        commands.iter().for_each(|command| journal.add(command).unwrap());
        journal.file.write_all(&[1, 2, 3]).unwrap();
        let (mut journal, before) = Journal::open(&path, true).unwrap();
        assert_eq!(before, commands);
        journal.add(&commands[1]).unwrap();
        assert_eq!(Journal::open(&path, true).unwrap().1, [commands[0], commands[1], commands[1]]);
        assert!(Journal::open(&path, false).unwrap().1.is_empty());
    }
}
