//! What was asked for, by number, as far as it was looked up: it never changes.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use swath_msgs::swath_msgs as msg;

/// Requests as their submitters made them.
#[derive(Default)]
pub struct Asked(Mutex<BTreeMap<u64, msg::StripRequest>>);

impl Asked {
    /// Whether one of these is not known.
    #[must_use]
    pub fn lacks(&self, ids: &[u64]) -> bool {
        let known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        ids.iter().any(|id| !known.contains_key(id))
    }

    /// One that is known.
    #[must_use]
    pub fn of(&self, id: u64) -> Option<msg::StripRequest> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).get(&id).cloned()
    }

    /// Keeps some.
    pub fn learn(&self, requests: impl Iterator<Item = (u64, msg::StripRequest)>) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).extend(requests);
    }
}
