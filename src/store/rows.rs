//! A job's row: its states, its columns, and how they are read.

use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use serde_json::Value;
use sqlx::Row;
use sqlx::sqlite::SqliteRow;

use super::{JobId, Lane, NotAnId, StoreError, SurfaceId};
use crate::telemetry::kind_label;

/// Where a job stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum State {
    /// Accepted and on disk; waits for a worker.
    Queued,
    /// A worker has it under a lease.
    Running,
    /// Ended with results.
    Succeeded,
    /// Ended with a problem.
    Failed,
    /// Ended because someone wanted it no more.
    Cancelled,
}

impl State {
    /// Every state.
    pub const ALL: [Self; 5] = [Self::Queued, Self::Running, Self::Succeeded, Self::Failed, Self::Cancelled];

    /// The name as the API and the database write it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Queued => "queued",
            Self::Running => "running",
            Self::Succeeded => "succeeded",
            Self::Failed => "failed",
            Self::Cancelled => "cancelled",
        }
    }

    /// True when the job will never move again.
    #[must_use]
    pub const fn has_ended(self) -> bool {
        matches!(self, Self::Succeeded | Self::Failed | Self::Cancelled)
    }

    /// The published edges: whether a job may move from here to `next`. The schema has the same rule as a trigger.
    #[must_use]
    pub const fn may_become(self, next: Self) -> bool {
        match self {
            Self::Queued => matches!(next, Self::Running | Self::Cancelled),
            // Back to queued: the process died, the lease ran out, a transient fault, or a shutdown.
            Self::Running => !matches!(next, Self::Running),
            Self::Succeeded | Self::Failed | Self::Cancelled => false,
        }
    }
}

impl fmt::Display for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for State {
    type Err = NotAnId;

    fn from_str(text: &str) -> Result<Self, NotAnId> {
        Self::ALL.into_iter().find(|state| state.name() == text).ok_or(NotAnId)
    }
}

/// A job as it stands.
#[derive(Debug, Clone, PartialEq)]
pub struct Job {
    /// Its place in the order of arrival: what list cursors are made of.
    pub seq: i64,
    /// Its name.
    pub id: JobId,
    /// What kind of work.
    pub kind: String,
    /// The surface it is about. After the job has ended the surface may be gone.
    pub surface: SurfaceId,
    /// The parameters as they were asked for.
    pub parameters: Value,
    /// The parameters with every default filled in, once the work has found them.
    pub resolved: Option<Value>,
    /// Free key-value strings.
    pub labels: BTreeMap<String, String>,
    /// The work it was estimated at.
    pub cost: u64,
    /// The lane it waits in.
    pub lane: Lane,
    /// Where it stands.
    pub state: State,
    /// How often it was started.
    pub attempt: u32,
    /// True when it runs and is wanted no more.
    pub cancel_requested: bool,
    /// Fraction of the present stage that is done, in [0, 1].
    pub progress: f64,
    /// The stage it is in.
    pub stage: Option<String>,
    /// Estimate of what the stage will take yet, milliseconds, while it runs.
    pub remaining_ms: Option<u64>,
    /// Why it failed.
    pub problem: Option<Value>,
    /// What its limits say of the result.
    pub verdict: Option<String>,
    /// Milliseconds by stage.
    pub timings: Option<Value>,
    /// When it was accepted, microseconds since 1970.
    pub created_us: i64,
    /// When its latest attempt began.
    pub started_us: Option<i64>,
    /// When it ended.
    pub finished_us: Option<i64>,
    /// Its place in the order of ending, given in the transaction that ended it; never given twice.
    pub end_seq: Option<i64>,
    /// Grows with every change.
    pub revision: i64,
}

impl Job {
    /// The change that leads to this row.
    pub(super) fn change(&self) -> Change {
        let lasted = |finished_us: i64| Lasted {
            kind: kind_label(&self.kind),
            waited_us: self.started_us.unwrap_or(finished_us) - self.created_us,
            ran_us: self.started_us.map(|started_us| finished_us - started_us),
        };
        Change { id: self.id, state: self.state, revision: self.revision, ended: self.finished_us.map(lasted) }
    }
}

/// A job's row has changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Change {
    /// The job.
    pub id: JobId,
    /// Where it now stands.
    pub state: State,
    /// The row's revision.
    pub revision: i64,
    /// What it was and how long it took, when this change is its end.
    pub ended: Option<Lasted>,
}

/// How long a job took that has ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Lasted {
    /// The kind of work, as metrics name it.
    pub kind: &'static str,
    /// From its acceptance to the beginning of its last attempt, microseconds.
    pub waited_us: i64,
    /// How long that attempt took, if there was one.
    pub ran_us: Option<i64>,
}

/// The columns of a [`Job`], for `SELECT` and `RETURNING`.
macro_rules! job_columns {
    () => {
        "jobs.seq, jobs.id, jobs.kind, jobs.surface, jobs.parameters, jobs.resolved, jobs.labels, jobs.cost, jobs.lane, \
         jobs.state, jobs.attempt, jobs.cancel_requested, jobs.progress, jobs.stage, jobs.remaining_ms, jobs.problem, jobs.verdict, \
         jobs.timings, jobs.created_us, jobs.started_us, jobs.finished_us, jobs.end_seq, jobs.revision"
    };
}
pub(super) use job_columns;

/// The same for `RETURNING`, which knows no table names.
macro_rules! returning_job {
    () => {
        " RETURNING seq, id, kind, surface, parameters, resolved, labels, cost, lane, state, attempt, cancel_requested, \
         progress, stage, remaining_ms, problem, verdict, timings, created_us, started_us, finished_us, end_seq, revision"
    };
}
pub(super) use returning_job;

/// Reads the columns above.
pub(super) fn job(row: &SqliteRow) -> Result<Job, StoreError> {
    let json = |column: &str| -> Result<Option<Value>, StoreError> {
        let text: Option<&str> = row.try_get(column)?;
        Ok(text.map(serde_json::from_str).transpose()?)
    };
    let state: &str = row.try_get("state")?;
    let surface: &str = row.try_get("surface")?;
    Ok(Job {
        seq: row.try_get("seq")?,
        id: JobId::from_bytes(row.try_get("id")?)?,
        kind: row.try_get("kind")?,
        surface: surface.parse().map_err(|_| StoreError::Corrupt(format!("surface id {surface:?}")))?,
        parameters: serde_json::from_str(row.try_get("parameters")?)?,
        resolved: json("resolved")?,
        labels: serde_json::from_str(row.try_get("labels")?)?,
        cost: row.try_get::<i64, _>("cost")?.unsigned_abs(),
        lane: Lane::from_number(row.try_get("lane")?)?,
        state: state.parse().map_err(|_| StoreError::Corrupt(format!("state {state:?}")))?,
        attempt: row.try_get("attempt")?,
        cancel_requested: row.try_get("cancel_requested")?,
        progress: row.try_get("progress")?,
        stage: row.try_get("stage")?,
        remaining_ms: row.try_get::<Option<i64>, _>("remaining_ms")?.map(i64::unsigned_abs),
        problem: json("problem")?,
        verdict: row.try_get("verdict")?,
        timings: json("timings")?,
        created_us: row.try_get("created_us")?,
        started_us: row.try_get("started_us")?,
        finished_us: row.try_get("finished_us")?,
        end_seq: row.try_get("end_seq")?,
        revision: row.try_get("revision")?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_ended_job_moves_nowhere_and_only_a_waiting_one_starts() {
        for state in State::ALL {
            for next in State::ALL {
                if state.has_ended() || state == next {
                    assert!(!state.may_become(next), "{state} to {next}");
                }
                if next == State::Running {
                    assert_eq!(state.may_become(next), state == State::Queued);
                }
            }
            assert_eq!(state.name().parse(), Ok(state));
        }
    }
}
