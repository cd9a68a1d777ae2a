//! The last message of each latched channel, for clients that come later.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use foxglove::{ChannelId, PartialMetadata, RawChannel, SinkId};

/// The last message of each latched channel: who subscribes later gets it at once.
#[derive(Default)]
pub struct Kept(Mutex<HashMap<ChannelId, Last>>);

struct Last {
    channel: Arc<RawChannel>,
    log_time: u64,
    message: Vec<u8>,
}

impl Kept {
    fn keep(&self, channel: &Arc<RawChannel>, log_time: u64, message: &[u8]) {
        let last = Last { channel: Arc::clone(channel), log_time, message: message.to_vec() };
        self.0.lock().unwrap_or_else(PoisonError::into_inner).insert(channel.id(), last);
    }

    /// Sends the last message of a channel to one client, if there is one.
    pub fn send(&self, channel: ChannelId, client: Option<SinkId>) {
        if let Some(last) = self.0.lock().unwrap_or_else(PoisonError::into_inner).get(&channel) {
            last.channel.log_with_meta_to_sink(&last.message, PartialMetadata::with_log_time(last.log_time), client);
        }
    }

    /// Forgets everything, before another time is shown.
    pub fn forget(&self) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clear();
    }
}

/// Sends a message on a channel, and keeps it for those who come later.
pub fn send_latched(kept: &Kept, channel: &Arc<RawChannel>, log_time: u64, message: &[u8]) {
    kept.keep(channel, log_time, message);
    channel.log_with_meta(message, PartialMetadata::with_log_time(log_time));
}
