//! `metadata.yaml` of a bag directory: rosbag2's bag information, version 9.

use std::{collections::BTreeMap, fs, path::Path};

use serde::{Deserialize, Serialize};

use crate::{
    error::{BagError, Result},
    qos::QosProfile,
};

/// The name of the file in a bag directory.
pub const FILE_NAME: &str = "metadata.yaml";

/// The bag information version that is written.
pub const VERSION: u32 = 9;

/// A length of time [ns].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Nanoseconds {
    /// Length [ns].
    pub nanoseconds: u64,
}

/// A point in time [ns since the epoch of the bag's clock].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct SinceEpoch {
    /// Time [ns].
    pub nanoseconds_since_epoch: u64,
}

/// A topic of the bag.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct TopicMetadata {
    /// Full topic name.
    pub name: String,
    /// `pkg/msg/Type`.
    #[serde(rename = "type")]
    pub type_name: String,
    /// Always `cdr`.
    pub serialization_format: String,
    /// What the publishers offered.
    pub offered_qos_profiles: Vec<QosProfile>,
    /// `RIHS01_…`, or empty.
    pub type_description_hash: String,
}

/// A topic with its number of messages.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct TopicCount {
    /// The topic.
    pub topic_metadata: TopicMetadata,
    /// Messages in the whole bag.
    pub message_count: u64,
}

/// One file of the bag.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FileInformation {
    /// Path relative to the bag directory.
    pub path: String,
    /// Time of the earliest message.
    pub starting_time: SinceEpoch,
    /// Latest minus earliest message time.
    pub duration: Nanoseconds,
    /// Messages in this file.
    pub message_count: u64,
}

/// The content of `metadata.yaml`, field for field and in the order of rosbag2.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct BagInformation {
    /// 9.
    pub version: u32,
    /// `mcap`.
    pub storage_identifier: String,
    /// Latest minus earliest message time.
    pub duration: Nanoseconds,
    /// Time of the earliest message.
    pub starting_time: SinceEpoch,
    /// Messages in all files.
    pub message_count: u64,
    /// Topics with counts.
    pub topics_with_message_count: Vec<TopicCount>,
    /// Empty: chunks are compressed by MCAP itself.
    pub compression_format: String,
    /// Empty, see `compression_format`.
    pub compression_mode: String,
    /// Files in order of time.
    pub relative_file_paths: Vec<String>,
    /// The same files with their times and counts.
    pub files: Vec<FileInformation>,
    /// Free text pairs.
    pub custom_data: Option<BTreeMap<String, String>>,
    /// ROS distribution that the bag follows.
    pub ros_distro: String,
}

#[derive(Serialize, Deserialize)]
struct Document {
    rosbag2_bagfile_information: BagInformation,
}

impl BagInformation {
    /// The text of `metadata.yaml`.
    ///
    /// # Errors
    /// [`BagError::Metadata`] when the YAML writer fails.
    pub fn to_yaml(&self, path: &Path) -> Result<String> {
        let document = Document { rosbag2_bagfile_information: self.clone() };
        yaml_serde::to_string(&document)
            .map_err(|e| BagError::Metadata { path: path.to_owned(), reason: e.to_string() })
    }

    /// Reads `<dir>/metadata.yaml`; `None` when there is no such file.
    ///
    /// # Errors
    /// [`BagError::Metadata`] when it is of another version or shape.
    pub fn read(dir: &Path) -> Result<Option<Self>> {
        let path = dir.join(FILE_NAME);
        let text = match fs::read_to_string(&path) {
            Ok(text) => text,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(e) => return Err(BagError::io("read", &path)(e)),
        };
        let document: Document = yaml_serde::from_str(&text)
            .map_err(|e| BagError::Metadata { path: path.clone(), reason: e.to_string() })?;
        let information = document.rosbag2_bagfile_information;
        if information.version != VERSION {
            let reason = format!("version {} is not {VERSION}", information.version);
            return Err(BagError::Metadata { path, reason });
        }
        Ok(Some(information))
    }

    /// Writes `<dir>/metadata.yaml` whole or not at all.
    ///
    /// # Errors
    /// [`BagError::Io`] when the directory cannot be written.
    pub fn write(&self, dir: &Path) -> Result<()> {
        let path = dir.join(FILE_NAME);
        let partial = dir.join(".metadata.yaml.partial");
        let text = self.to_yaml(&path)?;
        let result = fs::write(&partial, text).and_then(|()| fs::rename(&partial, &path));
        result.map_err(|e| {
            // A half-written file would only be in the way.
            let _ = fs::remove_file(&partial);
            BagError::io("write", &path)(e)
        })
    }
}
