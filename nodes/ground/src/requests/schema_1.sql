-- Schema 1: requests as they stand, and every change and attempt, which are only ever added.
CREATE TABLE settings (key TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE requests (
    id INTEGER PRIMARY KEY,
    client_ref TEXT NOT NULL,
    submitter TEXT NOT NULL,
    name TEXT NOT NULL,
    -- Degrees, metres per second; times in nanoseconds since 1970-01-01 UTC, 0 for none.
    start_latitude REAL NOT NULL,
    start_longitude REAL NOT NULL,
    end_latitude REAL NOT NULL,
    end_longitude REAL NOT NULL,
    priority REAL NOT NULL,
    speed REAL NOT NULL,
    bidirectional INTEGER NOT NULL,
    valid_from INTEGER NOT NULL,
    valid_until INTEGER NOT NULL,
    hold INTEGER NOT NULL,
    max_attempts INTEGER NOT NULL,
    -- Ticks since the mission's epoch.
    created INTEGER NOT NULL,
    linked INTEGER,
    supersedes INTEGER,
    -- Start windows: pairs of first and last tick, 8 bytes each, least significant byte first.
    windows BLOB NOT NULL,
    state INTEGER NOT NULL,
    reason_code INTEGER NOT NULL,
    reason TEXT NOT NULL,
    actor TEXT NOT NULL,
    changed INTEGER NOT NULL,
    attempts INTEGER NOT NULL DEFAULT 0,
    counted INTEGER NOT NULL DEFAULT 0,
    reward REAL NOT NULL DEFAULT 0,
    imaging INTEGER NOT NULL DEFAULT 0,
    superseded_by INTEGER
);
CREATE TABLE changes (
    sequence INTEGER PRIMARY KEY AUTOINCREMENT,
    -- 0 for a request that was refused.
    request INTEGER NOT NULL,
    tick INTEGER NOT NULL,
    state INTEGER NOT NULL,
    reason_code INTEGER NOT NULL,
    reason TEXT NOT NULL,
    actor TEXT NOT NULL,
    refused_ref TEXT,
    refused_name TEXT
);
CREATE TABLE attempts (
    -- A task is flown once: the same result cannot be written twice.
    task INTEGER PRIMARY KEY,
    request INTEGER NOT NULL,
    start INTEGER NOT NULL,
    finish INTEGER NOT NULL,
    t_pre INTEGER NOT NULL,
    t_acq INTEGER NOT NULL,
    outcome INTEGER NOT NULL,
    max_attitude_error REAL NOT NULL,
    min_elevation REAL NOT NULL,
    reward REAL NOT NULL
);
CREATE TABLE progress (
    one INTEGER PRIMARY KEY CHECK (one = 1),
    now INTEGER NOT NULL,
    settled INTEGER NOT NULL,
    task INTEGER,
    request INTEGER,
    start INTEGER,
    t_pre INTEGER,
    t_acq INTEGER
);
CREATE TRIGGER changes_stay BEFORE UPDATE ON changes BEGIN SELECT RAISE(ABORT, 'the history is never rewritten'); END;
CREATE TRIGGER changes_remain BEFORE DELETE ON changes BEGIN SELECT RAISE(ABORT, 'the history is never deleted'); END;
