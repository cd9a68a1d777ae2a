//! A file inside a bag, beside the messages.

use std::sync::Arc;

use super::parts::AttachmentRef;
use super::source::Source;
use super::walk::Place;

/// A file that was put into a bag beside the messages.
#[derive(Debug, Clone)]
pub struct Attachment {
    /// Its name.
    pub name: String,
    /// Its media type.
    pub media_type: String,
    /// Time of recording [ns].
    pub log_time: u64,
    /// Time of its making [ns]; 0 when not known.
    pub create_time: u64,
    /// Length of its data [bytes].
    pub bytes: u64,
    pub(crate) source: Arc<Source>,
    pub(crate) place: Place,
}

impl Attachment {
    pub(crate) fn of(source: &Arc<Source>, found: &AttachmentRef) -> Self {
        Self {
            name: found.header.name.clone(),
            media_type: found.header.media_type.clone(),
            log_time: found.header.log_time,
            create_time: found.header.create_time,
            bytes: found.data_len,
            source: Arc::clone(source),
            place: found.place,
        }
    }
}
