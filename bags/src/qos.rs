//! ROS 2 QoS profiles as bags store them: a YAML list in rosbag2's words.

use std::borrow::Cow;
use std::collections::HashMap;

use serde::{Deserialize, Serialize};

use crate::error::{BagError, Result};

/// A duration in rosbag2's split form; infinite is 9223372036 s and 854775807 ns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "RawDuration")]
pub struct QosDuration {
    /// Whole seconds.
    pub sec: u64,
    /// Nanoseconds.
    pub nsec: u64,
}

impl QosDuration {
    /// "No limit", `RMW_DURATION_INFINITE`.
    pub const INFINITE: Self = Self { sec: 9_223_372_036, nsec: 854_775_807 };
}

/// A duration as it stands in a bag.
#[derive(Deserialize)]
struct RawDuration {
    sec: u64,
    nsec: u64,
}

impl From<RawDuration> for QosDuration {
    /// "No limit" was another number for some middlewares before ROS 2 Galactic.
    fn from(raw: RawDuration) -> Self {
        match (raw.sec, raw.nsec) {
            (0x7fff_ffff, 0x7fff_ffff | 0xffff_ffff) => Self::INFINITE,
            (sec, nsec) => Self { sec, nsec },
        }
    }
}

/// Defines a policy as an enum that is written in rosbag2's words, and read from them or from the middleware's
/// numbers, which bags hold before version 9 of their information.
macro_rules! policy {
    ($(#[$doc:meta])* $name:ident { $($(#[$variant_doc:meta])* $variant:ident = $word:literal, $number:pat,)* }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
        #[serde(try_from = "RawPolicy")]
        pub enum $name {
            $($(#[$variant_doc])* #[serde(rename = $word)] $variant,)*
        }

        impl TryFrom<RawPolicy> for $name {
            type Error = String;

            fn try_from(raw: RawPolicy) -> Result<Self, String> {
                let known: &[&str] = &[$($word,)*];
                match &raw {
                    $(RawPolicy::Number($number) => Ok(Self::$variant),)*
                    $(RawPolicy::Word(word) if word.as_str() == $word => Ok(Self::$variant),)*
                    RawPolicy::Number(number) => Err(format!("{number} is the number of no such policy")),
                    RawPolicy::Word(word) => Err(format!("{word:?} is none of {}", known.join(", "))),
                }
            }
        }
    };
}

/// A policy as it stands in a bag.
#[derive(Deserialize)]
#[serde(untagged)]
enum RawPolicy {
    Number(u64),
    Word(String),
}

policy! {
    /// How many samples are kept.
    History {
        /// The middleware's default.
        SystemDefault = "system_default", 0,
        /// The last `depth` samples.
        KeepLast = "keep_last", 1,
        /// All samples.
        KeepAll = "keep_all", 2,
        /// Not known when recorded.
        Unknown = "unknown", 3,
    }
}

policy! {
    /// Whether lost samples are sent again.
    Reliability {
        /// The middleware's default.
        SystemDefault = "system_default", 0,
        /// Sent again until acknowledged.
        Reliable = "reliable", 1,
        /// Sent once.
        BestEffort = "best_effort", 2,
        /// Not known when recorded.
        Unknown = "unknown", 3,
        /// Matching the other side.
        BestAvailable = "best_available", 4,
    }
}

policy! {
    /// Whether late joiners receive earlier samples.
    Durability {
        /// The middleware's default.
        SystemDefault = "system_default", 0,
        /// Latched: late joiners receive the last `depth` samples.
        TransientLocal = "transient_local", 1,
        /// Late joiners receive nothing.
        Volatile = "volatile", 2,
        /// Not known when recorded.
        Unknown = "unknown", 3,
        /// Matching the other side.
        BestAvailable = "best_available", 4,
    }
}

policy! {
    /// How a writer shows that it is alive.
    Liveliness {
        /// The middleware's default.
        SystemDefault = "system_default", 0,
        /// By the middleware.
        Automatic = "automatic", 1,
        /// By the publisher's own calls; older middlewares knew it for a node as a whole, too.
        ManualByTopic = "manual_by_topic", 2 | 3,
        /// Not known when recorded.
        Unknown = "unknown", 4,
        /// Matching the other side.
        BestAvailable = "best_available", 5,
    }
}

/// One QoS profile, field for field and in the order of rosbag2.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct QosProfile {
    /// History policy.
    pub history: History,
    /// Samples kept under [`History::KeepLast`].
    pub depth: u64,
    /// Reliability policy.
    pub reliability: Reliability,
    /// Durability policy.
    pub durability: Durability,
    /// Longest time between samples.
    pub deadline: QosDuration,
    /// How long a sample stays valid.
    pub lifespan: QosDuration,
    /// Liveliness policy.
    pub liveliness: Liveliness,
    /// How long a writer counts as alive.
    pub liveliness_lease_duration: QosDuration,
    /// Whether the topic's name goes to DDS without ROS's prefix.
    pub avoid_ros_namespace_conventions: bool,
}

impl QosProfile {
    /// Reliable, volatile, keep last `depth`.
    #[must_use]
    pub const fn reliable(depth: u64) -> Self {
        Self {
            history: History::KeepLast,
            depth,
            reliability: Reliability::Reliable,
            durability: Durability::Volatile,
            deadline: QosDuration::INFINITE,
            lifespan: QosDuration::INFINITE,
            liveliness: Liveliness::Automatic,
            liveliness_lease_duration: QosDuration::INFINITE,
            avoid_ros_namespace_conventions: false,
        }
    }

    /// Reliable, transient local ("latched"), keep last `depth`.
    #[must_use]
    pub const fn latched(depth: u64) -> Self {
        Self { durability: Durability::TransientLocal, ..Self::reliable(depth) }
    }

    /// Best effort, volatile, keep last `depth`.
    #[must_use]
    pub const fn best_effort(depth: u64) -> Self {
        Self { reliability: Reliability::BestEffort, ..Self::reliable(depth) }
    }
}

/// What differs from a profile, in the words of rosbag2's override files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct QosOverride {
    /// History policy.
    pub history: Option<History>,
    /// Samples kept.
    pub depth: Option<u64>,
    /// Reliability policy.
    pub reliability: Option<Reliability>,
    /// Durability policy.
    pub durability: Option<Durability>,
    /// Longest time between samples.
    pub deadline: Option<QosDuration>,
    /// How long a sample stays valid.
    pub lifespan: Option<QosDuration>,
    /// Liveliness policy.
    pub liveliness: Option<Liveliness>,
    /// How long a writer counts as alive.
    pub liveliness_lease_duration: Option<QosDuration>,
    /// Whether the topic's name goes to DDS without ROS's prefix.
    pub avoid_ros_namespace_conventions: Option<bool>,
}

impl QosOverride {
    /// The profile with what is set here.
    #[must_use]
    pub fn apply(&self, to: QosProfile) -> QosProfile {
        QosProfile {
            history: self.history.unwrap_or(to.history),
            depth: self.depth.unwrap_or(to.depth),
            reliability: self.reliability.unwrap_or(to.reliability),
            durability: self.durability.unwrap_or(to.durability),
            deadline: self.deadline.unwrap_or(to.deadline),
            lifespan: self.lifespan.unwrap_or(to.lifespan),
            liveliness: self.liveliness.unwrap_or(to.liveliness),
            liveliness_lease_duration: self.liveliness_lease_duration.unwrap_or(to.liveliness_lease_duration),
            avoid_ros_namespace_conventions: self
                .avoid_ros_namespace_conventions
                .unwrap_or(to.avoid_ros_namespace_conventions),
        }
    }
}

/// A profile in a few words: what differs between most of them.
pub(crate) fn in_a_line(profile: &QosProfile) -> String {
    let word = |policy: Result<String, yaml_serde::Error>| policy.unwrap_or_default().trim_end().to_owned();
    let history = word(yaml_serde::to_string(&profile.history));
    let reliability = word(yaml_serde::to_string(&profile.reliability));
    let durability = word(yaml_serde::to_string(&profile.durability));
    format!("{history} {}, {reliability}, {durability}", profile.depth)
}

/// The YAML list of a channel's `offered_qos_profiles`; empty for no profile.
///
/// # Errors
/// [`BagError::Qos`] when a profile cannot be written as YAML.
pub fn to_yaml(profiles: &[QosProfile]) -> Result<String> {
    if profiles.is_empty() {
        return Ok(String::new());
    }
    yaml_serde::to_string(profiles).map_err(|e| BagError::Qos { reason: e.to_string() })
}

/// Parses what [`to_yaml`] writes, or the same with policies in numbers; an empty text is an empty list.
///
/// # Errors
/// [`BagError::Qos`] when the text is no list of profiles.
pub fn from_yaml(text: &str) -> Result<Vec<QosProfile>> {
    if text.trim().is_empty() {
        return Ok(Vec::new());
    }
    yaml_serde::from_str(text).map_err(|e| BagError::Qos { reason: e.to_string() })
}

/// Parses the texts of many topics, of which most are alike.
#[derive(Default)]
pub(crate) struct QosTexts {
    known: HashMap<String, Vec<QosProfile>>,
}

impl QosTexts {
    /// What a text says; nothing when it is at fault.
    pub(crate) fn parse(&mut self, text: &str) -> Vec<QosProfile> {
        if let Some(profiles) = self.known.get(text) {
            return profiles.clone();
        }
        let profiles = from_yaml(text).unwrap_or_default();
        self.known.insert(text.to_owned(), profiles.clone());
        profiles
    }
}

/// The text that a new bag holds for a text of another: the same, unless it has policies in numbers, which a bag of
/// version 9 must not have.
pub(crate) fn in_words(text: &str) -> Cow<'_, str> {
    let has_numbers = || {
        let lines = text.lines().filter_map(|line| line.trim_start_matches(['-', ' ']).split_once(':'));
        lines.filter(|(key, _)| *key == "history").any(|(_, value)| value.trim().parse::<u64>().is_ok())
    };
    if !has_numbers() {
        return text.into();
    }
    match from_yaml(text) {
        Ok(profiles) if !profiles.is_empty() => to_yaml(&profiles).unwrap_or_default().into(),
        _ => text.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn yaml_is_rosbag2_s() {
        let text = to_yaml(&[QosProfile::latched(1)]).unwrap();
        let expected = "\
- history: keep_last
  depth: 1
  reliability: reliable
  durability: transient_local
  deadline:
    sec: 9223372036
    nsec: 854775807
  lifespan:
    sec: 9223372036
    nsec: 854775807
  liveliness: automatic
  liveliness_lease_duration:
    sec: 9223372036
    nsec: 854775807
  avoid_ros_namespace_conventions: false
";
        assert_eq!(text, expected);
        assert_eq!(from_yaml(&text).unwrap(), [QosProfile::latched(1)]);
    }

    #[test]
    fn an_override_changes_what_it_names() {
        let change: QosOverride = yaml_serde::from_str("reliability: best_effort\ndepth: 3\n").unwrap();
        let expected = QosProfile { reliability: Reliability::BestEffort, depth: 3, ..QosProfile::latched(1) };
        assert_eq!(change.apply(QosProfile::latched(1)), expected);
        assert!(yaml_serde::from_str::<QosOverride>("reliabilty: best_effort").is_err());
    }

    #[test]
    fn numbers_of_older_bags_are_read_and_put_into_words() {
        let words = to_yaml(&[QosProfile::latched(7)]).unwrap();
        let numbers = words
            .replace("keep_last", "1")
            .replace("reliable", "1")
            .replace("transient_local", "1")
            .replace("automatic", "1")
            .replace("sec: 9223372036\n    nsec: 854775807", "sec: 2147483647\n    nsec: 4294967295");
        assert_eq!(from_yaml(&numbers).unwrap(), [QosProfile::latched(7)]);
        assert_eq!(in_words(&numbers), words);
        for text in [&words, "", "- history: 9\n", "nonsense"] {
            assert_eq!(in_words(text), text, "is left as it is");
        }
        let best_effort = numbers.replace("reliability: 1", "reliability: 2").replace("durability: 1", "durability: 2");
        assert_eq!(from_yaml(&best_effort).unwrap(), [QosProfile::best_effort(7)]);
    }

    #[test]
    fn nonsense_is_refused() {
        let error = from_yaml("- history: 9").unwrap_err().to_string();
        assert!(error.contains("9 is the number of no such policy"), "{error}");
        assert!(from_yaml("- history: sometimes").is_err());
        assert!(from_yaml("").unwrap().is_empty());
    }
}
