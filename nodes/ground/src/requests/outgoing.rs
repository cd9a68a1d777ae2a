//! What the request manager says once the journal is on disk.

use std::sync::Arc;

use swath_mission::requests::journal::Entry;
use swath_msgs::swath_msgs as msg;
use swath_ros::RequestId;

use super::store::Durability;

/// What goes out once a batch of the journal is written.
pub(super) enum Outgoing {
    /// The candidates of a task.
    Offer(Box<msg::UpcomingStrips>),
    /// How a task went, with its reward.
    Result(Box<msg::TaskResult>),
    /// What leaves by the radio.
    Radio(Box<msg::RadioSent>),
    /// Changes.
    News(Arc<Vec<Entry>>),
    /// How many requests stand where, when the mission is over.
    Summary,
    /// Answers of the services.
    Submitted(RequestId, msg::SubmitStripsResponse),
    Cancelled(RequestId, msg::CancelStripsResponse),
    Replaced(RequestId, msg::ReplaceStripResponse),
    Reviewed(RequestId, msg::ReviewStripsResponse),
    /// Questions that are answered from the store.
    Get(RequestId, msg::GetStripRequest),
    History(RequestId, msg::ListHistoryRequest),
}

impl Outgoing {
    /// Whether the satellite waits for it, and nobody else takes it for a promise.
    pub(super) fn is_of_flight(&self) -> bool {
        matches!(self, Self::Offer(_) | Self::Result(_) | Self::Radio(_) | Self::Summary)
    }

    /// Answers promise more than the mission's own bookkeeping.
    pub(super) fn durability(&self) -> Durability {
        match self {
            Self::Submitted(..) | Self::Cancelled(..) | Self::Replaced(..) | Self::Reviewed(..) => Durability::Machine,
            _ => Durability::Process,
        }
    }
}
