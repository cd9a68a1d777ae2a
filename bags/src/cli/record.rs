//! `record`: topics of a ROS 2 domain into a new bag.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{SystemTime, UNIX_EPOCH};

use chrono::DateTime;
use clap::Args;
use serde_json::{Value, json};
use swath_ros::RosArgs;

use super::common::{WITH_LOSS, overrides, print_json};
use super::copy::Shape;
use super::signals::shutdown_on_signals;
use crate::error::{BagError, Result};
use crate::file::chunk::Compression;
use crate::out::say;
use crate::preset::Preset;
use crate::reader::TopicPattern;
use crate::record::{RecordOptions, Recorder};
use crate::tap::{Discovery, Selection, TapClock};
use crate::writer::BagOptions;

/// The metadata record that tells of the mission: configuration, seed, planner, policy, revision.
pub const MANIFEST: &str = "swath_manifest";
/// Its entry that holds the manifest as it was given.
pub const MANIFEST_TEXT: &str = "manifest";

/// Exit code of a recorder that has no room left.
pub const NO_ROOM: u8 = 4;

/// Arguments of `record`.
#[derive(Debug, Args)]
#[command(after_help = "Example:
  swath-bag record -o out/bag --exclude '/rosout|/parameter_events' --max-bag-duration 5400

Prints {\"event\":\"ready\",…} when every subscription exists, and {\"event\":\"closed\",…} at the end.
Ctrl-C or SIGTERM closes the bag, which another signal does not disturb. Exits with 3 when messages were lost, with 4
when there is no room left: the bag is whole up to there, and --resume goes on with it.
Services: ~/pause, ~/resume, ~/toggle_paused, ~/is_paused, ~/split_bagfile, ~/snapshot, ~/stop.
Words after --ros-args are those of every ROS 2 program.")]
pub struct RecordArgs {
    /// Topics to record; all without this, --topics and --regex
    #[arg(value_name = "TOPIC")]
    named: Vec<String>,
    /// Topics to record
    #[arg(long, value_name = "TOPIC", num_args = 1..)]
    topics: Vec<String>,
    /// Record all topics, which is what happens without any named
    #[arg(short, long, visible_alias = "all-topics", conflicts_with_all = ["named", "topics", "regex"])]
    all: bool,
    /// Directory of the new bag; by default named after the time
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// Topics to record, by a regular expression for the whole name
    #[arg(short = 'e', long)]
    regex: Option<String>,
    /// Topics to leave out, by a regular expression for the whole name
    #[arg(short = 'x', long, visible_alias = "exclude-regex")]
    exclude: Option<String>,
    /// Topics to leave out: names, or regular expressions for whole names
    #[arg(long, value_name = "TOPIC", num_args = 1..)]
    exclude_topics: Vec<String>,
    /// Record hidden topics, too, which have a name with a part that begins with _
    #[arg(long)]
    include_hidden_topics: bool,
    /// Record only topics that are there at the start
    #[arg(long, conflicts_with = "graph_only")]
    no_discovery: bool,
    /// Record only topics of Swath's node graph, do not look for others
    #[arg(long)]
    graph_only: bool,
    /// Leave out the topics of missions in other namespaces
    #[arg(long)]
    own_mission_only: bool,
    /// Give messages the time of their coming instead of the simulated time that they carry
    #[arg(long)]
    wall_time: bool,
    /// Simulated time will be published: hold messages without a stamp until the first /clock
    #[arg(long, conflicts_with = "wall_time")]
    use_sim_time: bool,
    /// Messages that a subscription keeps while they wait to be stored
    #[arg(long, default_value_t = 16_384, value_parser = clap::value_parser!(u64).range(1..=1 << 20))]
    depth: u64,
    /// YAML file: by topic, what differs from the QoS with which it would be read
    #[arg(long, value_name = "FILE")]
    qos_profile_overrides_path: Option<PathBuf>,
    /// Start paused
    #[arg(long)]
    start_paused: bool,
    /// Go on with the bag, if it is there, in a new file; files that were not closed are saved when this one is
    #[arg(long)]
    resume: bool,
    /// Store nothing of these log times [ns], as if the disk were full; may be repeated
    #[arg(long, value_name = "FROM..UNTIL", value_parser = span)]
    full_disk: Vec<(u64, u64)>,
    /// Kind of files: mcap is the only one that is written
    #[arg(short, long, default_value = "mcap", value_parser = ["mcap"])]
    storage: String,
    /// What ros2 bag compresses: with file or message, chunks are compressed here, which every reader of MCAP reads
    #[arg(long, default_value = "none", value_parser = ["none", "file", "message"])]
    compression_mode: String,
    /// With which format: zstd or lz4
    #[arg(long, value_name = "FORMAT", value_parser = format)]
    compression_format: Option<Compression>,
    /// One of the presets of rosbag2's MCAP storage, in place of --compression and its level
    #[arg(long, value_name = "PRESET", conflicts_with_all = ["compression", "compression_level"])]
    storage_preset_profile: Option<Preset>,
    /// Keep messages in memory and store them when ~/snapshot is called
    #[arg(long)]
    snapshot_mode: bool,
    /// Memory for messages in snapshot mode [bytes]
    #[arg(long, default_value_t = 100 << 20, value_parser = clap::value_parser!(u64).range(1024..))]
    max_cache_size: u64,
    /// Pairs for metadata.yaml
    #[arg(long, value_name = "KEY=VALUE", value_parser = pair)]
    custom_data: Vec<(String, String)>,
    /// TOML or JSON file that tells of the mission; its text and entries go into the bag as metadata
    #[arg(long, value_name = "FILE")]
    manifest: Option<PathBuf>,
    /// More entries of that metadata
    #[arg(long, value_name = "KEY=VALUE", value_parser = pair, requires = "manifest")]
    manifest_data: Vec<(String, String)>,
    /// Node whose topics must be matched before the recorder is ready; may be repeated
    #[arg(long, value_name = "NODE")]
    expect: Vec<String>,
    #[command(flatten)]
    shape: Shape,
}

impl RecordArgs {
    pub(super) fn run(self, ros: &RosArgs) -> Result<ExitCode> {
        let recorder = match Recorder::start(self.options()?, ros) {
            Err(error) if error.is_no_room() => {
                say(&format!("error: {}", crate::error::chain(&error)));
                return Ok(ExitCode::from(NO_ROOM));
            }
            recorder => recorder?,
        };
        let shutdown = shutdown_on_signals(recorder.signal())?;
        let summary = recorder.run(&shutdown, |topics| {
            // The launcher waits for this line; without it, it gives up by itself.
            if let Err(error) = print_json(&json!({ "event": "ready", "topics": topics })) {
                tracing::warn!("{}", crate::error::chain(&error));
            }
        });
        let summary = match summary {
            Err(error) if error.is_no_room() => {
                say(&format!("error: {}", crate::error::chain(&error)));
                return Ok(ExitCode::from(NO_ROOM));
            }
            summary => summary?,
        };
        print_json(&json!({
            "event": "closed", "messages": summary.messages, "lost": summary.lost,
            "bytes": summary.bytes, "files": summary.files,
        }))?;
        if summary.lost > 0 {
            say(&format!("{} messages were lost", summary.lost));
            return Ok(ExitCode::from(WITH_LOSS));
        }
        Ok(ExitCode::SUCCESS)
    }

    fn options(self) -> Result<RecordOptions> {
        let shape = self.bag_options()?;
        let selection = self.selection()?;
        let metadata = match &self.manifest {
            Some(path) => {
                let mut entries = manifest(path)?;
                entries.extend(self.manifest_data);
                vec![(MANIFEST.to_owned(), entries)]
            }
            None => Vec::new(),
        };
        Ok(RecordOptions {
            output: self.output.unwrap_or_else(default_output),
            bag: BagOptions {
                snapshot_bytes: self.snapshot_mode.then_some(self.max_cache_size as usize),
                custom_data: self.custom_data.into_iter().collect(),
                resume: self.resume,
                full: self.full_disk,
                ..shape
            },
            selection,
            metadata,
            paused: self.start_paused,
        })
    }

    fn selection(&self) -> Result<Selection> {
        let names = self.named.iter().chain(&self.topics);
        let names: Vec<String> = names.map(|topic| format!("/{}", topic.trim_start_matches('/'))).collect();
        let topics = TopicPattern::new(&names, self.regex.as_deref(), self.exclude.as_deref())?;
        Ok(Selection {
            topics: topics.without(&self.exclude_topics)?,
            discovery: match (self.graph_only, self.no_discovery) {
                (true, _) => Discovery::Never,
                (false, true) => Discovery::AtStart,
                (false, false) => Discovery::Always,
            },
            hidden: self.include_hidden_topics,
            own_mission_only: self.own_mission_only,
            clock: match (self.wall_time, self.use_sim_time) {
                (true, _) => TapClock::Wall,
                (false, true) => TapClock::SimulatedLater,
                (false, false) => TapClock::Simulated,
            },
            depth: self.depth as usize,
            qos_overrides: overrides(self.qos_profile_overrides_path.as_deref())?,
            expected_nodes: self.expect.clone(),
        })
    }

    fn bag_options(&self) -> Result<BagOptions> {
        let mut options = self.shape.options();
        if let Some(preset) = self.storage_preset_profile {
            preset.apply(&mut options);
        }
        match (self.compression_mode.as_str(), self.compression_format) {
            ("none", Some(_)) => {
                let reason = "takes --compression-mode file or message".to_owned();
                Err(BagError::Option { option: "--compression-format", reason })
            }
            ("none", None) => Ok(options),
            (mode, format) => {
                options.compression = format.unwrap_or_default();
                let name = options.compression.mcap_name();
                say(&format!("--compression-mode {mode}: chunks are compressed with {name}, not each {mode}"));
                Ok(options)
            }
        }
    }
}

fn default_output() -> PathBuf {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    let now = DateTime::from_timestamp(now.as_secs().cast_signed(), 0).unwrap_or_default();
    now.format("rosbag2_%Y_%m_%d-%H_%M_%S").to_string().into()
}

/// A compression by its name; none is no format.
fn format(text: &str) -> Result<Compression, String> {
    match text {
        "zstd" => Ok(Compression::Zstd),
        "lz4" => Ok(Compression::Lz4),
        other => Err(format!("{other:?} is neither zstd nor lz4")),
    }
}

/// Times from the first one up to the second.
fn span(text: &str) -> Result<(u64, u64), String> {
    let refused = || format!("{text:?} is not FROM..UNTIL in nanoseconds");
    let (from, until) = text.split_once("..").ok_or_else(refused)?;
    let time = |text: &str| text.parse::<u64>().map_err(|_| refused());
    let (from, until) = (time(from)?, time(until)?);
    if from < until { Ok((from, until)) } else { Err(format!("{text:?} ends before it begins")) }
}

fn pair(text: &str) -> Result<(String, String), String> {
    let (key, value) = text.split_once('=').ok_or_else(|| format!("{text:?} is not KEY=VALUE"))?;
    Ok((key.to_owned(), value.to_owned()))
}

/// What a manifest tells: the entries of a JSON object or TOML table, and the whole text.
///
/// Entries that are no text are stored as JSON.
fn manifest(path: &Path) -> Result<BTreeMap<String, String>> {
    let text = fs::read_to_string(path).map_err(BagError::io("read", path))?;
    let refuse =
        |reason: String| BagError::Option { option: "--manifest", reason: format!("{}: {reason}", path.display()) };
    let table: BTreeMap<String, Value> = match path.extension().is_some_and(|e| e == "toml") {
        true => toml::from_str(&text).map_err(|e| refuse(e.to_string()))?,
        false => serde_json::from_str(&text).map_err(|e| refuse(e.to_string()))?,
    };
    let in_words = |value: Value| match value {
        Value::String(text) => text,
        other => other.to_string(),
    };
    let mut pairs: BTreeMap<String, String> = table.into_iter().map(|(key, value)| (key, in_words(value))).collect();
    pairs.insert(MANIFEST_TEXT.to_owned(), text);
    Ok(pairs)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_are_read_or_refused() {
        assert_eq!(span("5..18446744073709551615"), Ok((5, u64::MAX)));
        for wrong in ["5", "5..", "-1..5", "a..b", "5..5", "9..5"] {
            assert!(span(wrong).unwrap_err().contains(wrong), "{wrong}");
        }
    }

    #[test]
    fn manifests_are_toml_or_json() {
        let temp = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| {
            let path = temp.path().join(name);
            fs::write(&path, text).unwrap();
            manifest(&path)
        };
        let toml = write("mission.toml", "planner = \"fixed\"\nseed = 7\n[orbit]\naltitude = 5e5\n").unwrap();
        assert_eq!(toml["planner"], "fixed");
        assert_eq!(toml["seed"], "7");
        assert_eq!(toml["orbit"], "{\"altitude\":500000.0}");
        assert!(toml[MANIFEST_TEXT].starts_with("planner = "));
        assert_eq!(write("facts.json", "{\"seed\":7}").unwrap()["seed"], "7");
        assert!(write("mission.toml", "planner").unwrap_err().to_string().starts_with("--manifest: "));
    }
}
