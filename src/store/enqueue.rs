//! A job is accepted: one transaction checks room, surface and idempotency key and writes the row, with the surface
//! where that comes along.

use std::collections::BTreeMap;
use std::time::Duration;

use serde_json::Value;
use sqlx::{Row, SqliteConnection};

use super::rows::{job, returning_job};
use super::surfaces::insert_surface;
use super::{Context, Digest, Job, JobId, Lane, NewSurface, Store, StoreError, SurfaceId, Written};

/// How long an idempotency key is remembered.
pub const IDEMPOTENCY_KEPT: Duration = Duration::from_hours(24);
/// Expired keys forgotten with each new one: more than come in, so the table does not grow; few, so no one waits.
const FORGET: i64 = 4;

/// A key with which a client may send the same request again without getting a second job.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct IdempotencyKey {
    /// Where the key holds: the route, later the tenant too.
    pub scope: String,
    /// The client's key.
    pub key: String,
    /// Digest of the request's body: the same key with another body is refused.
    pub body: Digest,
}

/// A job to be accepted.
#[derive(Debug, Clone, PartialEq)]
pub struct NewJob {
    /// What kind of work.
    pub kind: String,
    /// The surface it is about; it must be there.
    pub surface: SurfaceId,
    /// The parameters as they were asked for.
    pub parameters: Value,
    /// Free key-value strings.
    pub labels: BTreeMap<String, String>,
    /// Estimate of the work.
    pub cost: u64,
    /// The client's key, if it sent one.
    pub idempotency: Option<IdempotencyKey>,
}

/// What became of it.
#[derive(Debug, Clone, PartialEq)]
pub enum Enqueued {
    /// A new job, on disk.
    New(Job),
    /// The job that the same key and body gave before, as it stands now.
    Again(Job),
}

impl Enqueued {
    /// The job.
    #[must_use]
    pub const fn job(&self) -> &Job {
        match self {
            Self::New(job) | Self::Again(job) => job,
        }
    }
}

/// Why a job was not accepted. Nothing is stored then.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EnqueueError {
    /// As many jobs wait as may.
    #[error("{waiting} jobs are waiting already, which is as many as may: try again later")]
    QueueFull {
        /// How many wait.
        waiting: u64,
    },
    /// There is no such surface.
    #[error("there is no surface {0}")]
    NoSurface(SurfaceId),
    /// The idempotency key came with another body before.
    #[error("the idempotency key {key:?} was used for another request")]
    KeyReused {
        /// The key.
        key: String,
    },
    /// The service is stopping and takes no more work.
    #[error("the service is stopping")]
    Draining,
    /// The store failed.
    #[error(transparent)]
    Store(#[from] StoreError),
}

impl From<sqlx::Error> for EnqueueError {
    fn from(error: sqlx::Error) -> Self {
        Self::Store(error.into())
    }
}

pub(super) const COUNT_WAITING: &str =
    "SELECT count(*) AS n FROM (SELECT 1 FROM jobs WHERE state = 'queued' ORDER BY seq LIMIT ?1)";
pub(super) const SPAN_WAITING: &str = "SELECT (SELECT seq FROM jobs WHERE state = 'queued' ORDER BY seq DESC LIMIT 1) \
     - (SELECT seq FROM jobs WHERE state = 'queued' ORDER BY seq LIMIT 1) + 1 AS span";
const INSERT_LABELS: &str =
    "INSERT INTO job_labels (key, value, job) SELECT e.key, e.value, ?2 FROM json_each(?1) AS e";
const INSERT: &str = concat!(
    "INSERT INTO jobs (id, kind, surface, needs_surface, parameters, labels, cost, lane, created_us) \
     VALUES (?1, ?2, ?3, ?3, ?4, ?5, ?6, ?7, ?8)",
    returning_job!()
);
const KNOWN_KEY: &str = "SELECT digest, job FROM idempotency WHERE scope = ?1 AND key = ?2 AND created_us > ?3";
const FORGET_KEYS: &str = "DELETE FROM idempotency WHERE (scope, key) IN \
     (SELECT scope, key FROM idempotency WHERE created_us <= ?1 ORDER BY created_us LIMIT ?2)";
const REMEMBER_KEY: &str = "INSERT INTO idempotency (scope, key, digest, job, created_us) VALUES (?1, ?2, ?3, ?4, ?5) \
     ON CONFLICT (scope, key) DO UPDATE SET digest = excluded.digest, job = excluded.job, created_us = excluded.created_us";

impl Store {
    /// Accepts a job into `lane` unless `most_waiting` wait already. When this returns it is on disk.
    ///
    /// # Errors
    /// [`EnqueueError`]; nothing is stored then.
    pub async fn enqueue(&self, new: NewJob, lane: Lane, most_waiting: u64) -> Result<Enqueued, EnqueueError> {
        self.write(Order { new, surface: None, lane, most_waiting }, |context, order, tx| {
            Box::pin(accept(context, order, tx))
        })
        .await
    }

    /// The same for a job that comes with its surface: both are stored in one transaction, or neither.
    ///
    /// # Errors
    /// [`EnqueueError`]; nothing is stored then.
    pub async fn enqueue_with_surface(
        &self,
        surface: NewSurface,
        new: NewJob,
        lane: Lane,
        most_waiting: u64,
    ) -> Result<Enqueued, EnqueueError> {
        self.write(Order { new, surface: Some(surface), lane, most_waiting }, |context, order, tx| {
            Box::pin(accept(context, order, tx))
        })
        .await
    }
}

struct Order {
    new: NewJob,
    surface: Option<NewSurface>,
    lane: Lane,
    most_waiting: u64,
}

async fn accept(
    context: &Context,
    order: &Order,
    tx: &mut SqliteConnection,
) -> Result<Written<Enqueued>, EnqueueError> {
    let Order { new, surface, lane, most_waiting } = order;
    let now = context.clock.wall_us();
    if let Some(key) = &new.idempotency
        && let Some(known) = known_job(tx, key, now).await?
    {
        return Ok(Written::undo(Enqueued::Again(known)));
    }
    room(tx, *most_waiting).await?;
    if let Some(surface) = surface {
        insert_surface(tx, surface, now).await?;
    } else {
        let known = sqlx::query("SELECT 1 FROM surfaces WHERE id = ?1").bind(new.surface.as_str());
        if known.fetch_optional(&mut *tx).await?.is_none() {
            return Err(EnqueueError::NoSurface(new.surface.clone()));
        }
    }
    let labels = serde_json::to_string(&new.labels).map_err(StoreError::from)?;
    let row = sqlx::query(INSERT)
        .bind(JobId::fresh().bytes())
        .bind(&new.kind)
        .bind(new.surface.as_str())
        .bind(new.parameters.to_string())
        .bind(&labels)
        .bind(i64::try_from(new.cost).unwrap_or(i64::MAX))
        .bind(lane.number())
        .bind(now)
        .fetch_one(&mut *tx)
        .await?;
    let inserted = job(&row)?;
    if !new.labels.is_empty() {
        sqlx::query(INSERT_LABELS).bind(&labels).bind(inserted.seq).execute(&mut *tx).await?;
    }
    if let Some(key) = &new.idempotency {
        remember(tx, key, inserted.seq, now).await?;
    }
    let change = inserted.change();
    Ok(Written::keep(Enqueued::New(inserted)).changing([change]).making_work(1))
}

/// Whether one more job may wait.
async fn room(tx: &mut SqliteConnection, most_waiting: u64) -> Result<(), EnqueueError> {
    let limit = i64::try_from(most_waiting).unwrap_or(i64::MAX);
    // Two looks into an index. Only when so many jobs came since the one that has waited longest are they counted.
    let span: Option<i64> = sqlx::query(SPAN_WAITING).fetch_one(&mut *tx).await?.try_get("span")?;
    if span.unwrap_or(0) < limit {
        return Ok(());
    }
    let waiting: i64 = sqlx::query(COUNT_WAITING).bind(limit).fetch_one(&mut *tx).await?.try_get("n")?;
    if waiting >= limit {
        return Err(EnqueueError::QueueFull { waiting: waiting.unsigned_abs() });
    }
    Ok(())
}

fn expiry(now: i64) -> i64 {
    now - i64::try_from(IDEMPOTENCY_KEPT.as_micros()).unwrap_or(i64::MAX)
}

async fn known_job(tx: &mut SqliteConnection, key: &IdempotencyKey, now: i64) -> Result<Option<Job>, EnqueueError> {
    let known =
        sqlx::query(KNOWN_KEY).bind(&key.scope).bind(&key.key).bind(expiry(now)).fetch_optional(&mut *tx).await?;
    let Some(known) = known else { return Ok(None) };
    if Digest::from_bytes(known.try_get("digest")?)? != key.body {
        return Err(EnqueueError::KeyReused { key: key.key.clone() });
    }
    let seq: i64 = known.try_get("job")?;
    let row = sqlx::query(super::lists::JOB_BY_SEQ).bind(seq).fetch_one(&mut *tx).await?;
    Ok(Some(job(&row)?))
}

async fn remember(tx: &mut SqliteConnection, key: &IdempotencyKey, job: i64, now: i64) -> Result<(), EnqueueError> {
    sqlx::query(FORGET_KEYS).bind(expiry(now)).bind(FORGET).execute(&mut *tx).await?;
    sqlx::query(REMEMBER_KEY)
        .bind(&key.scope)
        .bind(&key.key)
        .bind(key.body.bytes())
        .bind(job)
        .bind(now)
        .execute(&mut *tx)
        .await?;
    Ok(())
}
