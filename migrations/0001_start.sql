-- The first schema: surfaces, jobs, their results, and the bytes of both.
--
-- Times are microseconds since 1970 (`_us`). `seq` is the order of arrival: what lists and claims go by, since a clock may
-- step back and a number that is given out by the database does not. JSON is kept as text and checked to be JSON.
-- Every rule that the code relies on stands here as a constraint, so that a fault in the code ends in an error and not in
-- a row that no one can read.

-- Bytes by their blake3 digest: each content once, however many rows point to it. Apart from the rows that are listed
-- and updated, so that these stay small.
CREATE TABLE blobs (
    digest  BLOB    NOT NULL PRIMARY KEY CHECK (length(digest) = 32),
    length  INTEGER NOT NULL CHECK (length >= 0),
    bytes   BLOB    NOT NULL,
    CHECK (length(bytes) = length)
) STRICT;

CREATE TABLE surfaces (
    seq         INTEGER PRIMARY KEY AUTOINCREMENT,
    id          TEXT    NOT NULL UNIQUE CHECK (length(id) = 40 AND id NOT GLOB '*[^0-9a-f]*'),
    name        TEXT,
    kind        TEXT    NOT NULL CHECK (length(kind) BETWEEN 1 AND 32),
    units       TEXT    NOT NULL CHECK (length(units) BETWEEN 1 AND 8),
    media       TEXT    NOT NULL CHECK (length(media) BETWEEN 1 AND 128),
    reading     TEXT    NOT NULL CHECK (json_valid(reading)),
    summary     TEXT    NOT NULL CHECK (json_valid(summary)),
    content     BLOB    NOT NULL REFERENCES blobs (digest),
    created_us  INTEGER NOT NULL
) STRICT;
CREATE INDEX surfaces_content ON surfaces (content);

CREATE TABLE jobs (
    seq              INTEGER PRIMARY KEY AUTOINCREMENT,
    id               BLOB    NOT NULL UNIQUE CHECK (length(id) = 16),
    kind             TEXT    NOT NULL CHECK (length(kind) BETWEEN 1 AND 64),
    -- The surface it was asked for, kept for good, and the same while the job still needs it.
    surface          TEXT    NOT NULL,
    needs_surface    TEXT    REFERENCES surfaces (id),
    parameters       TEXT    NOT NULL CHECK (json_valid(parameters)),
    resolved         TEXT    CHECK (resolved IS NULL OR json_valid(resolved)),
    labels           TEXT    NOT NULL CHECK (json_valid(labels)),
    cost             INTEGER NOT NULL CHECK (cost >= 0),
    lane             INTEGER NOT NULL CHECK (lane IN (0, 1)),
    state            TEXT    NOT NULL DEFAULT 'queued'
                             CHECK (state IN ('queued', 'running', 'succeeded', 'failed', 'cancelled')),
    attempt          INTEGER NOT NULL DEFAULT 0 CHECK (attempt >= 0),
    -- How many of its attempts ended with the worker's death. Jobs with one or more run one at a time, so that only the
    -- culprit goes on dying.
    crashes          INTEGER NOT NULL DEFAULT 0 CHECK (crashes BETWEEN 0 AND attempt),
    boot             BLOB,
    lease_token      BLOB    CHECK (lease_token IS NULL OR length(lease_token) = 16),
    lease_until_us   INTEGER,
    cancel_requested INTEGER NOT NULL DEFAULT 0 CHECK (cancel_requested IN (0, 1)),
    progress         REAL    NOT NULL DEFAULT 0 CHECK (progress BETWEEN 0 AND 1),
    stage            TEXT,
    problem          TEXT    CHECK (problem IS NULL OR json_valid(problem)),
    verdict          TEXT,
    timings          TEXT    CHECK (timings IS NULL OR json_valid(timings)),
    created_us       INTEGER NOT NULL,
    started_us       INTEGER,
    finished_us      INTEGER,
    end_seq          INTEGER UNIQUE,
    -- Grows with every change of the row: the job's ETag and the id of its events.
    revision         INTEGER NOT NULL DEFAULT 1 CHECK (revision >= 1),
    -- A lease exists exactly while the job runs.
    CHECK ((state = 'running') = (lease_token IS NOT NULL)),
    CHECK ((lease_token IS NULL) = (lease_until_us IS NULL)),
    CHECK ((lease_token IS NULL) = (boot IS NULL)),
    -- Ended, and only then: a time, a place in the order of ending, and no more need of the surface.
    CHECK ((state IN ('succeeded', 'failed', 'cancelled')) = (finished_us IS NOT NULL)),
    CHECK ((finished_us IS NULL) = (end_seq IS NULL)),
    CHECK ((finished_us IS NULL) = (needs_surface IS NOT NULL)),
    CHECK (needs_surface IS NULL OR needs_surface = surface),
    CHECK ((state = 'failed') = (problem IS NOT NULL)),
    CHECK (verdict IS NULL OR state = 'succeeded'),
    CHECK (state <> 'running' OR (attempt >= 1 AND started_us IS NOT NULL)),
    CHECK (state <> 'succeeded' OR (attempt >= 1 AND started_us IS NOT NULL)),
    CHECK (cancel_requested = 0 OR state IN ('running', 'cancelled'))
) STRICT;
-- Claims and lists by state; few run at a time, so leases need none of their own.
CREATE INDEX jobs_by_state ON jobs (state, seq);
CREATE INDEX jobs_queued_by_lane ON jobs (lane, seq) WHERE state = 'queued';
CREATE INDEX jobs_needing ON jobs (needs_surface) WHERE needs_surface IS NOT NULL;
CREATE INDEX jobs_by_kind ON jobs (kind, seq);
CREATE INDEX jobs_by_surface ON jobs (surface, seq);
CREATE INDEX jobs_by_verdict ON jobs (verdict, seq) WHERE verdict IS NOT NULL;

-- The published edges: a state moves along these or not at all.
CREATE TRIGGER jobs_edges BEFORE UPDATE OF state ON jobs
WHEN NOT (
    (OLD.state = 'queued' AND NEW.state IN ('running', 'cancelled'))
    OR (OLD.state = 'running' AND NEW.state IN ('queued', 'succeeded', 'failed', 'cancelled'))
)
BEGIN
    SELECT RAISE(ABORT, 'no such edge between job states');
END;
CREATE TRIGGER jobs_start BEFORE INSERT ON jobs WHEN NEW.state <> 'queued'
BEGIN
    SELECT RAISE(ABORT, 'a job starts queued');
END;
CREATE TRIGGER jobs_in_use BEFORE DELETE ON jobs WHEN OLD.finished_us IS NULL
BEGIN
    SELECT RAISE(ABORT, 'only an ended job can be deleted');
END;

CREATE TABLE job_labels (
    key    TEXT    NOT NULL,
    value  TEXT    NOT NULL,
    job    INTEGER NOT NULL REFERENCES jobs (seq) ON DELETE CASCADE,
    PRIMARY KEY (key, value, job)
) STRICT, WITHOUT ROWID;
CREATE INDEX job_labels_by_job ON job_labels (job, key);

CREATE TABLE results (
    job    INTEGER NOT NULL REFERENCES jobs (seq) ON DELETE CASCADE,
    name   TEXT    NOT NULL CHECK (length(name) BETWEEN 1 AND 32),
    media  TEXT    NOT NULL CHECK (length(media) BETWEEN 1 AND 128),
    blob   BLOB    NOT NULL REFERENCES blobs (digest),
    PRIMARY KEY (job, name)
) STRICT, WITHOUT ROWID;
CREATE INDEX results_blob ON results (blob);

-- Which job a client's idempotency key stands for, and the digest of the body it came with.
CREATE TABLE idempotency (
    scope       TEXT    NOT NULL,
    key         TEXT    NOT NULL,
    digest      BLOB    NOT NULL CHECK (length(digest) = 32),
    job         INTEGER NOT NULL REFERENCES jobs (seq) ON DELETE CASCADE,
    created_us  INTEGER NOT NULL,
    PRIMARY KEY (scope, key)
) STRICT, WITHOUT ROWID;
CREATE INDEX idempotency_job ON idempotency (job);
CREATE INDEX idempotency_age ON idempotency (created_us);

-- Numbers that are never given out twice, not even after the row that had the last one is deleted.
CREATE TABLE counters (
    name   TEXT    NOT NULL PRIMARY KEY,
    value  INTEGER NOT NULL
) STRICT, WITHOUT ROWID;
INSERT INTO counters (name, value) VALUES ('end_seq', 0);
