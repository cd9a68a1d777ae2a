//! The named quality-of-service profiles, and what they are for.

use std::time::Duration;

pub use ros2_client::qos::{Durability, History, QosProfile, Reliability, WhenFull};
use rustdds::QosPolicies;
use rustdds::policy::Reliability as DdsReliability;

/// A quality-of-service profile of the node graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Profile {
    /// Each sample counts and the newest is acted on at once: the control loop.
    State,
    /// Each sample counts and is rare: tasks and decisions.
    Command,
    /// Each sample counts and many may come at once: strip events, diagnostics.
    Event,
    /// The last sample is kept for readers that come later.
    Latched,
    /// Simulated time: only the newest sample matters.
    Clock,
    /// Log lines, as ROS 2 has them.
    Log,
    /// Requests and responses of services.
    Service,
}

impl Profile {
    /// Name for diagrams and people.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::State => "state",
            Self::Command => "command",
            Self::Event => "event",
            Self::Latched => "latched",
            Self::Clock => "clock",
            Self::Log => "log",
            Self::Service => "service",
        }
    }

    /// Samples that a reader keeps until they are taken. One that comes on top pushes out the oldest.
    #[must_use]
    pub const fn depth(self) -> usize {
        match self {
            Self::State => 64,
            Self::Command => 16,
            Self::Event => 4096,
            Self::Latched => 1,
            Self::Clock => 64,
            Self::Log => 1000,
            Self::Service => 64,
        }
    }

    /// The profile as ROS 2 has it.
    #[must_use]
    pub const fn qos(self) -> QosProfile {
        let durability = match self {
            Self::Latched | Self::Log => Durability::TransientLocal,
            _ => Durability::Volatile,
        };
        let lifespan = match self {
            Self::Log => Some(Duration::from_secs(10)),
            _ => None,
        };
        QosProfile::publisher_default()
            .reliability_reliable(WhenFull::Wait(BLOCKING))
            .durability(durability)
            .history(History::KeepLast { depth: self.depth() })
            .lifespan(lifespan)
    }
}

/// How long a send waits at most for readers that lag thousands of samples behind.
pub const SEND_TIMEOUT: Duration = Duration::from_secs(5);

/// How long RustDDS waits at a time; then a node of a mission waits for these readers no longer.
const BLOCKING: Duration = Duration::from_secs(1);

/// The profile with another depth.
pub(crate) fn with_depth(qos: QosProfile, depth: usize) -> QosProfile {
    qos.history(History::KeepLast { depth })
}

pub(crate) fn policies(qos: &QosProfile) -> QosPolicies {
    QosPolicies::from(qos)
}

/// Whether an endpoint asks for, or offers, reliability.
pub(crate) fn is_reliable(policies: &QosPolicies) -> bool {
    matches!(policies.reliability(), Some(DdsReliability::Reliable { .. }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_profiles_lose_nothing() {
        for profile in [
            Profile::State,
            Profile::Command,
            Profile::Event,
            Profile::Latched,
            Profile::Clock,
            Profile::Log,
            Profile::Service,
        ] {
            let qos = profile.qos();
            assert!(matches!(qos.reliability, Reliability::Reliable { .. }), "{profile:?}");
            assert_eq!(qos.history, History::KeepLast { depth: profile.depth() });
        }
    }

    #[test]
    fn latched_topics_are_kept_for_late_readers() {
        assert_eq!(Profile::Latched.qos().durability, Durability::TransientLocal);
        assert_eq!(Profile::State.qos().durability, Durability::Volatile);
    }
}
