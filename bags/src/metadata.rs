//! `metadata.yaml` of a bag directory: rosbag2's bag information, read in versions 1 to 9, written in version 9.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use serde::{Deserialize, Deserializer, Serialize, de};
use yaml_serde::Value;

use crate::error::{BagError, Result};
use crate::qos::{self, QosProfile};

/// The name of the file in a bag directory.
pub const FILE_NAME: &str = "metadata.yaml";

/// The bag information version that is written, and the latest that is read.
pub const VERSION: u32 = 9;

/// A length of time [ns].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Nanoseconds {
    /// Length [ns].
    #[serde(deserialize_with = "not_negative")]
    pub nanoseconds: u64,
}

/// A point in time [ns since the epoch of the bag's clock].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct SinceEpoch {
    /// Time [ns].
    #[serde(deserialize_with = "not_negative")]
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
    /// `cdr`.
    pub serialization_format: String,
    /// What the publishers offered; a text before version 9, nothing before version 4.
    #[serde(default, deserialize_with = "profiles")]
    pub offered_qos_profiles: Vec<QosProfile>,
    /// `RIHS01_…`, or empty; since version 7.
    #[serde(default, deserialize_with = "or_default")]
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
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct BagInformation {
    /// 1 to 9.
    pub version: u32,
    /// `mcap` or `sqlite3`.
    pub storage_identifier: String,
    /// Latest minus earliest message time.
    pub duration: Nanoseconds,
    /// Time of the earliest message.
    pub starting_time: SinceEpoch,
    /// Messages in all files.
    pub message_count: u64,
    /// Topics with counts.
    pub topics_with_message_count: Vec<TopicCount>,
    /// `zstd` where messages or whole files are compressed; since version 3.
    #[serde(default, deserialize_with = "or_default")]
    pub compression_format: String,
    /// `MESSAGE`, `FILE`, or empty: chunks are compressed by MCAP itself.
    #[serde(default, deserialize_with = "or_default")]
    pub compression_mode: String,
    /// Files in order of time.
    pub relative_file_paths: Vec<String>,
    /// The same files with their times and counts; since version 5.
    #[serde(default, deserialize_with = "or_default")]
    pub files: Vec<FileInformation>,
    /// Free text pairs; since version 6.
    #[serde(default, deserialize_with = "texts")]
    pub custom_data: Option<BTreeMap<String, String>>,
    /// ROS distribution that recorded the bag; since version 8.
    #[serde(default, deserialize_with = "or_default")]
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

    /// Parses the information that an MCAP or SQLite file of rosbag2 holds itself, without topics.
    pub(crate) fn parse_embedded(text: &str) -> Option<Self> {
        let parsed = yaml_serde::from_str(&without_topics(text)).or_else(|_| yaml_serde::from_str(text)).ok()?;
        Some(Self { topics_with_message_count: Vec::new(), ..parsed })
    }

    /// Reads `<dir>/metadata.yaml`; `None` when there is no such file.
    ///
    /// # Errors
    /// [`BagError::Metadata`] when it is of a later version or of another shape.
    pub fn read(dir: &Path) -> Result<Option<Self>> {
        Self::read_by(dir, |text| yaml_serde::from_str(text))
    }

    /// As [`read`](Self::read), but without topics: those of tens of thousands take a second.
    pub(crate) fn read_without_topics(dir: &Path) -> Result<Option<Self>> {
        // What was left out may have been more than topics, or less.
        let parsed = Self::read_by(dir, |text| {
            yaml_serde::from_str(&without_topics(text)).or_else(|_| yaml_serde::from_str(text))
        })?;
        Ok(parsed.map(|information| Self { topics_with_message_count: Vec::new(), ..information }))
    }

    fn read_by(dir: &Path, parse: impl Fn(&str) -> yaml_serde::Result<Document>) -> Result<Option<Self>> {
        let path = dir.join(FILE_NAME);
        let text = match fs::read_to_string(&path) {
            Ok(text) => text,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(e) => return Err(BagError::io("read", &path)(e)),
        };
        let document = parse(&text).map_err(|e| BagError::Metadata { path: path.clone(), reason: e.to_string() })?;
        let information = document.rosbag2_bagfile_information;
        if !(1..=VERSION).contains(&information.version) {
            let reason = format!("version {} is outside 1 to {VERSION}", information.version);
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

/// The text with an empty list in place of the block of topics.
fn without_topics(text: &str) -> String {
    let mut kept = String::new();
    let mut block = None;
    for line in text.split_inclusive('\n') {
        let content = line.trim_start_matches(' ');
        let indent = line.len() - content.len();
        // An item of a list may stand as far to the left as the list's name.
        if block.is_some_and(|name| indent > name || indent == name && content.starts_with("- ")) {
            continue;
        }
        let is_topics = content.trim_end() == "topics_with_message_count:";
        block = is_topics.then_some(indent);
        kept.push_str(if is_topics { line.trim_end() } else { line });
        kept.push_str(if is_topics { " []\n" } else { "" });
    }
    kept
}

/// A time; one before the epoch, which a clock that was not set gives, counts as the epoch.
fn not_negative<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u64, D::Error> {
    match Value::deserialize(deserializer)? {
        Value::Number(number) => match (number.as_u64(), number.as_i64()) {
            (Some(time), _) => Ok(time),
            (None, Some(_)) => Ok(0),
            _ => Err(de::Error::custom(format!("{number} is no number of nanoseconds"))),
        },
        _ => Err(de::Error::custom("a number of nanoseconds is expected")),
    }
}

/// A value, or nothing, which YAML writes `~`.
fn or_default<'de, D: Deserializer<'de>, T: Deserialize<'de> + Default>(deserializer: D) -> Result<T, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or_default())
}

/// QoS profiles as a list or as the text of one; what is wrong with them is the topic's fault, not the bag's.
fn profiles<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<QosProfile>, D::Error> {
    Ok(match Value::deserialize(deserializer)? {
        Value::String(text) => qos::from_yaml(&text).unwrap_or_default(),
        list => yaml_serde::from_value(list).unwrap_or_default(),
    })
}

/// Pairs of texts; YAML takes some of them for numbers and the like.
fn texts<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<BTreeMap<String, String>>, D::Error> {
    let pairs: Option<BTreeMap<String, Value>> = Deserialize::deserialize(deserializer)?;
    let in_words = |value| match value {
        Value::String(text) => text,
        Value::Null => String::new(),
        other => yaml_serde::to_string(&other).unwrap_or_default().trim_end().to_owned(),
    };
    Ok(pairs.map(|pairs| pairs.into_iter().map(|(key, value)| (key, in_words(value))).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What versions 1 to 9 have in common, with one topic, and what a version adds.
    fn read(version: u32, topic: &str, rest: &str) -> Result<BagInformation> {
        let text = format!(
            "rosbag2_bagfile_information:
  version: {version}
  storage_identifier: sqlite3
  relative_file_paths: [a_0.db3]
  duration: {{nanoseconds: 5}}
  starting_time: {{nanoseconds_since_epoch: 7}}
  message_count: 3
  topics_with_message_count:
    - topic_metadata: {{name: /a, type: b/msg/C, serialization_format: cdr{topic}}}
      message_count: 3
{rest}"
        );
        let temp = tempfile::tempdir().unwrap();
        fs::write(temp.path().join(FILE_NAME), text).unwrap();
        let whole = BagInformation::read(temp.path()).map(Option::unwrap);
        let brief = BagInformation::read_without_topics(temp.path()).map(Option::unwrap);
        match (&whole, brief) {
            (Ok(whole), Ok(brief)) => {
                assert_eq!(brief, BagInformation { topics_with_message_count: vec![], ..whole.clone() });
            }
            (whole, brief) => assert_eq!(whole.as_ref().unwrap_err().to_string(), brief.unwrap_err().to_string()),
        }
        whole
    }

    #[test]
    fn every_version_is_read() {
        let oldest = read(1, "", "").unwrap();
        assert_eq!((oldest.version, oldest.message_count, oldest.starting_time.nanoseconds_since_epoch), (1, 3, 7));
        assert_eq!(oldest.topics_with_message_count[0].topic_metadata.offered_qos_profiles, []);
        let packed = "  compression_format: zstd\n  compression_mode: FILE\n";
        assert_eq!(read(3, "", packed).unwrap().compression_mode, "FILE");
        let numbers = qos::to_yaml(&[QosProfile::latched(1)]).unwrap();
        let numbers = numbers.replace("keep_last", "1").replace("transient_local", "1").replace("reliable", "1");
        let numbers = numbers.replace("automatic", "1").replace('\n', "\\n");
        let topic = format!(", offered_qos_profiles: \"{numbers}\", type_description_hash: RIHS01_x");
        let rest = "  custom_data: {vehicle: sat-7, number: 7}\n  ros_distro: iron\n";
        let iron = read(8, &topic, rest).unwrap();
        let metadata = &iron.topics_with_message_count[0].topic_metadata;
        assert_eq!(metadata.offered_qos_profiles, [QosProfile::latched(1)]);
        assert_eq!(metadata.type_description_hash, "RIHS01_x");
        assert_eq!(iron.ros_distro, "iron");
        let custom_data = iron.custom_data.unwrap();
        assert_eq!((custom_data["vehicle"].as_str(), custom_data["number"].as_str()), ("sat-7", "7"));
        let nothing = read(9, ", type_description_hash: ~", "  custom_data: ~\n  files: ~\n  ros_distro: ~\n").unwrap();
        assert_eq!((nothing.custom_data, nothing.ros_distro.as_str()), (None, ""));
    }

    #[test]
    fn topics_are_left_out_where_they_form_a_block() {
        let temp = tempfile::tempdir().unwrap();
        let topic_metadata = TopicMetadata {
            name: "/a".into(),
            type_name: "b/msg/C".into(),
            serialization_format: "cdr".into(),
            offered_qos_profiles: vec![QosProfile::reliable(1)],
            type_description_hash: String::new(),
        };
        let topics = vec![TopicCount { topic_metadata, message_count: 2 }; 2];
        let information = BagInformation {
            version: 9,
            topics_with_message_count: topics,
            ros_distro: "jazzy".into(),
            ..BagInformation::default()
        };
        let text = information.to_yaml(temp.path()).unwrap();
        let brief = BagInformation { topics_with_message_count: vec![], ..information };
        let commented = text.replacen("- topic_metadata", "# of a kind\n\n  - topic_metadata", 1);
        let behind = text.replacen("  - topic_metadata", "# far to the left\n  - topic_metadata", 1);
        let lines = text.replace('\n', "\r\n");
        for text in [text, commented, behind, lines] {
            fs::write(temp.path().join(FILE_NAME), &text).unwrap();
            assert_eq!(BagInformation::read_without_topics(temp.path()).unwrap().unwrap(), brief, "{text}");
        }
    }

    #[test]
    fn later_versions_are_refused_and_damaged_profiles_are_left_out() {
        let error = read(10, "", "").unwrap_err().to_string();
        assert!(error.ends_with("version 10 is outside 1 to 9"), "{error}");
        let damaged = read(9, ", offered_qos_profiles: [{history: nonsense}]", "").unwrap();
        assert_eq!(damaged.topics_with_message_count[0].topic_metadata.offered_qos_profiles, []);
    }
}
