//! The request manager's store: an SQLite file with every request, every change and every attempt.

use std::path::{Path, PathBuf};
use std::time::Duration;

use rusqlite::backup::Backup;
use rusqlite::{Connection, ErrorCode, OpenFlags, OptionalExtension as _, Row, TransactionBehavior};
use swath_sim::time::Tick;
use swath_sim::world::strip::StripId;
use thiserror::Error;

use swath_node::stamp::Stamper;

use super::rows::{insert_attempt, insert_change, insert_request, outcome, read_request, tick, write_progress};
use swath_mission::file::Mission;
use swath_mission::requests::journal::{Attempt, Entry, InFlight, Progress};
use swath_mission::requests::lifecycle::State;
use swath_mission::requests::request::Stored;

/// Why a store cannot be used.
#[derive(Debug, Error)]
pub enum StoreError {
    /// SQLite cannot do what is asked.
    #[error("store {path}: {source}")]
    Sqlite {
        /// The file.
        path: PathBuf,
        /// Why.
        source: rusqlite::Error,
    },
    /// The file was written by a later version.
    #[error("store {path} has schema {found}, this program knows schemas up to {known}")]
    Schema {
        /// The file.
        path: PathBuf,
        /// Its schema.
        found: i64,
        /// The latest that is known.
        known: usize,
    },
    /// The file belongs to another mission.
    #[error("store {path} belongs to another mission: give another file, or fly the mission that it was made for")]
    OtherMission {
        /// The file.
        path: PathBuf,
    },
    /// The file does not tell which mission it belongs to.
    #[error("store {path} does not tell of its mission")]
    Untold {
        /// The file.
        path: PathBuf,
    },
    /// Another request manager has taken the file over.
    #[error("store {path}: another request manager has taken it over")]
    TakenOver {
        /// The file.
        path: PathBuf,
    },
    /// A value in the file makes no sense.
    #[error("store {path}: request {id} has {what}")]
    Value {
        /// The file.
        path: PathBuf,
        /// The request.
        id: u64,
        /// What is wrong.
        what: &'static str,
    },
}

impl StoreError {
    /// Whether there is no room where the file is.
    #[must_use]
    pub fn is_full(&self) -> bool {
        matches!(self, Self::Sqlite { source, .. } if source.sqlite_error_code() == Some(ErrorCode::DiskFull))
    }
}

/// Steps from each schema to the next; the first makes an empty file schema 1.
const MIGRATIONS: [&str; 4] = [
    include_str!("schema_1.sql"),
    include_str!("schema_2.sql"),
    include_str!("schema_3.sql"),
    include_str!("schema_4.sql"),
];
/// How long a connection waits for another one's lock.
const BUSY_TIMEOUT: Duration = Duration::from_secs(10);
/// Pages that are copied in one step.
const PAGES_AT_ONCE: i32 = 4096;

/// A connection to the store.
pub struct Store {
    connection: Connection,
    path: PathBuf,
    /// Number of this writer among all that the file has had; whoever opened it last writes it.
    writer: i64,
}

/// Everything that a request manager takes up again.
#[derive(Debug)]
pub struct Snapshot {
    /// Whether the strips known from the start have been taken.
    pub begun: bool,
    /// Requests in the order of their numbers.
    pub requests: Vec<Stored>,
    /// Requests that were refused at once.
    pub rejected: usize,
    /// How far the mission has come.
    pub progress: Progress,
    /// The imaging task that was settled last, with its reward.
    pub last_settled: Option<(u64, f64)>,
}

/// A change as the audit trail has it.
#[derive(Clone, Debug, PartialEq)]
pub struct HistoryLine {
    /// Number in the trail, from 1.
    pub sequence: u64,
    /// The request; 0 for one that was refused.
    pub id: StripId,
    /// Submitter's own reference.
    pub client_ref: String,
    /// Name for people.
    pub name: String,
    /// When.
    pub tick: Tick,
    /// State that it got.
    pub state: State,
    /// Reason code and text.
    pub reason: (u16, String),
    /// Who made the change.
    pub actor: String,
}

/// When a transaction counts as written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Durability {
    /// When it survives the end of this process.
    Process,
    /// When it survives the end of this machine.
    Machine,
}

impl Store {
    /// Opens a store for writing, or makes it; a file of an earlier schema is brought up to date. `mission` tells
    /// missions apart. From then on whoever opened it before cannot write it any more.
    ///
    /// # Errors
    /// When the file cannot be used, comes from a later version, or belongs to another mission.
    pub fn open(path: &Path, mission: &str) -> Result<Self, StoreError> {
        let mut store = Self::connect(path, OpenFlags::default())?;
        store.migrate()?;
        store.run("PRAGMA journal_mode=WAL; PRAGMA wal_autocheckpoint=2000; PRAGMA foreign_keys=ON;")?;
        let sql = |source| store.error(source);
        let known: Option<String> = store.setting("mission")?;
        match known {
            Some(known) if known != mission => return Err(StoreError::OtherMission { path: path.to_owned() }),
            Some(_) => {}
            None => {
                let insert = "INSERT INTO settings (key, value) VALUES ('mission', ?1)";
                store.connection.execute(insert, [mission]).map_err(sql)?;
            }
        }
        let claim = "INSERT INTO settings (key, value) VALUES ('writer', '1')
            ON CONFLICT (key) DO UPDATE SET value = CAST(value AS INTEGER) + 1 RETURNING CAST(value AS INTEGER)";
        store.writer = store.connection.query_row(claim, [], |row| row.get(0)).map_err(sql)?;
        Ok(store)
    }

    /// Opens a store that exists for reading. One of an earlier schema stays as it is: a copy of it in memory is brought
    /// up to date.
    ///
    /// # Errors
    /// When the file is not there, cannot be used, or comes from a later version.
    pub fn open_read_only(path: &Path) -> Result<Self, StoreError> {
        let mut store = Self::connect(path, OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX)?;
        if store.schema()? != MIGRATIONS.len() as i64 {
            let sql = |source| StoreError::Sqlite { path: path.to_owned(), source };
            let mut copy = Connection::open_in_memory().map_err(sql)?;
            let backup = Backup::new(&store.connection, &mut copy).map_err(sql)?;
            backup.run_to_completion(PAGES_AT_ONCE, Duration::ZERO, None).map_err(sql)?;
            drop(backup);
            store.connection = copy;
            store.migrate()?;
        }
        Ok(store)
    }

    fn connect(path: &Path, flags: OpenFlags) -> Result<Self, StoreError> {
        let error = |source| StoreError::Sqlite { path: path.to_owned(), source };
        let connection = Connection::open_with_flags(path, flags).map_err(error)?;
        connection.busy_timeout(BUSY_TIMEOUT).map_err(error)?;
        connection.set_prepared_statement_cache_capacity(32);
        Ok(Self { connection, path: path.to_owned(), writer: 0 })
    }

    /// Where the file is.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    fn migrate(&self) -> Result<(), StoreError> {
        let found = self.schema()?;
        let known = MIGRATIONS.len();
        let begin = usize::try_from(found).ok().filter(|&begin| begin <= known);
        let begin = begin.ok_or(StoreError::Schema { path: self.path.clone(), found, known })?;
        for (number, step) in (begin + 1..).zip(&MIGRATIONS[begin..]) {
            self.run(&format!("BEGIN IMMEDIATE; {step} PRAGMA user_version={number}; COMMIT;"))?;
        }
        Ok(())
    }

    fn schema(&self) -> Result<i64, StoreError> {
        self.connection.query_row("PRAGMA user_version", [], |row| row.get(0)).map_err(|source| self.error(source))
    }

    fn run(&self, sql: &str) -> Result<(), StoreError> {
        self.connection.execute_batch(sql).map_err(|source| self.error(source))
    }

    fn error(&self, source: rusqlite::Error) -> StoreError {
        StoreError::Sqlite { path: self.path.clone(), source }
    }

    /// How many pages the file may have.
    #[cfg(test)]
    pub(super) fn set_pages_max(&self, pages: u32) -> Result<(), StoreError> {
        self.connection.pragma_update(None, "max_page_count", pages).map_err(|source| self.error(source))
    }

    /// What SQLite says where there is no room.
    pub(super) fn full(&self) -> StoreError {
        let full = rusqlite::ffi::Error::new(rusqlite::ffi::SQLITE_FULL);
        self.error(rusqlite::Error::SqliteFailure(full, Some("no room, by order".to_owned())))
    }

    fn setting(&self, key: &str) -> Result<Option<String>, StoreError> {
        let select = "SELECT value FROM settings WHERE key = ?1";
        self.connection.query_row(select, [key], |row| row.get(0)).optional().map_err(|source| self.error(source))
    }

    /// Writes lines of the journal and the progress in one transaction. From then on the strips known from the start
    /// count as taken.
    ///
    /// # Errors
    /// When they cannot be written, or another one has opened the store for writing since; then none of them is.
    pub fn write<'a>(
        &mut self,
        entries: impl Iterator<Item = &'a Entry>,
        progress: &Progress,
        durability: Durability,
    ) -> Result<(), StoreError> {
        let path = self.path.clone();
        match self.write_transaction(entries, progress, durability) {
            Ok(true) => Ok(()),
            Ok(false) => Err(StoreError::TakenOver { path }),
            Err(source) => Err(StoreError::Sqlite { path, source }),
        }
    }

    /// Whether it was written: it is not once another one writes here.
    fn write_transaction<'a>(
        &mut self,
        entries: impl Iterator<Item = &'a Entry>,
        progress: &Progress,
        durability: Durability,
    ) -> rusqlite::Result<bool> {
        self.connection.pragma_update(
            None,
            "synchronous",
            match durability {
                Durability::Process => "NORMAL",
                Durability::Machine => "FULL",
            },
        )?;
        let transaction = self.connection.transaction_with_behavior(TransactionBehavior::Immediate)?;
        let writer = "SELECT CAST(value AS INTEGER) FROM settings WHERE key = 'writer'";
        if transaction.query_row(writer, [], |row| row.get::<_, i64>(0))? != self.writer {
            return Ok(false);
        }
        for entry in entries {
            match entry {
                Entry::Added(added) => insert_request(&transaction, added)?,
                Entry::Changed(change) => insert_change(&transaction, change)?,
                Entry::Attempted(attempt) => insert_attempt(&transaction, attempt)?,
                // The changes that follow from it tell of it here.
                Entry::Taken(_) => {}
                Entry::Told(input) => {
                    transaction.prepare_cached("INSERT INTO told (input) VALUES (?1)")?.execute([input])?;
                }
            }
        }
        write_progress(&transaction, progress)?;
        transaction.commit()?;
        Ok(true)
    }

    /// Reads everything that a request manager takes up again.
    ///
    /// # Errors
    /// When the file cannot be read or makes no sense.
    pub fn snapshot(&self) -> Result<Snapshot, StoreError> {
        let sql = |source| self.error(source);
        let mut statement = self.connection.prepare("SELECT * FROM requests ORDER BY id").map_err(sql)?;
        let mut rows = statement.query([]).map_err(sql)?;
        let mut requests = Vec::new();
        while let Some(row) = rows.next().map_err(sql)? {
            let (id, stored) = read_request(row).map_err(sql)?;
            let wrong = |what| StoreError::Value { path: self.path.clone(), id, what };
            let stored = stored.ok_or_else(|| wrong("a state or a window that makes no sense"))?;
            requests.push(stored);
            if requests.len() as u64 != id {
                return Err(wrong("a number out of order"));
            }
        }
        let progress = self.progress().map_err(sql)?;
        let refused = "SELECT COUNT(*) FROM changes WHERE request = 0";
        let rejected: i64 = self.connection.query_row(refused, [], |row| row.get(0)).map_err(sql)?;
        Ok(Snapshot {
            begun: progress.is_some(),
            requests,
            rejected: usize::try_from(rejected).unwrap_or(0),
            progress: progress.unwrap_or_default(),
            last_settled: self.last_settled().map_err(sql)?,
        })
    }

    /// What the ground's end of the radio was told, in order.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn told(&self) -> Result<Vec<Vec<u8>>, StoreError> {
        let sql = |source| self.error(source);
        let mut statement = self.connection.prepare("SELECT input FROM told ORDER BY sequence").map_err(sql)?;
        let inputs = statement.query_map([], |row| row.get(0)).map_err(sql)?;
        inputs.collect::<Result<_, _>>().map_err(sql)
    }

    /// What turns the ticks of its mission into times.
    ///
    /// # Errors
    /// When the file cannot be read or does not tell of its mission.
    pub fn stamper(&self) -> Result<Stamper, StoreError> {
        let untold = || StoreError::Untold { path: self.path.clone() };
        let mission = self.setting("mission")?.ok_or_else(untold)?;
        let (epoch_unix_s, period) = Mission::clock_of(&mission).ok_or_else(untold)?;
        Ok(Stamper::new(epoch_unix_s, period))
    }

    fn last_settled(&self) -> rusqlite::Result<Option<(u64, f64)>> {
        let select = "SELECT task, reward FROM attempts ORDER BY task DESC LIMIT 1";
        let read = |row: &Row<'_>| Ok((row.get::<_, i64>(0)?.cast_unsigned(), row.get(1)?));
        self.connection.query_row(select, [], read).optional()
    }

    fn progress(&self) -> rusqlite::Result<Option<Progress>> {
        let select = "SELECT now, settled, task, request, start, t_pre, t_acq FROM progress";
        let read = |row: &Row<'_>| {
            let task: Option<i64> = row.get(2)?;
            let in_flight = match task {
                None => None,
                Some(task) => Some(InFlight {
                    task: task.cast_unsigned(),
                    id: StripId(row.get::<_, i64>(3)?.cast_unsigned()),
                    start: tick(row, 4)?,
                    t_pre: row.get(5)?,
                    t_acq: row.get(6)?,
                }),
            };
            Ok(Progress { now: tick(row, 0)?, settled: row.get::<_, i64>(1)?.cast_unsigned(), in_flight })
        };
        self.connection.query_row(select, [], read).optional()
    }

    /// The history of a request, after that of the requests that it replaces.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn history(&self, id: StripId) -> Result<Vec<HistoryLine>, StoreError> {
        let select = "WITH RECURSIVE chain (id) AS (
                SELECT ?1 UNION SELECT requests.supersedes FROM requests JOIN chain USING (id)
                WHERE requests.supersedes IS NOT NULL)
            SELECT sequence, request, COALESCE(requests.client_ref, refused_ref), COALESCE(requests.name, refused_name),
                changes.tick, changes.state, changes.reason_code, changes.reason, changes.actor
            FROM changes JOIN chain ON changes.request = chain.id
            LEFT JOIN requests ON requests.id = changes.request ORDER BY sequence";
        self.lines(select, &[&id.0.cast_signed()])
    }

    /// Changes of the audit trail after a number, at most `limit`.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn trail(&self, after: u64, limit: usize) -> Result<Vec<HistoryLine>, StoreError> {
        let select = "SELECT sequence, request, COALESCE(requests.client_ref, refused_ref),
                COALESCE(requests.name, refused_name), changes.tick, changes.state, changes.reason_code, changes.reason,
                changes.actor
            FROM changes LEFT JOIN requests ON requests.id = changes.request
            WHERE sequence > ?1 ORDER BY sequence LIMIT ?2";
        self.lines(select, &[&after.cast_signed(), &(limit as i64)])
    }

    fn lines(&self, select: &str, values: &[&dyn rusqlite::ToSql]) -> Result<Vec<HistoryLine>, StoreError> {
        let sql = |source| self.error(source);
        let mut statement = self.connection.prepare_cached(select).map_err(sql)?;
        let lines = statement.query_map(values, |row| {
            Ok(HistoryLine {
                sequence: row.get::<_, i64>(0)?.cast_unsigned(),
                id: StripId(row.get::<_, i64>(1)?.cast_unsigned()),
                client_ref: row.get(2)?,
                name: row.get(3)?,
                tick: tick(row, 4)?,
                state: State::from_number(row.get(5)?).unwrap_or(State::Received),
                reason: (row.get(6)?, row.get(7)?),
                actor: row.get(8)?,
            })
        });
        lines.map_err(sql)?.collect::<Result<_, _>>().map_err(sql)
    }

    /// The attempts of tasks from a number on, in order, each with its strip's name.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn attempts_from(&self, task: u64) -> Result<Vec<(Attempt, String)>, StoreError> {
        let sql = |source| self.error(source);
        let select = "SELECT DISTINCT request FROM attempts WHERE task >= ?1";
        let mut statement = self.connection.prepare_cached(select).map_err(sql)?;
        let ids = statement.query_map([task.cast_signed()], |row| row.get::<_, i64>(0)).map_err(sql)?;
        let ids: Vec<StripId> =
            ids.map(|id| id.map(|id| StripId(id.cast_unsigned()))).collect::<Result<_, _>>().map_err(sql)?;
        let mut found = Vec::new();
        for id in ids {
            let name = "SELECT name FROM requests WHERE id = ?1";
            let name: String = self.connection.query_row(name, [id.0.cast_signed()], |row| row.get(0)).map_err(sql)?;
            let attempts = self.attempts(id)?.into_iter().filter(|attempt| attempt.task >= task);
            found.extend(attempts.map(|attempt| (attempt, name.clone())));
        }
        found.sort_by_key(|(attempt, _)| attempt.task);
        Ok(found)
    }

    /// The attempts at a request, in order.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn attempts(&self, id: StripId) -> Result<Vec<Attempt>, StoreError> {
        let sql = |source| self.error(source);
        let select = "SELECT task, start, finish, t_pre, t_acq, outcome, max_attitude_error, min_elevation, reward
            FROM attempts WHERE request = ?1 ORDER BY task";
        let mut statement = self.connection.prepare_cached(select).map_err(sql)?;
        let attempts = statement.query_map([id.0.cast_signed()], |row| {
            Ok(Attempt {
                id,
                task: row.get::<_, i64>(0)?.cast_unsigned(),
                start: tick(row, 1)?,
                end: tick(row, 2)?,
                t_pre: row.get(3)?,
                t_acq: row.get(4)?,
                outcome: outcome(row.get(5)?),
                max_attitude_error: row.get(6)?,
                min_elevation: row.get(7)?,
                reward: row.get(8)?,
            })
        });
        attempts.map_err(sql)?.collect::<Result<_, _>>().map_err(sql)
    }
}
