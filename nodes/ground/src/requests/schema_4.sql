-- Schema 4: what the ground's end of the radio was told, in order; all that the ground knows follows from it.
CREATE TABLE told (
    sequence INTEGER PRIMARY KEY,
    input BLOB NOT NULL
);
CREATE TRIGGER told_stays BEFORE UPDATE ON told BEGIN SELECT RAISE(ABORT, 'what was told is never rewritten'); END;
CREATE TRIGGER told_remains BEFORE DELETE ON told BEGIN SELECT RAISE(ABORT, 'what was told is never deleted'); END;
