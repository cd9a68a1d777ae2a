//! Reads bags: what is in them, and their messages in order of time.

mod files;
mod messages;
mod select;
mod topic;

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;

pub(crate) use files::{Listing, metadata_path};
use mcap::records::Metadata;
pub use messages::{Message, Messages};
pub use select::{Filter, TopicPattern};
pub use topic::BagTopic;

use crate::error::{BagError, Result, chain};
use crate::file::attachment::Attachment;
use crate::file::index::FileIndex;
use crate::file::source::{ReadOptions, Source};
use crate::file::sqlite::is_sqlite;
use crate::file::storage::Storage;
use crate::losses::{Losses, RECORDING};
use crate::metadata::BagInformation;
use crate::qos::QosTexts;
use crate::topic::{Topic, TopicKey};

/// The metadata record in which rosbag2 repeats a file's information.
const ROSBAG2: &str = "rosbag2";

/// What one file of a bag holds.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BagFile {
    /// Where it is.
    pub path: PathBuf,
    /// Its size, unpacked if it is compressed as a whole [bytes].
    pub bytes: u64,
    /// `mcap` or `sqlite3`.
    pub storage: &'static str,
    /// MCAP profile, `ros2` in ROS 2 bags.
    pub profile: String,
    /// The program that wrote it.
    pub library: String,
    /// Messages in it.
    pub messages: u64,
    /// Earliest log time [ns]; 0 without messages.
    pub start: u64,
    /// Latest log time [ns]; 0 without messages.
    pub end: u64,
    /// Chunk compressions by MCAP name with the number of chunks.
    pub compressions: BTreeMap<String, u64>,
}

/// A bag open for reading: a directory with MCAP or SQLite files, or a single file.
#[derive(Debug)]
pub struct Bag {
    path: PathBuf,
    files: Vec<FileIndex>,
    topics: Vec<BagTopic>,
    /// By file, by channel id: index into `topics`.
    channels: Vec<BTreeMap<u16, usize>>,
    information: Option<BagInformation>,
    faults: Vec<String>,
}

impl Bag {
    /// Opens a bag and reads its index, not its messages.
    ///
    /// # Errors
    /// As [`open_all`](Self::open_all).
    pub fn open(path: &Path) -> Result<Self> {
        Self::open_all(&[path.to_owned()], ReadOptions::default())
    }

    /// Opens all bag files in a directory, whatever its `metadata.yaml` says.
    pub(crate) fn open_directory(dir: &Path, options: ReadOptions) -> Result<Self> {
        let mut bag = Self::empty(dir.to_owned());
        bag.open_files(&Listing::of_all_in(dir)?.files, options)?;
        Ok(bag)
    }

    /// Opens several bags as one. Files that cannot be read are left out and told by [`faults`](Self::faults), as long
    /// as one can.
    ///
    /// # Errors
    /// [`BagError::NotABag`] when there is no file, [`BagError::Corrupt`] when all are damaged or were not closed.
    pub fn open_all(paths: &[PathBuf], options: ReadOptions) -> Result<Self> {
        let mut bag = Self::empty(paths.first().cloned().unwrap_or_default());
        let mut files = Vec::new();
        for path in paths {
            let listing = Listing::of(path)?;
            check_compression(path, listing.information.as_ref())?;
            bag.faults.extend(listing.faults);
            let unlisted = listing.unlisted.iter().map(|f| format!("{} is not in the bag's list", f.display()));
            bag.faults.extend(unlisted);
            files.extend(listing.files);
            if let [_] = paths {
                bag.information = listing.information;
            }
        }
        bag.open_files(&files, options)?;
        Ok(bag)
    }

    fn open_files(&mut self, paths: &[PathBuf], options: ReadOptions) -> Result<()> {
        let mut files = Vec::new();
        let mut first_error = None;
        for path in paths {
            match open_file(path, options) {
                Ok(index) => files.push(index),
                Err(error) => {
                    self.faults.push(format!("not read: {}", chain(&error)));
                    first_error.get_or_insert(error);
                }
            }
        }
        match first_error {
            Some(error) if files.is_empty() => Err(error),
            _ => self.take_files(files),
        }
    }

    /// Opens an MCAP file whose bytes are in memory.
    ///
    /// # Errors
    /// [`BagError::Corrupt`] when it is damaged or has no end.
    pub fn from_bytes(bytes: impl Into<Arc<[u8]>>, options: ReadOptions) -> Result<Self> {
        let mut bag = Self::empty("memory".into());
        let index = FileIndex::open(Source::in_memory(&bag.path, bytes.into(), options))?;
        bag.take_files(vec![index])?;
        Ok(bag)
    }

    fn empty(path: PathBuf) -> Self {
        let (files, topics, channels) = (Vec::new(), Vec::new(), Vec::new());
        Self { path, files, topics, channels, information: None, faults: Vec::new() }
    }

    /// Puts files in order of time, and their topics together.
    fn take_files(&mut self, mut files: Vec<FileIndex>) -> Result<()> {
        files.sort_by_key(|file| (start_of(file).is_none(), start_of(file)));
        let (mut known, mut texts) = (HashMap::new(), QosTexts::default());
        let mut first_error = None;
        for file in files {
            if let Err(error) = self.add_file(file, &mut known, &mut texts) {
                self.faults.push(format!("not read: {}", chain(&error)));
                first_error.get_or_insert(error);
            }
        }
        if let (true, Some(error)) = (self.files.is_empty(), first_error) {
            return Err(error);
        }
        self.sort_topics();
        if self.information.is_none()
            && let [file] = &self.files[..]
        {
            self.information = embedded_information(&file.metadata);
        }
        Ok(())
    }

    fn add_file(&mut self, file: FileIndex, known: &mut HashMap<TopicKey, usize>, texts: &mut QosTexts) -> Result<()> {
        let topics = file.channels.iter().map(|(id, channel)| {
            let missing = || {
                let reason = format!("channel {} refers to no schema {}", channel.topic, channel.schema_id);
                file.storage.corrupt(file.storage.len(), reason)
            };
            let schema = match channel.schema_id {
                0 => None,
                schema => Some(file.schemas.get(&schema).ok_or_else(missing)?),
            };
            Ok((*id, Topic::of_channel(channel, schema, texts)))
        });
        let mut by_channel = BTreeMap::new();
        for (id, topic) in topics.collect::<Result<Vec<_>>>()? {
            let index = *known.entry(topic.key()).or_insert_with(|| {
                self.topics.push(BagTopic { topic, messages: 0 });
                self.topics.len() - 1
            });
            let counted = &mut self.topics[index].messages;
            *counted = counted.saturating_add(file.counts.get(&id).copied().unwrap_or(0));
            by_channel.insert(id, index);
        }
        self.channels.push(by_channel);
        self.files.push(file);
        Ok(())
    }

    /// Puts topics in order of name, so that nothing depends on the order of recording.
    fn sort_topics(&mut self) {
        let mut order: Vec<usize> = (0..self.topics.len()).collect();
        order.sort_by(|a, b| self.topics[*a].topic.name.cmp(&self.topics[*b].topic.name));
        let mut place = vec![0; order.len()];
        for (new, old) in order.iter().enumerate() {
            place[*old] = new;
        }
        self.topics = order.iter().map(|old| self.topics[*old].clone()).collect();
        for index in self.channels.iter_mut().flat_map(BTreeMap::values_mut) {
            *index = place[*index];
        }
    }

    /// The path as given to [`open`](Self::open).
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What of the bag could not be read: files that are missing or damaged, information that makes no sense.
    #[must_use]
    pub fn faults(&self) -> &[String] {
        &self.faults
    }

    /// Topics in order of name; messages refer to them by index.
    ///
    /// A name stands more than once where its type, schema or metadata differ.
    #[must_use]
    pub fn topics(&self) -> &[BagTopic] {
        &self.topics
    }

    /// The topics, to be changed on their way into another bag.
    pub(crate) fn topics_mut(&mut self) -> impl Iterator<Item = &mut Topic> {
        self.topics.iter_mut().map(|topic| &mut topic.topic)
    }

    /// Files in order of time.
    #[must_use]
    pub fn files(&self) -> Vec<BagFile> {
        let describe = |file: &FileIndex| BagFile {
            path: file.storage.path().to_owned(),
            bytes: file.storage.len(),
            storage: match &file.storage {
                Storage::Mcap(_) => "mcap",
                Storage::Sqlite(_) => "sqlite3",
            },
            profile: file.profile.clone(),
            library: file.library.clone(),
            messages: file.messages(),
            start: start_of(file).unwrap_or(0),
            end: file.chunks.iter().map(|c| c.end).max().unwrap_or(0),
            compressions: file.compressions.clone(),
        };
        self.files.iter().map(describe).collect()
    }

    /// The files' indexes.
    pub(crate) fn indexes(&self) -> &[FileIndex] {
        &self.files
    }

    /// Messages in all files.
    #[must_use]
    pub fn message_count(&self) -> u64 {
        self.topics.iter().fold(0, |sum, topic| sum.saturating_add(topic.messages))
    }

    /// Earliest and latest log time [ns]; `None` without messages.
    #[must_use]
    pub fn time_range(&self) -> Option<(u64, u64)> {
        let chunks = || self.files.iter().flat_map(|f| &f.chunks);
        Some((chunks().map(|c| c.start).min()?, chunks().map(|c| c.end).max()?))
    }

    /// The profile that all files have which have one; empty when they differ.
    #[must_use]
    pub fn profile(&self) -> &str {
        let mut profiles = self.files.iter().map(|file| file.profile.as_str()).filter(|profile| !profile.is_empty());
        let first = profiles.next().unwrap_or_default();
        if profiles.all(|profile| profile == first) { first } else { "" }
    }

    /// Metadata records of all files in order; what every file of a bag repeats counts once.
    #[must_use]
    pub fn metadata(&self) -> Vec<(String, BTreeMap<String, String>)> {
        distinct(self.files.iter().map(|file| &file.metadata[..]))
    }

    /// The first metadata record of a name.
    #[must_use]
    pub fn metadata_named(&self, name: &str) -> Option<&BTreeMap<String, String>> {
        let mut all = self.files.iter().flat_map(|f| &f.metadata);
        all.find(|m| m.name == name).map(|m| &m.metadata)
    }

    /// Attachments of all files.
    #[must_use]
    pub fn attachments(&self) -> Vec<Attachment> {
        let mut attachments = Vec::new();
        for file in &self.files {
            let Storage::Mcap(source) = &file.storage else { continue };
            attachments.extend(file.attachments.iter().map(|attachment| Attachment::of(source, attachment)));
        }
        attachments
    }

    /// Messages that were to be in the bag and are not, as its recording told.
    #[must_use]
    pub fn losses(&self) -> Losses {
        let mut losses = Losses::default();
        for (name, pairs) in self.metadata() {
            if name == RECORDING {
                losses.add(&Losses::from_metadata(&pairs));
            }
        }
        losses
    }

    /// `metadata.yaml`, or what a single file of rosbag2 says in its place, but for the topics: see [`topics`](Self::topics).
    #[must_use]
    pub fn information(&self) -> Option<&BagInformation> {
        self.information.as_ref()
    }
}

/// The metadata records of several files, those that a later one repeats once.
pub(crate) fn distinct<'a>(files: impl Iterator<Item = &'a [Metadata]>) -> Vec<(String, BTreeMap<String, String>)> {
    let mut records: Vec<&Metadata> = Vec::new();
    for file in files {
        let mut told = vec![false; records.len()];
        for metadata in file {
            match (0..told.len()).find(|n| !told[*n] && records[*n] == metadata) {
                Some(n) => told[n] = true,
                None => records.push(metadata),
            }
        }
    }
    records.into_iter().map(|metadata| (metadata.name.clone(), metadata.metadata.clone())).collect()
}

/// Opens one file of a bag, of whichever kind it is.
fn open_file(path: &Path, options: ReadOptions) -> Result<FileIndex> {
    match is_sqlite(path)? {
        true => FileIndex::open_sqlite(path, options),
        false => FileIndex::open(Source::open(path, options, None)?),
    }
}

/// Refuses a bag whose messages or files are compressed in a way that is not known.
fn check_compression(path: &Path, information: Option<&BagInformation>) -> Result<()> {
    let Some(information) = information else { return Ok(()) };
    let BagInformation { compression_mode: mode, compression_format: format, .. } = information;
    let none = |text: &str| text.is_empty() || text.eq_ignore_ascii_case("none");
    if none(mode) || none(format) || format.eq_ignore_ascii_case("zstd") {
        return Ok(());
    }
    let reason = format!("it is compressed with {format:?} in mode {mode:?}, only zstd is known");
    Err(BagError::NotABag { path: path.to_owned(), reason })
}

/// The information that rosbag2 puts into a file as it closes it.
fn embedded_information(metadata: &[Metadata]) -> Option<BagInformation> {
    let last = metadata.iter().rfind(|record| record.name == ROSBAG2)?;
    BagInformation::parse_embedded(last.metadata.get("serialized_metadata")?)
}

/// Earliest log time of a file with messages.
fn start_of(file: &FileIndex) -> Option<u64> {
    file.chunks.iter().map(|c| c.start).min()
}
