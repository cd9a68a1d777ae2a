//! QoS profiles between DDS and bags.

use std::time::Duration;

use swath_ros::qos::{Durability, History, QosProfile as RosProfile, Reliability, SEND_TIMEOUT, WhenFull};

use crate::qos::{self, QosDuration, QosProfile};

/// A profile as bags store it.
pub(crate) fn to_bag(profile: &RosProfile) -> QosProfile {
    let (history, depth) = match profile.history {
        History::KeepLast { depth } => (qos::History::KeepLast, depth as u64),
        History::KeepAll => (qos::History::KeepAll, 0),
    };
    QosProfile {
        history,
        depth,
        reliability: match profile.reliability {
            Reliability::BestEffort => qos::Reliability::BestEffort,
            Reliability::Reliable { .. } => qos::Reliability::Reliable,
        },
        durability: match profile.durability {
            Durability::Volatile => qos::Durability::Volatile,
            Durability::TransientLocal => qos::Durability::TransientLocal,
        },
        deadline: duration(profile.deadline),
        lifespan: duration(profile.lifespan),
        ..QosProfile::reliable(0)
    }
}

/// A profile to write with; what DDS here does not know becomes the default.
pub(crate) fn to_ros(profile: &QosProfile) -> RosProfile {
    let reliability = match profile.reliability {
        qos::Reliability::BestEffort => Reliability::BestEffort,
        _ => Reliability::Reliable { when_full: WhenFull::Wait(SEND_TIMEOUT) },
    };
    let durability = match profile.durability {
        qos::Durability::TransientLocal => Durability::TransientLocal,
        _ => Durability::Volatile,
    };
    let depth = profile.depth.clamp(1, 1 << 20) as usize;
    RosProfile::publisher_default()
        .reliability(reliability)
        .durability(durability)
        .history(History::KeepLast { depth })
        .lifespan(limited(profile.lifespan))
}

/// A profile to read with: as reliable and as latched as every writer offers, so that all match.
pub(crate) fn to_read(offers: &[QosProfile], depth: usize) -> RosProfile {
    let all = |policy: fn(&QosProfile) -> bool| !offers.is_empty() && offers.iter().all(policy);
    let mut profile = RosProfile::subscription_default().history(History::KeepLast { depth });
    if all(|offer| offer.reliability == qos::Reliability::Reliable) {
        profile = profile.reliability_reliable(WhenFull::Wait(SEND_TIMEOUT));
    }
    if all(|offer| offer.durability == qos::Durability::TransientLocal) {
        profile = profile.durability(Durability::TransientLocal);
    }
    profile
}

fn duration(limit: Option<Duration>) -> QosDuration {
    limit.map_or(QosDuration::INFINITE, |d| QosDuration { sec: d.as_secs(), nsec: d.subsec_nanos().into() })
}

fn limited(duration: QosDuration) -> Option<Duration> {
    let whole = Duration::from_secs(duration.sec);
    (duration != QosDuration::INFINITE && duration != QosDuration { sec: 0, nsec: 0 })
        .then(|| whole.saturating_add(Duration::from_nanos(duration.nsec)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use swath_ros::qos::Profile;

    #[test]
    fn the_profiles_of_the_graph_survive_the_bag() {
        for profile in [Profile::State, Profile::Latched, Profile::Event, Profile::Clock, Profile::Log] {
            let stored = qos::from_yaml(&qos::to_yaml(&[to_bag(&profile.qos())]).unwrap()).unwrap();
            // How long a writer waits is its own affair: a bag does not tell it.
            let expected = profile.qos().reliability_reliable(WhenFull::Wait(SEND_TIMEOUT));
            assert_eq!(to_ros(&stored[0]), expected, "{profile:?}");
        }
    }

    #[test]
    fn a_reader_asks_for_no_more_than_every_writer_offers() {
        let reliable = |profile: &RosProfile| matches!(profile.reliability, Reliability::Reliable { .. });
        let both = to_read(&[QosProfile::latched(1), QosProfile::reliable(5)], 9);
        assert!(reliable(&both) && both.durability == Durability::Volatile);
        assert_eq!(to_read(&[QosProfile::latched(1)], 9).durability, Durability::TransientLocal);
        assert!(!reliable(&to_read(&[QosProfile::latched(1), QosProfile::best_effort(1)], 9)));
        assert!(!reliable(&to_read(&[], 9)));
    }
}
