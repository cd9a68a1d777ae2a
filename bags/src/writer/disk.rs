//! The writer's thread: files of a bag, their splitting, their end, and a full disk.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use mcap::records::Metadata;

use super::options::{BagOptions, BagSummary};
use super::queue::{Job, Shared};
use crate::error::{BagError, Result};
use crate::file::chunk::{Chunk, Compressor};
use crate::file::writer::{Disk, FileSummary, FileWriter, TopicIds};
use crate::losses::{Losses, RECORDING};
use crate::metadata::{self, BagInformation, FileInformation, Nanoseconds, SinceEpoch, TopicCount, TopicMetadata};
use crate::topic::Topic;

/// Opens the file that a path names; tests put limits on it.
pub(super) type OpenDisk = Box<dyn Fn(&Path) -> io::Result<Box<dyn Disk>> + Send>;

/// Opens a real, new file.
pub(super) fn open_file(path: &Path) -> io::Result<Box<dyn Disk>> {
    Ok(Box::new(File::create_new(path)?))
}

/// A finished file of the bag.
struct Finished {
    name: String,
    summary: FileSummary,
}

/// Everything that the thread owns.
pub(super) struct Storage {
    dir: PathBuf,
    name: String,
    /// Number of its first file: those before were written by others.
    first: usize,
    options: BagOptions,
    compressor: Compressor,
    open: OpenDisk,
    topics: Vec<(Arc<Topic>, TopicIds)>,
    metadata: Vec<Metadata>,
    file: FileWriter,
    finished: Vec<Finished>,
    /// Whether `file` still lacks its end.
    unfinished: bool,
    split: bool,
    /// Lost because they could not be stored.
    unsaved: u64,
    /// All losses, once the writer has ended.
    lost: Losses,
}

impl Storage {
    /// Starts file number `first` of the bag in the existing directory `dir`.
    pub(super) fn create(
        dir: &Path,
        first: usize,
        compressor: Compressor,
        options: BagOptions,
        open: OpenDisk,
    ) -> Result<Self> {
        let name = bag_name(dir);
        let path = dir.join(file_name(&name, first));
        let create = |disk| FileWriter::create(disk, &options.profile);
        let file = open(&path).and_then(create).map_err(BagError::io("create", &path))?;
        Ok(Self {
            dir: dir.to_owned(),
            name,
            first,
            options,
            compressor,
            open,
            topics: Vec::new(),
            metadata: Vec::new(),
            file,
            finished: Vec::new(),
            unfinished: true,
            split: false,
            unsaved: 0,
            lost: Losses::default(),
        })
    }

    /// Takes jobs until the writer closes or storing fails.
    pub(super) fn run(mut self, shared: &Shared) -> Result<BagSummary> {
        while let Some(job) = shared.next_job() {
            if let Err(error) = self.store(job, shared) {
                return self.stop(error, shared);
            }
        }
        self.lost = shared.lost();
        match self.finish_bag() {
            Ok(()) => Ok(self.bag_summary()),
            Err(error) => self.stop(error, shared),
        }
    }

    fn store(&mut self, job: Job, shared: &Shared) -> io::Result<()> {
        match job {
            Job::Topic(topic, ids) => {
                self.topics.push((Arc::clone(&topic), ids));
                self.file.add_topic(&topic, ids)
            }
            Job::Metadata(record) => {
                self.metadata.push(record.clone());
                self.file.add_metadata(&record)
            }
            Job::Attachment(attachment) => self.file.add_attachment(&attachment),
            Job::Split => {
                self.split = self.file.messages() > 0;
                Ok(())
            }
            Job::Chunk(chunk) => {
                let stored = self.store_chunk(&chunk);
                if stored.is_err() {
                    self.unsaved += chunk.messages;
                }
                shared.recycle(chunk);
                stored
            }
        }
    }

    fn store_chunk(&mut self, chunk: &Chunk) -> io::Result<()> {
        if self.options.full.iter().any(|&(from, until)| chunk.start < until && from <= chunk.end) {
            return Err(io::ErrorKind::StorageFull.into());
        }
        if std::mem::take(&mut self.split) {
            self.next_file()?;
        }
        self.file.add_chunk(chunk, &mut self.compressor)?;
        self.split = self.options.max_file_bytes.is_some_and(|max| self.file.len() >= max);
        Ok(())
    }

    /// Closes the current file and starts the next with all that is known so far.
    fn next_file(&mut self) -> io::Result<()> {
        self.finish_file()?;
        self.write_yaml()?;
        let path = self.dir.join(self.file_name());
        let opened = (self.open)(&path).and_then(|disk| {
            let mut file = FileWriter::create(disk, &self.options.profile)?;
            self.topics.iter().try_for_each(|(topic, ids)| file.add_topic(topic, *ids))?;
            self.metadata.iter().try_for_each(|record| file.add_metadata(record))?;
            Ok(file)
        });
        match opened {
            Ok(file) => {
                self.file = file;
                self.unfinished = true;
                Ok(())
            }
            Err(error) => {
                // The bag ends with the previous file; half a next one would spoil it.
                let _ = fs::remove_file(&path);
                Err(error)
            }
        }
    }

    /// The name of the file that is being written.
    fn file_name(&self) -> String {
        file_name(&self.name, self.first + self.finished.len())
    }

    fn finish_file(&mut self) -> io::Result<()> {
        let name = self.file_name();
        let summary = self.file.finish()?;
        self.unfinished = false;
        self.finished.push(Finished { name, summary });
        Ok(())
    }

    fn finish_bag(&mut self) -> io::Result<()> {
        self.file.add_metadata(&self.recording())?;
        self.finish_file()?;
        self.write_yaml()
    }

    /// After a failure: closes the bag as far as it goes and refuses further messages.
    fn stop(mut self, error: io::Error, shared: &Shared) -> Result<BagSummary> {
        let path = self.dir.join(self.file_name());
        self.unsaved += shared.drain();
        self.lost = shared.lost();
        let ended = if self.unfinished { self.finish_in_less_room() } else { self.write_yaml() };
        if ended.is_ok() && BagError::is_disk_full(&error) {
            let kept = self.bag_summary().messages;
            return Err(BagError::DiskFull { path, kept, lost: self.unsaved });
        }
        Err(BagError::io("write", &path)(error))
    }

    /// Takes chunks, at last the file, off the end until index, footer and `metadata.yaml` fit.
    fn finish_in_less_room(&mut self) -> io::Result<()> {
        loop {
            let finished = self.finished.len();
            let Err(error) = self.finish_bag() else {
                return Ok(());
            };
            self.finished.truncate(finished);
            match self.file.drop_last_chunk()? {
                Some(messages) => self.unsaved += messages,
                None if finished == 0 => return Err(error),
                None => {
                    // Not even an empty file fits: the bag ends with the one before.
                    let path = self.dir.join(self.file_name());
                    fs::remove_file(path)?;
                    return self.write_yaml();
                }
            }
        }
    }

    fn losses(&self) -> Losses {
        let mut losses = self.lost.clone();
        losses.unsaved += self.unsaved;
        losses
    }

    /// How the recording went, for the bag itself.
    fn recording(&self) -> Metadata {
        Metadata { name: RECORDING.to_owned(), metadata: self.losses().to_metadata() }
    }

    fn bag_summary(&self) -> BagSummary {
        let with_messages = || self.finished.iter().map(|f| &f.summary).filter(|s| s.messages > 0);
        let mut summary = BagSummary {
            messages: with_messages().map(|s| s.messages).sum(),
            lost: self.losses().total(),
            counts: BTreeMap::new(),
            files: self.finished.len(),
            bytes: self.finished.iter().map(|f| f.summary.bytes).sum(),
            start: with_messages().map(|s| s.start).min().unwrap_or(0),
            end: with_messages().map(|s| s.end).max().unwrap_or(0),
        };
        for (topic, ids) in &self.topics {
            let count = |f: &Finished| f.summary.counts.get(&ids.channel).copied().unwrap_or(0);
            *summary.counts.entry(topic.name.clone()).or_insert(0) += self.finished.iter().map(count).sum::<u64>();
        }
        summary
    }

    fn write_yaml(&self) -> io::Result<()> {
        match self.information().write(&self.dir) {
            Ok(()) => Ok(()),
            Err(BagError::Io { source, .. }) => Err(source),
            Err(error) => Err(io::Error::other(error)),
        }
    }

    /// Each topic once, although channels may differ in more than rosbag2 knows of.
    fn topic_counts(&self) -> Vec<TopicCount> {
        let mut places = BTreeMap::new();
        let mut topics: Vec<TopicCount> = Vec::new();
        for (topic, ids) in &self.topics {
            let count = |f: &Finished| f.summary.counts.get(&ids.channel).copied().unwrap_or(0);
            let message_count = self.finished.iter().map(count).sum::<u64>();
            let place = *places.entry((&topic.name, &topic.type_name)).or_insert(topics.len());
            if let Some(known) = topics.get_mut(place) {
                known.message_count += message_count;
                continue;
            }
            let topic_metadata = TopicMetadata {
                name: topic.name.clone(),
                type_name: topic.type_name.clone(),
                serialization_format: topic.message_encoding.clone(),
                offered_qos_profiles: topic.qos.clone(),
                type_description_hash: topic.type_hash().to_owned(),
            };
            topics.push(TopicCount { topic_metadata, message_count });
        }
        topics
    }

    fn information(&self) -> BagInformation {
        let summary = self.bag_summary();
        let mut custom_data = self.options.custom_data.clone();
        custom_data.insert("lost_messages".to_owned(), summary.lost.to_string());
        BagInformation {
            version: metadata::VERSION,
            storage_identifier: "mcap".to_owned(),
            duration: Nanoseconds { nanoseconds: summary.end - summary.start },
            starting_time: SinceEpoch { nanoseconds_since_epoch: summary.start },
            message_count: summary.messages,
            topics_with_message_count: self.topic_counts(),
            compression_format: String::new(),
            compression_mode: String::new(),
            relative_file_paths: self.finished.iter().map(|f| f.name.clone()).collect(),
            files: self.finished.iter().map(file_information).collect(),
            custom_data: Some(custom_data),
            ros_distro: self.options.ros_distro.clone(),
        }
    }
}

/// The name that a bag's files begin with.
pub(super) fn bag_name(dir: &Path) -> String {
    dir.file_name().map_or("bag".into(), |n| n.to_string_lossy().into_owned())
}

/// The name of a bag's file of a number.
pub(super) fn file_name(name: &str, number: usize) -> String {
    format!("{name}_{number}.mcap")
}

fn file_information(file: &Finished) -> FileInformation {
    FileInformation {
        path: file.name.clone(),
        starting_time: SinceEpoch { nanoseconds_since_epoch: file.summary.start },
        duration: Nanoseconds { nanoseconds: file.summary.end - file.summary.start },
        message_count: file.summary.messages,
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU64, Ordering};

    use super::*;
    use crate::qos::QosProfile;
    use crate::{Bag, BagWriter, Compression, Filter};

    /// A disk with room for so many bytes, shared by all its files.
    struct SmallDisk {
        file: File,
        len: u64,
        room: Arc<AtomicU64>,
    }

    impl Disk for SmallDisk {
        fn write_at(&mut self, offset: u64, bytes: &[u8]) -> io::Result<()> {
            assert_eq!(offset, self.len, "files only grow");
            let room = self.room.load(Ordering::Relaxed);
            let fits = (bytes.len() as u64).min(room);
            self.file.write_at(offset, &bytes[..fits as usize])?;
            self.len += fits;
            self.room.fetch_sub(fits, Ordering::Relaxed);
            match fits == bytes.len() as u64 {
                true => Ok(()),
                false => Err(io::ErrorKind::StorageFull.into()),
            }
        }

        fn truncate(&mut self, len: u64) -> io::Result<()> {
            self.room.fetch_add(self.len - len, Ordering::Relaxed);
            self.len = len;
            self.file.truncate(len)
        }
    }

    fn small_disk(room: u64) -> OpenDisk {
        let room = Arc::new(AtomicU64::new(room));
        Box::new(move |path| {
            let room = Arc::clone(&room);
            Ok(Box::new(SmallDisk { file: File::create_new(path)?, len: 0, room }))
        })
    }

    const MESSAGES: u64 = 400;

    /// Lost before they reached the writer.
    const LOST_BEFORE: u64 = 3;

    /// Records until the writer refuses; returns how many messages it accepted.
    fn record(dir: &Path, disk: OpenDisk) -> (u64, Result<BagSummary>) {
        let options = BagOptions {
            compression: Compression::None,
            chunk_bytes: 1000,
            max_file_bytes: Some(15_000),
            ..BagOptions::default()
        };
        let bag = BagWriter::create_on(dir, options, disk).unwrap();
        let qos = vec![QosProfile::reliable(1)];
        let topic = Topic::new("/x", "a/msg/B", "uint64 x\n", "", qos).unwrap();
        let topic = bag.add_topic(&topic).unwrap();
        bag.count_lost(topic, LOST_BEFORE);
        let payload = [0, 1, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8];
        let accepted = (0..MESSAGES).take_while(|&n| bag.write(topic, n, n, &payload).is_ok()).count();
        (accepted as u64, bag.close())
    }

    fn readable_messages(dir: &Path) -> u64 {
        let bag = Bag::open(dir).unwrap();
        let mut messages = bag.messages(&Filter::default()).unwrap();
        let mut n = 0;
        while let Some(message) = messages.next().unwrap() {
            assert_eq!(message.log_time, n);
            n += 1;
        }
        assert_eq!(bag.information().unwrap().message_count, n);
        n
    }

    #[test]
    fn a_full_disk_leaves_a_readable_bag_wherever_it_strikes() {
        let temp = tempfile::tempdir().unwrap();
        let whole = temp.path().join("whole");
        let size = record(&whole, Box::new(open_file)).1.unwrap().bytes;
        assert_eq!(readable_messages(&whole), MESSAGES);
        // Below this, not even an empty bag fits.
        for room in (2500..size + 200).step_by(97) {
            let dir = temp.path().join(room.to_string());
            let (accepted, ended) = record(&dir, small_disk(room));
            match ended {
                Ok(summary) => assert_eq!((summary.messages, summary.lost), (MESSAGES, LOST_BEFORE)),
                Err(BagError::DiskFull { kept, lost, .. }) => {
                    assert_eq!(readable_messages(&dir), kept, "room for {room} bytes");
                    assert_eq!(kept + lost, accepted, "room for {room} bytes");
                    assert!(kept < MESSAGES);
                }
                Err(error) => panic!("room for {room} bytes: {error}"),
            }
        }
    }

    #[test]
    fn a_disk_that_is_full_by_order_is_as_any_other_and_the_bag_goes_on_after_it() {
        let temp = tempfile::tempdir().unwrap();
        let dir = temp.path().join("ordered");
        let options = BagOptions {
            chunk_bytes: 1000,
            resume: true,
            full: vec![(200, 300)],
            compression: Compression::None,
            ..BagOptions::default()
        };
        let topic = Topic::new("/x", "a/msg/B", "uint64 x\n", "", vec![QosProfile::reliable(1)]).unwrap();
        let write = |times: std::ops::Range<u64>| {
            let bag = BagWriter::create(&dir, options.clone()).unwrap();
            let id = bag.add_topic(&topic).unwrap();
            let payload = [0, 1, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8];
            let accepted = times.take_while(|&n| bag.write(id, n, n, &payload).is_ok()).count();
            (accepted as u64, bag.close())
        };
        let (accepted, Err(BagError::DiskFull { kept, lost, .. })) = write(0..400) else { panic!("no room for 200") };
        assert!(kept < 200 && kept + lost == accepted, "{kept} of {accepted} are kept");
        assert!(matches!(write(250..400).1, Err(BagError::DiskFull { kept: 0, .. })));
        assert_eq!(write(300..400).1.unwrap().messages, 100);
        crate::ops::mend::mend(&dir, crate::file::source::ReadOptions::default()).unwrap();
        assert_eq!(Bag::open(&dir).unwrap().information().unwrap().message_count, kept + 100);
    }

    #[test]
    fn what_is_lost_is_told() {
        let temp = tempfile::tempdir().unwrap();
        let dir = temp.path().join("small");
        let (accepted, Err(BagError::DiskFull { kept, lost, .. })) = record(&dir, small_disk(8000)) else {
            panic!("the disk should be full")
        };
        let bag = Bag::open(&dir).unwrap();
        let told = bag.losses();
        assert_eq!(told.unsaved, lost);
        assert_eq!(kept + told.total(), accepted + LOST_BEFORE);
    }
}
