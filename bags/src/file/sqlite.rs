//! rosbag2's SQLite files (`.db3`), read as if they were files of chunks.

use std::collections::BTreeMap;
use std::fmt;
use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use mcap::records::{MessageHeader, op};
use rusqlite::{Connection, OpenFlags, params};
use tempfile::NamedTempFile;

use super::parts::{ChunkRef, Kind, Rows};
use super::record;
use super::source::{ReadOptions, is_packed, unpack_into};
use crate::error::{BagError, Result};

/// The first bytes of a SQLite file.
const MAGIC: &[u8; 16] = b"SQLite format 3\0";
/// The length of a SQLite file's header, below which there is no database [bytes].
const HEADER_LEN: u64 = 100;
/// Messages that are read in one go [bytes].
const CHUNK_BYTES: u64 = 1 << 20;

/// An opened SQLite file.
pub(crate) struct Sqlite {
    path: PathBuf,
    len: u64,
    limit: u64,
    connection: Mutex<Connection>,
    /// Channel ids by topic id.
    channels: BTreeMap<i64, u16>,
    /// What a file that is compressed as a whole was unpacked into.
    _unpacked: Option<NamedTempFile>,
}

impl fmt::Debug for Sqlite {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({} bytes)", self.path.display(), self.len)
    }
}

/// Whether a file is a SQLite file, by its content, or by its name when it is compressed as a whole.
pub(crate) fn is_sqlite(path: &Path) -> Result<bool> {
    if is_packed(path) {
        return Ok(path.with_extension("").extension().is_some_and(|extension| extension == "db3"));
    }
    let mut file = File::open(path).map_err(BagError::io("open", path))?;
    let len = file.metadata().map_err(BagError::io("read", path))?.len();
    let mut start = [0; MAGIC.len()];
    Ok(len >= HEADER_LEN && file.read_exact(&mut start).is_ok() && start == *MAGIC)
}

impl Sqlite {
    /// Opens a SQLite file and reads its small tables.
    ///
    /// # Errors
    /// [`BagError::Sqlite`] when the file is damaged or is none of rosbag2's.
    pub(super) fn open(path: &Path, options: ReadOptions) -> Result<(Self, Tables)> {
        let mut unpacked = None;
        if is_packed(path) {
            let mut to = NamedTempFile::new().map_err(BagError::io("make a temporary file to unpack", path))?;
            unpack_into(path, to.as_file_mut(), None)?;
            unpacked = Some(to);
        }
        let opened = unpacked.as_ref().map_or(path, |file| file.path());
        let failed = |source| BagError::Sqlite { path: path.to_owned(), source };
        let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
        let connection = Connection::open_with_flags(opened, flags).map_err(failed)?;
        let tables = Tables::read(&connection).map_err(failed)?;
        if tables.topics.len() >= usize::from(u16::MAX) {
            let reason = format!("{} topics, at most {} are read", tables.topics.len(), u16::MAX - 1);
            return Err(BagError::Corrupt { path: path.to_owned(), offset: 0, reason });
        }
        let channels = (0..).zip(tables.topics.keys()).map(|(channel, topic)| (*topic, channel)).collect();
        let len = fs::metadata(opened).map_err(BagError::io("read", path))?.len();
        let sqlite = Self {
            path: path.to_owned(),
            len,
            limit: options.limit(),
            connection: Mutex::new(connection),
            channels,
            _unpacked: unpacked,
        };
        Ok((sqlite, tables))
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    pub(crate) fn len(&self) -> u64 {
        self.len
    }

    pub(crate) fn limit(&self) -> u64 {
        self.limit
    }

    fn failed(&self, source: rusqlite::Error) -> BagError {
        BagError::Sqlite { path: self.path.clone(), source }
    }

    fn corrupt(&self, row: i64, reason: String) -> BagError {
        BagError::Corrupt { path: self.path.clone(), offset: row.unsigned_abs(), reason }
    }

    /// All messages in order of time, in runs that are read in one go, and the messages of each channel.
    pub(super) fn chunks(&self) -> Result<(Vec<ChunkRef>, BTreeMap<u16, u64>)> {
        let connection = self.connection.lock().unwrap_or_else(PoisonError::into_inner);
        let (mut chunks, mut counts): (Vec<ChunkRef>, _) = (Vec::new(), BTreeMap::new());
        let rows = "SELECT timestamp, id, topic_id, length(data) FROM messages ORDER BY timestamp, id";
        let mut rows = connection.prepare(rows).map_err(|e| self.failed(e))?;
        let mut rows = rows.query([]).map_err(|e| self.failed(e))?;
        while let Some(row) = rows.next().map_err(|e| self.failed(e))? {
            let get = || Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?));
            let (timestamp, id, topic, len): (i64, i64, i64, Option<i64>) = get().map_err(|e| self.failed(e))?;
            let len = len.unwrap_or(0).unsigned_abs();
            let at = (timestamp, id);
            let time = u64::try_from(timestamp)
                .map_err(|_| self.corrupt(id, format!("row {id}: timestamp {timestamp} is before 1970")))?;
            let unknown = || self.corrupt(id, format!("row {id}: message of unknown topic {topic}"));
            let channel = *self.channels.get(&topic).ok_or_else(unknown)?;
            *counts.entry(channel).or_insert(0) += 1;
            match chunks.last_mut().filter(|run| run.len < CHUNK_BYTES) {
                Some(run) => {
                    if let Kind::Rows(rows) = &mut run.kind {
                        rows.last = at;
                    }
                    run.end = time;
                    run.len += len;
                    if let Some(channels) = run.channels.as_mut().filter(|channels| !channels.contains(&channel)) {
                        channels.push(channel);
                    }
                }
                None => chunks.push(ChunkRef {
                    offset: chunks.len() as u64,
                    len,
                    start: time,
                    end: time,
                    kind: Kind::Rows(Rows { first: at, last: at }),
                    channels: Some(vec![channel]),
                }),
            }
        }
        Ok((chunks, counts))
    }

    /// Replaces `data` by a run of rows as MCAP's message records.
    pub(super) fn load(&self, rows: Rows, data: &mut Vec<u8>) -> Result<()> {
        let connection = self.connection.lock().unwrap_or_else(PoisonError::into_inner);
        data.clear();
        let query = "SELECT timestamp, id, topic_id, length(data), CASE WHEN length(data) <= ?5 THEN data END
            FROM messages WHERE timestamp BETWEEN ?1 AND ?3 AND (timestamp > ?1 OR id >= ?2) AND (timestamp < ?3 OR id <= ?4)
            ORDER BY timestamp, id";
        let mut query = connection.prepare_cached(query).map_err(|e| self.failed(e))?;
        let (first, last) = (rows.first, rows.last);
        let mut found = query
            .query(params![first.0, first.1, last.0, last.1, self.limit.cast_signed()])
            .map_err(|e| self.failed(e))?;
        while let Some(row) = found.next().map_err(|e| self.failed(e))? {
            let get = || Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?));
            let (timestamp, id, topic, len): (i64, i64, i64, Option<i64>) = get().map_err(|e| self.failed(e))?;
            let len = len.unwrap_or(0).unsigned_abs();
            if len > self.limit {
                let (path, offset) = (self.path.clone(), id.unsigned_abs());
                return Err(BagError::TooLarge { path, offset, what: "message", bytes: len, limit: self.limit });
            }
            let message = row.get_ref(4).and_then(|data| Ok(data.as_bytes_or_null()?));
            let message = message.map_err(|e| self.failed(e))?.unwrap_or_default();
            let (Some(channel), Ok(time)) = (self.channels.get(&topic), u64::try_from(timestamp)) else {
                return Err(self.corrupt(id, format!("row {id} has changed since the bag was opened")));
            };
            let header = MessageHeader { channel_id: *channel, sequence: 0, log_time: time, publish_time: time };
            record::put_with(data, op::MESSAGE, |out| {
                record::put_fields(out, &header);
                out.extend_from_slice(message);
            });
        }
        Ok(())
    }
}

/// A row of the table of topics.
pub(super) struct TopicRow {
    pub name: String,
    pub type_name: String,
    pub serialization_format: String,
    pub qos: String,
    pub type_hash: String,
}

/// The small tables.
pub(super) struct Tables {
    /// By topic id.
    pub topics: BTreeMap<i64, TopicRow>,
    /// Encoding and text by type.
    pub definitions: BTreeMap<String, (String, String)>,
    /// The bag's information as YAML.
    pub information: Option<String>,
}

impl Tables {
    fn read(connection: &Connection) -> rusqlite::Result<Self> {
        let has = |table: &str, column: &str| connection.column_exists(None, table, column);
        let or_empty =
            |column: &'static str| Ok::<_, rusqlite::Error>(if has("topics", column)? { column } else { "''" });
        let (qos, hash) = (or_empty("offered_qos_profiles")?, or_empty("type_description_hash")?);
        let query = format!("SELECT id, name, type, serialization_format, {qos}, {hash} FROM topics ORDER BY id");
        let mut topics = connection.prepare(&query)?;
        let topics = topics.query_map([], |row| {
            let topic = TopicRow {
                name: row.get(1)?,
                type_name: row.get(2)?,
                serialization_format: row.get(3)?,
                qos: row.get(4)?,
                type_hash: row.get(5)?,
            };
            Ok((row.get(0)?, topic))
        })?;
        let topics = topics.collect::<rusqlite::Result<_>>()?;
        let mut definitions = BTreeMap::new();
        if has("message_definitions", "encoded_message_definition")? {
            let query = "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions";
            let mut rows = connection.prepare(query)?;
            let rows = rows.query_map([], |row| Ok((row.get(0)?, (row.get(1)?, row.get(2)?))))?;
            definitions = rows.collect::<rusqlite::Result<_>>()?;
        }
        let mut information = None;
        if has("metadata", "metadata")? {
            let mut newest = connection.prepare("SELECT metadata FROM metadata ORDER BY id DESC LIMIT 1")?;
            information = newest.query_map([], |row| row.get(0))?.next().transpose()?;
        }
        Ok(Self { topics, definitions, information })
    }
}
