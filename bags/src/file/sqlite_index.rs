//! The index of rosbag2's SQLite files.

use std::path::Path;
use std::sync::Arc;

use mcap::records::{Channel, Metadata};

use super::index::FileIndex;
use super::parts::Schema;
use super::source::ReadOptions;
use super::sqlite::{Sqlite, Tables};
use super::storage::Storage;
use crate::error::Result;

impl FileIndex {
    /// Reads the index of a SQLite file.
    ///
    /// # Errors
    /// As [`Sqlite::open`].
    pub(crate) fn open_sqlite(path: &Path, options: ReadOptions) -> Result<Self> {
        let (sqlite, tables) = Sqlite::open(path, options)?;
        let (chunks, counts) = sqlite.chunks()?;
        let mut index = Self::empty(Storage::Sqlite(Arc::new(sqlite)));
        (index.chunks, index.counts) = (chunks, counts);
        index.profile = "ros2".to_owned();
        index.library = "rosbag2 sqlite3".to_owned();
        index.add_tables(tables);
        Ok(index)
    }

    fn add_tables(&mut self, tables: Tables) {
        for (channel, topic) in (0..).zip(tables.topics.into_values()) {
            let id = channel + 1;
            let known = tables.definitions.get(&topic.type_name).or_else(|| {
                // Services are defined once for their requests, responses and events.
                let (service, _) = topic.type_name.rsplit_once('_')?;
                tables.definitions.get(service)
            });
            let (encoding, data) = match (known, swath_msgs::Interface::find(&topic.type_name)) {
                (Some((encoding, text)), _) if !text.is_empty() => (encoding.as_str(), text.as_str()),
                (_, Some(ours)) => ("ros2msg", ours.schema),
                _ => ("", ""),
            };
            let (encoding, data) = (encoding.to_owned(), data.as_bytes().into());
            self.schemas.insert(id, Schema { name: topic.type_name, encoding, data });
            let metadata = [("offered_qos_profiles", topic.qos), ("topic_type_hash", topic.type_hash)];
            let metadata = metadata.into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
            let (topic, message_encoding) = (topic.name, topic.serialization_format);
            self.channels.insert(channel, Channel { id: channel, schema_id: id, topic, message_encoding, metadata });
        }
        if let Some(information) = tables.information {
            let metadata = [("serialized_metadata".to_owned(), information)].into();
            self.metadata.push(Metadata { name: "rosbag2".to_owned(), metadata });
        }
    }
}
