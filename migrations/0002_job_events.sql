-- The states that each job went through, so that who follows a job and was cut off is told what it missed.
--
-- `revision` is the job's at that moment: the id of the event. Triggers write the rows, so that no change of state, wherever
-- in the code it is made, goes without one.

CREATE TABLE job_events (
    job       INTEGER NOT NULL REFERENCES jobs (seq) ON DELETE CASCADE,
    revision  INTEGER NOT NULL CHECK (revision >= 1),
    state     TEXT    NOT NULL CHECK (state IN ('queued', 'running', 'succeeded', 'failed', 'cancelled')),
    attempt   INTEGER NOT NULL CHECK (attempt >= 0),
    PRIMARY KEY (job, revision)
) STRICT, WITHOUT ROWID;

-- Of jobs from before this table the first state and the present one are known.
INSERT INTO job_events (job, revision, state, attempt) SELECT seq, revision, state, attempt FROM jobs;
INSERT INTO job_events (job, revision, state, attempt)
    SELECT seq, 1, 'queued', 0 FROM jobs WHERE revision > 1 AND state <> 'queued';

CREATE TRIGGER jobs_event_first AFTER INSERT ON jobs
BEGIN
    INSERT INTO job_events (job, revision, state, attempt) VALUES (NEW.seq, NEW.revision, NEW.state, NEW.attempt);
END;
CREATE TRIGGER jobs_event_next AFTER UPDATE OF state ON jobs WHEN NEW.state <> OLD.state
BEGIN
    INSERT INTO job_events (job, revision, state, attempt) VALUES (NEW.seq, NEW.revision, NEW.state, NEW.attempt);
END;
