//! Which files a bag consists of: those that its information lists, or else those that lie there.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use crate::error::{BagError, Result, chain};
use crate::file::source::unpacked_name;
use crate::metadata::{self, BagInformation};

/// A bag's files, before any of them is opened.
#[derive(Debug, Default)]
pub(crate) struct Listing {
    /// The files, those first that are first in the list.
    pub files: Vec<PathBuf>,
    /// What the bag says of itself, without its topics.
    pub information: Option<BagInformation>,
    /// What is missing or cannot be understood.
    pub faults: Vec<String>,
    /// Files of the bag's directory that its list leaves out although they carry its name: a recording that was not
    /// closed has such.
    pub unlisted: Vec<PathBuf>,
}

impl Listing {
    /// Finds the files that a path stands for.
    ///
    /// # Errors
    /// [`BagError::NotABag`] when there is none, [`BagError::Io`] when the path cannot be read.
    pub(crate) fn of(path: &Path) -> Result<Self> {
        if fs::metadata(path).map_err(BagError::io("open", path))?.is_file() {
            return Ok(Self { files: vec![path.to_owned()], ..Self::default() });
        }
        let there = files_in(path)?;
        let mut listing = Self::default();
        match BagInformation::read_without_topics(path) {
            Ok(Some(information)) if !information.relative_file_paths.is_empty() => {
                listing.take_listed(path, &information, &there);
                if listing.files.is_empty() && !there.is_empty() {
                    listing.faults.push("every bag file beside the list is read".to_owned());
                    (listing.files, listing.unlisted) = (there, Vec::new());
                }
                listing.information = Some(information);
            }
            Ok(information) => (listing.files, listing.information) = (there, information),
            Err(error) => {
                let instead =
                    if there.is_empty() { "no bag file lies beside it" } else { "every bag file beside it is read" };
                listing.faults.push(format!("{}: {instead}", chain(&error)));
                listing.files = there;
            }
        }
        if listing.files.is_empty() {
            let faults = std::mem::take(&mut listing.faults);
            let reason = faults.into_iter().next().unwrap_or_else(|| "it holds no .mcap or .db3 file".to_owned());
            return Err(BagError::NotABag { path: path.to_owned(), reason });
        }
        Ok(listing)
    }

    /// All bag files in a directory.
    ///
    /// # Errors
    /// As [`of`](Self::of).
    pub(crate) fn of_all_in(dir: &Path) -> Result<Self> {
        let files = files_in(dir)?;
        if files.is_empty() {
            let reason = "it holds no .mcap or .db3 file".to_owned();
            return Err(BagError::NotABag { path: dir.to_owned(), reason });
        }
        Ok(Self { files, ..Self::default() })
    }

    fn take_listed(&mut self, dir: &Path, information: &BagInformation, there: &[PathBuf]) {
        // Up to version 3 the list began with the directory's name.
        let base = if information.version < 4 { dir.parent().unwrap_or(dir) } else { dir };
        for listed in &information.relative_file_paths {
            let file = base.join(listed);
            let beside = || dir.join(Path::new(listed).file_name().unwrap_or_default());
            match [file.clone(), beside()].into_iter().find(|file| file.is_file()) {
                Some(file) if self.files.contains(&file) => {}
                Some(file) => self.files.push(file),
                None => self.faults.push(format!("{} is missing, the bag's list has it", file.display())),
            }
        }
        let stems: BTreeSet<_> = information.relative_file_paths.iter().filter_map(|f| stem(Path::new(f))).collect();
        let is_unlisted = |file: &&PathBuf| {
            let listed = self.files.iter().any(|listed| listed.file_name() == file.file_name());
            !listed && stem(file).is_some_and(|stem| stems.contains(&stem))
        };
        self.unlisted = there.iter().filter(is_unlisted).cloned().collect();
    }
}

/// The bag files in a directory, by name, numbers in order of their value.
fn files_in(dir: &Path) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in fs::read_dir(dir).map_err(BagError::io("read", dir))? {
        let file = entry.map_err(BagError::io("read", dir))?.path();
        let extension = unpacked_name(&file).extension().map(|e| e.to_owned());
        if extension.is_some_and(|extension| extension == "mcap" || extension == "db3") {
            files.push(file);
        }
    }
    files.sort_by_key(|file| (stem(file), number(file), file.clone()));
    // A file that was unpacked beside its packed form is one file.
    let names: BTreeSet<PathBuf> = files.iter().cloned().collect();
    files.retain(|file| unpacked_name(file) == *file || !names.contains(&unpacked_name(file)));
    Ok(files)
}

/// `bag` of `bag_7.mcap`; `None` when the name ends with no number.
fn stem(file: &Path) -> Option<String> {
    split_name(file).map(|(stem, _)| stem)
}

/// 7 of `bag_7.mcap`.
fn number(file: &Path) -> Option<u64> {
    split_name(file).map(|(_, number)| number)
}

fn split_name(file: &Path) -> Option<(String, u64)> {
    let file = unpacked_name(file);
    let (stem, number) = file.file_stem()?.to_str()?.rsplit_once('_')?;
    Some((stem.to_owned(), number.parse().ok()?))
}

/// The bag's directory and metadata file, for errors.
pub(crate) fn metadata_path(dir: &Path) -> PathBuf {
    dir.join(metadata::FILE_NAME)
}
