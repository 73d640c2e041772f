//! Leases: a worker claims a job for a while, renews it while it works, and gives it back or loses it.
//!
//! The attempt is counted when the job is claimed, so work that kills the process is counted too. Each claim has a fresh
//! token; every later write of that worker names (id, attempt, token) and requires that the job still runs. A worker
//! that was asleep past its lease thus writes nothing, however late it wakes. Lease times are steady times (see
//! [`crate::clock`]), compared only within one boot; rows of another boot are those of a process that is dead.
//!
//! Jobs whose worker died run one at a time: were they run together, those that merely ran beside the culprit would die
//! with it until their attempts are used up. As it is, a job dies beside a culprit at most once.

use std::time::Duration;

use serde_json::Value;
use sqlx::{Row, SqliteConnection};
use uuid::Uuid;

use super::endings::end;
use super::rows::{job, returning_job};
use super::{Context, Ending, Job, JobId, Store, StoreError, Wish, Written};

/// Where a job waits: small jobs have workers of their own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Lane {
    /// Small jobs.
    Light,
    /// All others.
    Heavy,
}

impl Lane {
    pub(super) const fn number(self) -> i64 {
        match self {
            Self::Light => 0,
            Self::Heavy => 1,
        }
    }

    pub(super) fn from_number(number: i64) -> Result<Self, StoreError> {
        match number {
            0 => Ok(Self::Light),
            1 => Ok(Self::Heavy),
            _ => Err(StoreError::Corrupt(format!("lane {number}"))),
        }
    }
}

/// A worker's right to a job.
#[derive(Debug, Clone, PartialEq)]
pub struct Claim {
    /// The job as it was claimed.
    pub job: Job,
    /// What every write of this worker must name.
    pub(super) token: Uuid,
}

/// How far a running job is.
#[derive(Debug, Clone, PartialEq)]
pub struct Progress {
    /// Fraction of the stage, in [0, 1].
    pub fraction: f64,
    /// The stage.
    pub stage: Option<&'static str>,
    /// Estimate of what the stage will take yet, milliseconds.
    pub remaining_ms: Option<u64>,
}

/// Which running jobs are taken from their workers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reclaim {
    /// Those of processes that are dead: of every boot but this one.
    OtherBoots,
    /// Those whose lease has run out.
    Expired,
}

/// What became of jobs that were taken from their workers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Reclaimed {
    /// Back in the queue.
    pub requeued: u64,
    /// Failed: as many attempts as may be were used up.
    pub failed: u64,
    /// Cancelled: that was asked for while they ran.
    pub cancelled: u64,
}

/// `lane IS ?` would not use the index, so each lane choice is a statement of its own.
macro_rules! claim {
    ($waiting:literal) => {
        concat!(
            "UPDATE jobs SET state = 'running', attempt = attempt + 1, boot = ?1, lease_token = ?2, lease_until_us = ?3, \
             started_us = ?4, progress = 0, stage = NULL, remaining_ms = NULL, revision = revision + 1 WHERE state = 'queued' AND seq = (",
            $waiting,
            ")",
            returning_job!()
        )
    };
}
pub(super) const CLAIM_LIGHT: &str = claim!(
    "SELECT seq FROM jobs WHERE state = 'queued' AND lane = 0 AND (crashes = 0 OR NOT EXISTS \
     (SELECT 1 FROM jobs AS r WHERE r.state = 'running' AND r.crashes > 0)) ORDER BY seq LIMIT 1"
);
pub(super) const CLAIM_ANY: &str = claim!(
    "SELECT seq FROM jobs WHERE state = 'queued' AND (crashes = 0 OR NOT EXISTS \
     (SELECT 1 FROM jobs AS r WHERE r.state = 'running' AND r.crashes > 0)) ORDER BY seq LIMIT 1"
);
const RENEW: &str = "UPDATE jobs SET lease_until_us = ?4 \
     WHERE id = ?1 AND attempt = ?2 AND lease_token = ?3 AND state = 'running'";
const PROGRESS: &str = concat!(
    "UPDATE jobs SET progress = ?4, stage = ?5, remaining_ms = ?6, revision = revision + 1 \
     WHERE id = ?1 AND attempt = ?2 AND lease_token = ?3 AND state = 'running'",
    returning_job!()
);
const GIVE_BACK: &str = concat!(
    "UPDATE jobs SET state = 'queued', attempt = attempt - ?4, crashes = crashes + ?5, boot = NULL, lease_token = NULL, \
     lease_until_us = NULL, progress = 0, stage = NULL, remaining_ms = NULL, revision = revision + 1 \
     WHERE id = ?1 AND attempt = ?2 AND lease_token = ?3 AND state = 'running' AND cancel_requested = 0",
    returning_job!()
);
pub(super) const UNWANTED: &str = "SELECT id, attempt FROM jobs WHERE state = 'running' AND cancel_requested = 1";
pub(super) const LOST_BY_BOOT: &str = "SELECT seq, attempt, cancel_requested, lease_token, id FROM jobs WHERE state = 'running' AND boot <> ?1 ORDER BY seq";
pub(super) const LOST_BY_TIME: &str = "SELECT seq, attempt, cancel_requested, lease_token, id FROM jobs \
     WHERE state = 'running' AND lease_until_us <= ?1 ORDER BY seq";

impl Store {
    /// Claims the job that has waited longest: of the light lane alone, or of both.
    ///
    /// # Errors
    /// What the database says.
    pub async fn claim(&self, light_only: bool, lease: Duration) -> Result<Option<Claim>, StoreError> {
        self.write((light_only, lease), |context, &(light_only, lease), tx| {
            Box::pin(async move {
                let claimed = claim(context, tx, light_only, lease).await?;
                let Some(claim) = claimed else { return Ok(Written::undo(None)) };
                let change = claim.job.change();
                Ok(Written::keep(Some(claim)).changing([change]))
            })
        })
        .await
    }

    /// The same, but waits until there is such a job: it is claimed by the very commit that accepts it or gives it back.
    #[must_use]
    pub fn wish(&self, light_only: bool, lease: Duration) -> Wish {
        self.0.writer.wish(light_only, lease)
    }

    /// Renews leases and writes progress, all in one transaction. Gives for each claim whether it still holds.
    ///
    /// # Errors
    /// What the database says.
    pub async fn renew(
        &self,
        claims: Vec<(Claim, Option<Progress>)>,
        lease: Duration,
    ) -> Result<Vec<bool>, StoreError> {
        self.write((claims, lease), |context, (claims, lease), tx| {
            Box::pin(async move {
                let until = lease_until(context, *lease);
                let mut held = Vec::with_capacity(claims.len());
                let mut changes = Vec::new();
                for (claim, progress) in claims {
                    let renewed = sqlx::query(RENEW)
                        .bind(claim.job.id.bytes())
                        .bind(claim.job.attempt)
                        .bind(claim.token.as_bytes().as_slice())
                        .bind(until)
                        .execute(&mut *tx)
                        .await?;
                    held.push(renewed.rows_affected() == 1);
                    if let Some(progress) = progress {
                        let row = sqlx::query(PROGRESS)
                            .bind(claim.job.id.bytes())
                            .bind(claim.job.attempt)
                            .bind(claim.token.as_bytes().as_slice())
                            .bind(progress.fraction.clamp(0.0, 1.0))
                            .bind(progress.stage)
                            .bind(progress.remaining_ms.map(|ms| i64::try_from(ms).unwrap_or(i64::MAX)))
                            .fetch_optional(&mut *tx)
                            .await?;
                        changes.extend(row.as_ref().map(job).transpose()?.map(|job| job.change()));
                    }
                }
                Ok(Written::keep(held).changing(changes))
            })
        })
        .await
    }

    /// Running jobs whose cancellation was asked for, with the attempt that is to stop.
    ///
    /// # Errors
    /// What the database says.
    pub async fn unwanted(&self) -> Result<Vec<(JobId, u32)>, StoreError> {
        let rows = sqlx::query(UNWANTED).fetch_all(&self.0.readers).await?;
        rows.iter().map(|row| Ok((JobId::from_bytes(row.try_get("id")?)?, row.try_get("attempt")?))).collect()
    }

    /// Puts a claimed job back into the queue, its attempt counted or not. False, and nothing is written: the claim no
    /// longer holds, or cancellation was asked for and the job is to be [finished](Store::finish) instead.
    ///
    /// # Errors
    /// What the database says.
    pub async fn give_back(&self, claim: Claim, attempt_counts: bool) -> Result<bool, StoreError> {
        self.write((claim, attempt_counts), |_, (claim, attempt_counts), tx| {
            Box::pin(async move {
                let row = sqlx::query(GIVE_BACK)
                    .bind(claim.job.id.bytes())
                    .bind(claim.job.attempt)
                    .bind(claim.token.as_bytes().as_slice())
                    .bind(i64::from(!attempt_counts))
                    .bind(0)
                    .fetch_optional(&mut *tx)
                    .await?;
                let Some(row) = row else { return Ok(Written::undo(false)) };
                Ok(Written::keep(true).changing([job(&row)?.change()]).making_work(1))
            })
        })
        .await
    }

    /// Takes running jobs from workers that are dead or past their lease: back to the queue, or to the end when
    /// cancellation was asked for or `most_attempts` are used up (`crashed` says why).
    ///
    /// # Errors
    /// What the database says.
    pub async fn reclaim(&self, which: Reclaim, most_attempts: u32, crashed: Value) -> Result<Reclaimed, StoreError> {
        self.write((which, most_attempts, crashed), |context, (which, most_attempts, crashed), tx| {
            Box::pin(take_back(context, tx, *which, *most_attempts, crashed))
        })
        .await
    }
}

/// Claims a job within a transaction.
pub(super) async fn claim(
    context: &Context,
    tx: &mut SqliteConnection,
    light_only: bool,
    lease: Duration,
) -> Result<Option<Claim>, StoreError> {
    let token = Uuid::now_v7();
    let row = sqlx::query(if light_only { CLAIM_LIGHT } else { CLAIM_ANY })
        .bind(context.boot.as_bytes().as_slice())
        .bind(token.as_bytes().as_slice())
        .bind(lease_until(context, lease))
        .bind(context.clock.wall_us())
        .fetch_optional(tx)
        .await?;
    row.map(|row| Ok(Claim { job: job(&row)?, token })).transpose()
}

async fn take_back(
    context: &Context,
    tx: &mut SqliteConnection,
    which: Reclaim,
    most_attempts: u32,
    crashed: &Value,
) -> Result<Written<Reclaimed>, StoreError> {
    let lost = match which {
        Reclaim::OtherBoots => sqlx::query(LOST_BY_BOOT).bind(context.boot.as_bytes().as_slice()),
        Reclaim::Expired => sqlx::query(LOST_BY_TIME).bind(context.clock.steady_us()),
    };
    let rows = lost.fetch_all(&mut *tx).await?;
    let mut reclaimed = Reclaimed::default();
    let mut changes = Vec::with_capacity(rows.len());
    for row in &rows {
        let id: &[u8] = row.try_get("id")?;
        let token: &[u8] = row.try_get("lease_token")?;
        let attempt: u32 = row.try_get("attempt")?;
        let cancelled: bool = row.try_get("cancel_requested")?;
        let ended = if cancelled || attempt >= most_attempts {
            let ending = Ending::Failed { problem: crashed.clone(), results: Vec::new(), resolved: None };
            let ended = end(context, tx, (id, attempt, token), &ending, None).await?;
            if cancelled {
                reclaimed.cancelled += 1;
            } else {
                reclaimed.failed += 1;
            }
            ended
        } else {
            let row = sqlx::query(GIVE_BACK)
                .bind(id)
                .bind(attempt)
                .bind(token)
                .bind(0)
                .bind(1)
                .fetch_optional(&mut *tx)
                .await?;
            reclaimed.requeued += 1;
            row.as_ref().map(job).transpose()?
        };
        changes.extend(ended.map(|job| job.change()));
    }
    let work = rows.len();
    Ok(Written::keep(reclaimed).changing(changes).making_work(work))
}

fn lease_until(context: &Context, lease: Duration) -> i64 {
    context.clock.steady_us().saturating_add(i64::try_from(lease.as_micros()).unwrap_or(i64::MAX))
}
