//! The topic writers of other processes, as discovery shows them.

use rustdds::policy::{Durability as DdsDurability, Reliability as DdsReliability};
use rustdds::{DomainParticipant, Duration as DdsDuration, RTPSEntity as _};

use crate::qos::{Durability, QosProfile, SEND_TIMEOUT, WhenFull};

/// A topic writer of another process.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RemoteWriter {
    /// Fully qualified name of the topic.
    pub topic: String,
    /// Full name of its type, such as `std_msgs/msg/Header`.
    pub type_name: String,
    /// What it offers; DDS does not tell the history of others, so the depth is 1.
    pub qos: QosProfile,
}

/// The ROS topic writers that do not belong to this participant.
pub(crate) fn remote_writers(participant: &DomainParticipant) -> Vec<RemoteWriter> {
    let own = participant.guid().prefix;
    let remote = participant.discovered_writers().into_iter();
    let remote = remote.filter(|writer| writer.writer_proxy.remote_writer_guid.prefix != own);
    remote
        .filter_map(|writer| {
            let data = writer.publication_topic_data;
            let mut qos = QosProfile::subscription_default();
            if let Some(DdsReliability::Reliable { .. }) = data.reliability {
                qos = qos.reliability_reliable(WhenFull::Wait(SEND_TIMEOUT));
            }
            if !matches!(data.durability, None | Some(DdsDurability::Volatile)) {
                qos = qos.durability(Durability::TransientLocal);
            }
            if let Some(lifespan) = data.lifespan.filter(|it| it.duration != DdsDuration::INFINITE) {
                qos = qos.lifespan(Some(lifespan.duration.into()));
            }
            Some(RemoteWriter { topic: ros_topic(&data.topic_name)?, type_name: ros_type(&data.type_name)?, qos })
        })
        .collect()
}

/// The ROS name of a DDS topic; `None` if it is no ROS topic (but a service, or of another world).
fn ros_topic(dds_topic: &str) -> Option<String> {
    dds_topic.strip_prefix("rt").filter(|name| name.starts_with('/')).map(str::to_owned)
}

/// The ROS name of a DDS type such as `std_msgs::msg::dds_::Header_`.
fn ros_type(dds_type: &str) -> Option<String> {
    let parts: Vec<&str> = dds_type.split("::").collect();
    match parts[..] {
        [package, kind @ ("msg" | "srv" | "action"), "dds_", name] => {
            Some(format!("{package}/{kind}/{}", name.strip_suffix('_')?))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::names::{dds_topic, dds_type};

    #[test]
    fn names_come_back_from_their_dds_form() {
        assert_eq!(ros_topic(&dds_topic("/swath/state")).as_deref(), Some("/swath/state"));
        assert_eq!(ros_topic("rq/swath/spacecraft/get_parametersRequest"), None);
        assert_eq!(ros_topic("ros_discovery_info"), None);
        let header = "std_msgs/msg/Header";
        assert_eq!(ros_type(&dds_type(header).unwrap()).as_deref(), Some(header));
        assert_eq!(ros_type("Header"), None);
    }
}
