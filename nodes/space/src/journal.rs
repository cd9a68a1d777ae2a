//! What a node has taken in, in order, kept so that one that is started again is where the one before was, to the bit.

use std::fs::OpenOptions;
use std::io::{Read as _, Seek as _, SeekFrom};
use std::marker::PhantomData;
use std::path::Path;

use anyhow::{Context, Result};
use serde::Serialize;
use serde::de::DeserializeOwned;
use swath_node::patient::Appended;

/// Length of what stands before an entry: its own length and its checksum [B].
const HEAD: usize = 8;

/// A file to which each entry is added before anything that follows from it is said.
pub struct Journal<E> {
    file: Appended,
    entries: PhantomData<fn(E)>,
}

impl<E: Serialize + DeserializeOwned> Journal<E> {
    /// Opens the file of a node; `again` is whether there was one before. Returns what that one has taken in.
    ///
    /// # Errors
    /// When the file cannot be read or written.
    pub fn open(path: &Path, again: bool) -> Result<(Self, Vec<E>)> {
        let failed = || format!("cannot use {}", path.display());
        let open = OpenOptions::new().read(true).write(true).create(true).truncate(!again).open(path);
        let mut file = open.with_context(failed)?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).with_context(failed)?;
        let (mut taken, mut rest) = (Vec::new(), bytes.as_slice());
        while let Some((entry, after)) = first(rest) {
            taken.push(entry);
            rest = after;
        }
        // An entry that was written in part was not taken in.
        let whole = (bytes.len() - rest.len()) as u64;
        file.set_len(whole).with_context(failed)?;
        file.seek(SeekFrom::Start(whole)).with_context(failed)?;
        Ok((Self { file: Appended::new(file), entries: PhantomData }, taken))
    }

    /// Adds an entry. Where there is no room it waits for some: a node that is lost meanwhile is replaced by one that
    /// knows nothing of it.
    ///
    /// # Errors
    /// When it cannot be written for another reason.
    pub fn add(&mut self, entry: &E) -> Result<()> {
        let body = postcard::to_allocvec(entry)?;
        let mut bytes = Vec::with_capacity(HEAD + body.len());
        bytes.extend(u32::try_from(body.len())?.to_le_bytes());
        bytes.extend(crc32fast::hash(&body).to_le_bytes());
        bytes.extend(body);
        self.file.add(&bytes).map(|_| ()).context("cannot keep what was taken in")
    }
}

/// The first entry and what lies behind it; nothing where it is not whole.
fn first<E: DeserializeOwned>(bytes: &[u8]) -> Option<(E, &[u8])> {
    let (length, rest) = bytes.split_first_chunk::<4>()?;
    let (sum, rest) = rest.split_first_chunk::<4>()?;
    let (body, rest) = rest.split_at_checked(u32::from_le_bytes(*length) as usize)?;
    (crc32fast::hash(body) == u32::from_le_bytes(*sum)).then_some(())?;
    Some((postcard::from_bytes(body).ok()?, rest))
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    #[test]
    fn what_was_written_whole_is_read_again() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal");
        let entries = [(1_u64, "one".to_owned()), (u64::MAX, String::new())];
        let (mut journal, before) = Journal::open(&path, false).unwrap();
        assert_eq!(before, Vec::<(u64, String)>::new());
        entries.iter().for_each(|entry| journal.add(entry).unwrap());
        for torn in [&[7, 0, 0][..], &[1, 0, 0, 0, 9, 9, 9, 9, 5], &[255; 12]] {
            journal.file.add(torn).unwrap();
            let (again, before) = Journal::<(u64, String)>::open(&path, true).unwrap();
            assert_eq!(before, entries);
            journal = again;
        }
        journal.add(&entries[0]).unwrap();
        assert_eq!(Journal::<(u64, String)>::open(&path, true).unwrap().1.len(), 3);
        assert!(Journal::<(u64, String)>::open(&path, false).unwrap().1.is_empty());
    }

    #[test]
    fn commands_of_torque_come_back_to_the_bit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("spacecraft.commands");
        let commands = [Vector3::new(0.1, -0.2, 0.3), Vector3::new(f64::MIN_POSITIVE, -0.0, 1e300)];
        let mut journal = Journal::open(&path, false).unwrap().0;
        commands.iter().for_each(|command| journal.add(command).unwrap());
        let bits = |all: &[Vector3<f64>]| all.iter().flat_map(|it| it.iter().map(|x| x.to_bits())).collect::<Vec<_>>();
        assert_eq!(bits(&Journal::open(&path, true).unwrap().1), bits(&commands));
    }
}
