//! ROS 2 QoS profiles as bags store them: a YAML list in rosbag2's words.

use serde::{Deserialize, Serialize};

use crate::error::{BagError, Result};

/// A duration in rosbag2's split form; infinite is 9223372036 s and 854775807 ns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
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

/// How many samples are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum History {
    /// The middleware's default.
    SystemDefault,
    /// The last `depth` samples.
    KeepLast,
    /// All samples.
    KeepAll,
    /// Not known when recorded.
    Unknown,
}

/// Whether lost samples are sent again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Reliability {
    /// The middleware's default.
    SystemDefault,
    /// Sent again until acknowledged.
    Reliable,
    /// Sent once.
    BestEffort,
    /// Not known when recorded.
    Unknown,
    /// Matching the other side.
    BestAvailable,
}

/// Whether late joiners receive earlier samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Durability {
    /// The middleware's default.
    SystemDefault,
    /// Latched: late joiners receive the last `depth` samples.
    TransientLocal,
    /// Late joiners receive nothing.
    Volatile,
    /// Not known when recorded.
    Unknown,
    /// Matching the other side.
    BestAvailable,
}

/// How a writer shows that it is alive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Liveliness {
    /// The middleware's default.
    SystemDefault,
    /// By the middleware.
    Automatic,
    /// By the publisher's own calls.
    ManualByTopic,
    /// Not known when recorded.
    Unknown,
    /// Matching the other side.
    BestAvailable,
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
    pub const fn latched(depth: u64) -> Self {
        Self { durability: Durability::TransientLocal, ..Self::reliable(depth) }
    }

    /// Best effort, volatile, keep last `depth`.
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

/// The YAML list of a channel's `offered_qos_profiles`; empty for no profile.
pub fn to_yaml(profiles: &[QosProfile]) -> Result<String> {
    if profiles.is_empty() {
        return Ok(String::new());
    }
    yaml_serde::to_string(profiles).map_err(|e| BagError::Qos { reason: e.to_string() })
}

/// Parses what [`to_yaml`] writes; an empty text is an empty list.
///
/// # Errors
/// [`BagError::Qos`] when the text is no list of profiles.
pub fn from_yaml(text: &str) -> Result<Vec<QosProfile>> {
    if text.trim().is_empty() {
        return Ok(Vec::new());
    }
    yaml_serde::from_str(text).map_err(|e| BagError::Qos { reason: e.to_string() })
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
    fn nonsense_is_refused() {
        assert!(from_yaml("- history: sometimes").is_err());
        assert!(from_yaml("").unwrap().is_empty());
    }
}
