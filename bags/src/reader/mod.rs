//! Reads bags: what is in them, and their messages in order of time.

mod messages;
mod select;

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

pub use messages::{Message, Messages};
pub use select::{Filter, TopicPattern};

use crate::{
    error::{BagError, Result},
    file::{
        index::FileIndex,
        records::{Channel, Schema},
    },
    metadata::{self, BagInformation},
    qos, schema,
    topic::Topic,
    writer::{Losses, RECORDING},
};

/// A topic of an open bag.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BagTopic {
    /// Name, type, schema, QoS; the QoS is empty when its YAML is at fault.
    pub topic: Topic,
    /// The channel's metadata as stored.
    pub metadata: BTreeMap<String, String>,
    /// Messages in all files.
    pub messages: u64,
}

impl BagTopic {
    /// Parses the topic's schema.
    ///
    /// # Errors
    /// [`BagError::Schema`] when it is malformed.
    pub fn parse_schema(&self) -> Result<schema::Schema> {
        schema::Schema::parse(&self.topic.type_name, &self.topic.schema)
    }
}

/// What one file of a bag holds.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BagFile {
    /// Where it is.
    pub path: PathBuf,
    /// Its size [bytes].
    pub bytes: u64,
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

/// A bag open for reading: a directory with MCAP files, or a single MCAP file.
#[derive(Debug)]
pub struct Bag {
    path: PathBuf,
    files: Vec<FileIndex>,
    topics: Vec<BagTopic>,
    /// By file, by channel id: index into `topics`.
    channels: Vec<BTreeMap<u16, usize>>,
    information: Option<BagInformation>,
}

impl Bag {
    /// Opens a bag and reads its index, not its messages.
    ///
    /// # Errors
    /// [`BagError::NotABag`] when there is no MCAP file, [`BagError::Corrupt`] when one is damaged
    /// or was not closed.
    pub fn open(path: &Path) -> Result<Self> {
        Self::open_all(&[path.to_owned()])
    }

    /// Opens several bags as one.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn open_all(paths: &[PathBuf]) -> Result<Self> {
        let mut files = Vec::new();
        for path in paths {
            for file in mcap_files(path)? {
                files.push(FileIndex::open(&file)?);
            }
        }
        files.sort_by_key(|file| (start_of(file), file.source.path.clone()));
        let information = match paths {
            // Only the files count; validation tells what is wrong with `metadata.yaml`.
            [path] if path.is_dir() => BagInformation::read(path).ok().flatten(),
            _ => None,
        };
        let mut bag = Self {
            path: paths.first().cloned().unwrap_or_default(),
            files: Vec::new(),
            topics: Vec::new(),
            channels: Vec::new(),
            information,
        };
        for file in files {
            bag.add_file(file)?;
        }
        bag.sort_topics();
        Ok(bag)
    }

    fn add_file(&mut self, file: FileIndex) -> Result<()> {
        let mut by_channel = BTreeMap::new();
        let none = Schema::default();
        for (id, channel) in &file.channels {
            let schema = match channel.schema_id {
                0 => &none,
                schema => file.schemas.get(&schema).ok_or_else(|| {
                    let reason = format!("channel {} refers to no schema {schema}", channel.topic);
                    file.source.corrupt(file.source.len, reason)
                })?,
            };
            let topic = channel_topic(channel, schema);
            let index = self.topic_index(topic);
            let messages = &mut self.topics[index].messages;
            *messages = messages.saturating_add(file.counts.get(id).copied().unwrap_or(0));
            by_channel.insert(*id, index);
        }
        self.channels.push(by_channel);
        self.files.push(file);
        Ok(())
    }

    /// The place of a topic, which is added when it is new.
    fn topic_index(&mut self, topic: BagTopic) -> usize {
        let same = |known: &BagTopic| {
            known.topic.name == topic.topic.name
                && known.topic.type_name == topic.topic.type_name
                && known.topic.schema == topic.topic.schema
        };
        self.topics.iter().position(same).unwrap_or_else(|| {
            self.topics.push(topic);
            self.topics.len() - 1
        })
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
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Topics in order of name; messages refer to them by index.
    pub fn topics(&self) -> &[BagTopic] {
        &self.topics
    }

    /// Files in order of time.
    pub fn files(&self) -> Vec<BagFile> {
        let describe = |file: &FileIndex| BagFile {
            path: file.source.path.clone(),
            bytes: file.source.len,
            profile: file.profile.clone(),
            library: file.library.clone(),
            messages: file.messages(),
            start: start_of(file).unwrap_or(0),
            end: file.chunks.iter().map(|c| c.end).max().unwrap_or(0),
            compressions: file.compressions.clone(),
        };
        self.files.iter().map(describe).collect()
    }

    /// Messages in all files.
    pub fn message_count(&self) -> u64 {
        self.topics.iter().fold(0, |sum, topic| sum.saturating_add(topic.messages))
    }

    /// Earliest and latest log time [ns]; `None` without messages.
    pub fn time_range(&self) -> Option<(u64, u64)> {
        let chunks = || self.files.iter().flat_map(|f| &f.chunks);
        Some((chunks().map(|c| c.start).min()?, chunks().map(|c| c.end).max()?))
    }

    /// Metadata records of all files in order, each content once.
    pub fn metadata(&self) -> Vec<(String, BTreeMap<String, String>)> {
        let mut records = Vec::new();
        for metadata in self.files.iter().flat_map(|f| &f.metadata) {
            let record = (metadata.name.clone(), metadata.metadata.clone());
            if !records.contains(&record) {
                records.push(record);
            }
        }
        records
    }

    /// The first metadata record of a name.
    pub fn metadata_named(&self, name: &str) -> Option<&BTreeMap<String, String>> {
        let mut all = self.files.iter().flat_map(|f| &f.metadata);
        all.find(|m| m.name == name).map(|m| &m.metadata)
    }

    /// Messages that were to be in the bag and are not, as its recording told.
    pub fn losses(&self) -> Losses {
        let mut losses = Losses::default();
        for (name, pairs) in self.metadata() {
            if name == RECORDING {
                losses.add(&Losses::from_metadata(&pairs));
            }
        }
        losses
    }

    /// `metadata.yaml`, where there is one.
    pub fn information(&self) -> Option<&BagInformation> {
        self.information.as_ref()
    }

    /// The messages that a filter lets through, in order of log time, then of recording.
    ///
    /// # Errors
    /// [`BagError::Option`] when the filter names a topic that is not in the bag.
    pub fn messages(&self, filter: &Filter) -> Result<Messages<'_>> {
        Messages::new(self, filter)
    }
}

/// A channel and its schema as a topic, without messages yet.
pub(crate) fn channel_topic(channel: &Channel, schema: &Schema) -> BagTopic {
    let qos = channel.metadata.get("offered_qos_profiles").map_or("", String::as_str);
    BagTopic {
        topic: Topic {
            name: channel.topic.clone(),
            type_name: schema.name.clone(),
            schema: String::from_utf8_lossy(&schema.data).into_owned(),
            type_hash: channel.metadata.get("topic_type_hash").cloned().unwrap_or_default(),
            schema_encoding: schema.encoding.clone(),
            message_encoding: channel.message_encoding.clone(),
            qos: qos::from_yaml(qos).unwrap_or_default(),
            qos_yaml: qos.to_owned(),
        },
        metadata: channel.metadata.clone(),
        messages: 0,
    }
}

/// Earliest log time of a file with messages.
fn start_of(file: &FileIndex) -> Option<u64> {
    file.chunks.iter().map(|c| c.start).min()
}

/// The MCAP files that a path stands for, in order of name.
///
/// # Errors
/// [`BagError::NotABag`] when there is none.
pub(crate) fn mcap_files(path: &Path) -> Result<Vec<PathBuf>> {
    let not_a_bag = |reason: &str| BagError::NotABag { path: path.to_owned(), reason: reason.to_owned() };
    let kind = fs::metadata(path).map_err(BagError::io("open", path))?;
    if kind.is_file() {
        return Ok(vec![path.to_owned()]);
    }
    let entries = fs::read_dir(path).map_err(BagError::io("read", path))?;
    let mut files = Vec::new();
    for entry in entries {
        let file = entry.map_err(BagError::io("read", path))?.path();
        if file.extension().is_some_and(|e| e == "mcap") {
            files.push(file);
        }
    }
    if files.is_empty() {
        let hint = path.join(metadata::FILE_NAME);
        let storage = if hint.exists() { "its storage is not MCAP" } else { "it holds no .mcap file" };
        return Err(not_a_bag(storage));
    }
    files.sort();
    Ok(files)
}
