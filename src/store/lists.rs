//! Reading jobs: one, a page of a list, the feed of ended ones, the states that one went through, counts.
//!
//! Pages go by keyset: "those before this `seq`" (lists, newest first) or "those after this `end_seq`" (the feed,
//! in the order of ending). A row that exists throughout a scan is seen exactly once, whatever comes and goes meanwhile.

use std::collections::BTreeMap;

use sqlx::{QueryBuilder, Row, Sqlite};

use super::rows::{job, job_columns};
use super::{Job, JobId, State, Store, StoreError, SurfaceId};

/// Most rows that one call gives.
pub const MAX_PAGE: u32 = 1000;

pub(super) const JOB_BY_ID: &str = concat!("SELECT ", job_columns!(), " FROM jobs WHERE id = ?1");
pub(super) const JOB_BY_SEQ: &str = concat!("SELECT ", job_columns!(), " FROM jobs WHERE seq = ?1");
pub(super) const COUNT: &str = "SELECT count(*) AS n FROM jobs WHERE state = ?1";

pub(super) const EVENTS: &str = "SELECT e.revision, e.state, e.attempt FROM jobs AS j \
     JOIN job_events AS e ON e.job = j.seq WHERE j.id = ?1 AND e.revision > ?2 ORDER BY e.revision LIMIT ?3";
const LAST_END: &str = "SELECT value FROM counters WHERE name = 'end_seq'";

/// A state that a job came to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StateEvent {
    /// The job's revision when it came to it: the event's id.
    pub revision: i64,
    /// The state.
    pub state: State,
    /// How often the job had been started.
    pub attempt: u32,
}

pub(super) const OPEN: &str =
    "SELECT kind, count(*) AS n, min(created_us) AS oldest_us FROM jobs WHERE state = ?1 GROUP BY kind";

/// Jobs of one kind that wait or run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Open {
    /// Waiting or running.
    pub state: State,
    /// The kind of work.
    pub kind: String,
    /// How many.
    pub jobs: u64,
    /// When the oldest of them was accepted, microseconds since 1970.
    pub oldest_us: i64,
}

/// What a listed job must be. Every field that is set must fit.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct JobFilter {
    /// Its state.
    pub state: Option<State>,
    /// Its kind.
    pub kind: Option<String>,
    /// Its surface.
    pub surface: Option<SurfaceId>,
    /// Its verdict.
    pub verdict: Option<String>,
    /// Labels it must carry.
    pub labels: BTreeMap<String, String>,
}

impl Store {
    /// A job.
    ///
    /// # Errors
    /// What the database says.
    pub async fn job(&self, id: JobId) -> Result<Option<Job>, StoreError> {
        let row = sqlx::query(JOB_BY_ID).bind(id.bytes()).fetch_optional(&self.0.readers).await?;
        row.as_ref().map(job).transpose()
    }

    /// Jobs that came before `before` (a `seq`; `None`: from the newest), newest first.
    ///
    /// # Errors
    /// What the database says.
    pub async fn jobs(&self, filter: &JobFilter, before: Option<i64>, limit: u32) -> Result<Vec<Job>, StoreError> {
        let rows = list(filter, before, limit).build().fetch_all(&self.0.readers).await?;
        rows.iter().map(job).collect()
    }

    /// Jobs that ended after `after` (an `end_seq`; 0: from the first), in the order of ending.
    ///
    /// # Errors
    /// What the database says.
    pub async fn feed(&self, filter: &JobFilter, after: i64, limit: u32) -> Result<Vec<Job>, StoreError> {
        let rows = feed(filter, after, limit).build().fetch_all(&self.0.readers).await?;
        rows.iter().map(job).collect()
    }

    /// The states that a job came to after this revision, in order, at most [`MAX_PAGE`].
    ///
    /// # Errors
    /// What the database says.
    pub async fn events(&self, id: JobId, after: i64) -> Result<Vec<StateEvent>, StoreError> {
        let query = sqlx::query(EVENTS).bind(id.bytes()).bind(after).bind(MAX_PAGE);
        let rows = query.fetch_all(&self.0.readers).await?;
        let event = |row: &sqlx::sqlite::SqliteRow| {
            let state: &str = row.try_get("state")?;
            let state = state.parse().map_err(|_| StoreError::Corrupt(format!("state {state:?}")))?;
            Ok(StateEvent { revision: row.try_get("revision")?, state, attempt: row.try_get("attempt")? })
        };
        rows.iter().map(event).collect()
    }

    /// The last number of the order of ending that was given out; 0 before the first. Every job that ended with this
    /// number or a lower one can be read when this returns.
    ///
    /// # Errors
    /// What the database says.
    pub async fn last_end(&self) -> Result<i64, StoreError> {
        Ok(sqlx::query(LAST_END).fetch_one(&self.0.readers).await?.try_get("value")?)
    }

    /// How many jobs wait and run, by kind. Costs a walk over the jobs that have not ended.
    ///
    /// # Errors
    /// What the database says.
    pub async fn open_jobs(&self) -> Result<Vec<Open>, StoreError> {
        let mut open = Vec::new();
        for state in [State::Queued, State::Running] {
            for row in &sqlx::query(OPEN).bind(state.name()).fetch_all(&self.0.readers).await? {
                let jobs = row.try_get::<i64, _>("n")?.unsigned_abs();
                open.push(Open { state, kind: row.try_get("kind")?, jobs, oldest_us: row.try_get("oldest_us")? });
            }
        }
        Ok(open)
    }

    /// How many jobs stand in this state.
    ///
    /// # Errors
    /// What the database says.
    pub async fn count(&self, state: State) -> Result<u64, StoreError> {
        let row = sqlx::query(COUNT).bind(state.name()).fetch_one(&self.0.readers).await?;
        Ok(row.try_get::<i64, _>("n")?.unsigned_abs())
    }
}

/// The list's statement. A label, where one is asked for, leads: its table is ordered by job within (key, value).
pub(super) fn list(filter: &JobFilter, before: Option<i64>, limit: u32) -> QueryBuilder<Sqlite> {
    let before = before.unwrap_or(i64::MAX);
    let mut sql = QueryBuilder::new(concat!("SELECT ", job_columns!(), " FROM "));
    let mut labels = filter.labels.iter();
    let order = if let Some((key, value)) = labels.next() {
        sql.push("job_labels AS l CROSS JOIN jobs ON jobs.seq = l.job WHERE l.key = ").push_bind(key.clone());
        sql.push(" AND l.value = ").push_bind(value.clone());
        sql.push(" AND l.job < ").push_bind(before);
        " ORDER BY l.job DESC LIMIT "
    } else {
        sql.push("jobs WHERE jobs.seq < ").push_bind(before);
        " ORDER BY jobs.seq DESC LIMIT "
    };
    conditions(&mut sql, filter, ["jobs.state", "jobs.kind", "jobs.surface", "jobs.verdict"]);
    carrying(&mut sql, labels);
    sql.push(order).push_bind(limit.min(MAX_PAGE));
    sql
}

/// The feed's statement. It goes by `end_seq` whatever else is asked, since a reader is near the end as a rule and the
/// planner, which does not know that, would sort all the jobs of a state first; a column inside `coalesce` has no index.
pub(super) fn feed(filter: &JobFilter, after: i64, limit: u32) -> QueryBuilder<Sqlite> {
    let mut sql = QueryBuilder::new(concat!("SELECT ", job_columns!(), " FROM jobs WHERE jobs.end_seq > "));
    sql.push_bind(after);
    let columns =
        ["jobs.state", "jobs.kind", "jobs.surface", "jobs.verdict"].map(|name| format!("coalesce({name}, '')"));
    conditions(&mut sql, filter, columns.each_ref().map(String::as_str));
    carrying(&mut sql, filter.labels.iter());
    sql.push(" ORDER BY jobs.end_seq LIMIT ").push_bind(limit.min(MAX_PAGE));
    sql
}

/// Conditions on these columns: state, kind, surface, verdict.
fn conditions(sql: &mut QueryBuilder<Sqlite>, filter: &JobFilter, columns: [&str; 4]) {
    let wanted = [
        filter.state.map(|state| state.name().to_owned()),
        filter.kind.clone(),
        filter.surface.as_ref().map(|surface| surface.as_str().to_owned()),
        filter.verdict.clone(),
    ];
    for (column, wanted) in columns.into_iter().zip(wanted) {
        if let Some(wanted) = wanted {
            sql.push(" AND ").push(column).push(" = ").push_bind(wanted);
        }
    }
}

fn carrying<'a>(sql: &mut QueryBuilder<Sqlite>, labels: impl Iterator<Item = (&'a String, &'a String)>) {
    for (key, value) in labels {
        sql.push(" AND EXISTS (SELECT 1 FROM job_labels AS k WHERE k.job = jobs.seq AND k.key = ")
            .push_bind(key.clone());
        sql.push(" AND k.value = ").push_bind(value.clone()).push(")");
    }
}
