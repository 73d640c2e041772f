//! How jobs end and go: result and final state in one transaction, cancellation, removal.

use serde_json::Value;
use sqlx::{Row, SqliteConnection};

use super::results::{insert_result, remove_orphans};
use super::rows::{job, returning_job};
use super::{Claim, Context, Digest, Job, JobId, NewResult, State, Store, StoreError, Written};

/// What a worker makes of its job.
#[derive(Debug, Clone, PartialEq)]
pub enum Ending {
    /// It did what was asked.
    Succeeded {
        /// What came out.
        results: Vec<NewResult>,
        /// What the limits say of it.
        verdict: Option<String>,
        /// The parameters with every default filled in.
        resolved: Option<Value>,
    },
    /// It could not be done.
    Failed {
        /// Why.
        problem: Value,
        /// What there is of a result.
        results: Vec<NewResult>,
        /// The parameters with every default filled in.
        resolved: Option<Value>,
    },
    /// It stopped because it was wanted no more.
    Cancelled,
}

/// Whether an ending was written.
#[derive(Debug, Clone, PartialEq)]
pub enum Committed {
    /// It was; the job as it stands. A job whose cancellation was accepted while it ran ends cancelled whatever the
    /// worker brings.
    Ended(Box<Job>),
    /// The claim no longer held: nothing was written.
    Lost,
}

/// What a cancellation did.
#[derive(Debug, Clone, PartialEq)]
pub enum Cancelled {
    /// It waited and has ended, or had been cancelled before.
    Ended(Box<Job>),
    /// It runs; its worker is to stop, and whatever comes of it, it ends cancelled.
    Requested(Box<Job>),
    /// It has succeeded or failed before.
    TooLate(Box<Job>),
}

/// What a removal did.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Removal {
    /// It is gone.
    Removed,
    /// There is no such thing.
    Absent,
    /// A surface that a job needs, or a job that has not ended.
    InUse,
}

const NEXT_END: &str = "UPDATE counters SET value = value + 1 WHERE name = 'end_seq' RETURNING value";
const END: &str = concat!(
    "UPDATE jobs SET \
     state = CASE WHEN cancel_requested THEN 'cancelled' ELSE ?4 END, \
     problem = CASE WHEN cancel_requested THEN NULL ELSE ?5 END, \
     verdict = CASE WHEN cancel_requested THEN NULL ELSE ?6 END, \
     resolved = coalesce(?7, resolved), timings = coalesce(?8, timings), \
     progress = CASE WHEN cancel_requested OR ?4 <> 'succeeded' THEN progress ELSE 1 END, remaining_ms = NULL, \
     boot = NULL, lease_token = NULL, lease_until_us = NULL, needs_surface = NULL, \
     finished_us = ?9, end_seq = ?10, revision = revision + 1 \
     WHERE id = ?1 AND attempt = ?2 AND lease_token = ?3 AND state = 'running'",
    returning_job!()
);
const CANCEL_QUEUED: &str = concat!(
    "UPDATE jobs SET state = 'cancelled', needs_surface = NULL, finished_us = ?2, end_seq = ?3, revision = revision + 1 \
     WHERE id = ?1 AND state = 'queued'",
    returning_job!()
);
const CANCEL_RUNNING: &str = concat!(
    "UPDATE jobs SET cancel_requested = 1, revision = revision + 1 \
     WHERE id = ?1 AND state = 'running' AND cancel_requested = 0",
    returning_job!()
);

impl Store {
    /// Ends a claimed job: state, problem, verdict and results in one transaction, and only while the claim holds.
    ///
    /// # Errors
    /// What the database says; nothing is written then.
    pub async fn finish(&self, claim: &Claim, ending: Ending, timings: Option<Value>) -> Result<Committed, StoreError> {
        self.write((claim.clone(), ending, timings), |context, (claim, ending, timings), tx| {
            Box::pin(async {
                let holder = (claim.job.id.bytes(), claim.job.attempt, claim.token.as_bytes().as_slice());
                let Some(ended) = end(context, tx, holder, ending, timings.as_ref()).await? else {
                    return Ok(Written::undo(Committed::Lost));
                };
                let results = match ending {
                    Ending::Succeeded { results, .. } | Ending::Failed { results, .. } => results.as_slice(),
                    Ending::Cancelled => &[],
                };
                if ended.state != State::Cancelled {
                    for result in results {
                        insert_result(tx, ended.seq, result).await?;
                    }
                }
                let change = ended.change();
                Ok(Written::keep(Committed::Ended(Box::new(ended))).changing([change]))
            })
        })
        .await
    }

    /// Cancels a job: at once when it waits, by a mark that outlives the process when it runs. `None`: no such job.
    ///
    /// # Errors
    /// What the database says.
    pub async fn cancel(&self, id: JobId) -> Result<Option<Cancelled>, StoreError> {
        self.write(id, |context, id, tx| {
            Box::pin(async {
                let Some(row) = sqlx::query(super::lists::JOB_BY_ID).bind(id.bytes()).fetch_optional(&mut *tx).await?
                else {
                    return Ok(Written::undo(None));
                };
                let found = Box::new(job(&row)?);
                let row = match found.state {
                    State::Cancelled => return Ok(Written::undo(Some(Cancelled::Ended(found)))),
                    State::Succeeded | State::Failed => return Ok(Written::undo(Some(Cancelled::TooLate(found)))),
                    State::Queued => {
                        let end_seq = next_end(tx).await?;
                        let cancel = sqlx::query(CANCEL_QUEUED).bind(id.bytes());
                        cancel.bind(context.clock.wall_us()).bind(end_seq).fetch_one(&mut *tx).await?
                    }
                    State::Running if found.cancel_requested => {
                        return Ok(Written::undo(Some(Cancelled::Requested(found))));
                    }
                    State::Running => sqlx::query(CANCEL_RUNNING).bind(id.bytes()).fetch_one(&mut *tx).await?,
                };
                let changed = Box::new(job(&row)?);
                let change = changed.change();
                let done = if changed.state.has_ended() { Cancelled::Ended } else { Cancelled::Requested };
                Ok(Written::keep(Some(done(changed))).changing([change]))
            })
        })
        .await
    }

    /// Removes an ended job, its results, and the bytes that nothing else points to.
    ///
    /// # Errors
    /// What the database says.
    pub async fn remove_job(&self, id: JobId) -> Result<Removal, StoreError> {
        let store = self.clone();
        // In a task of its own: the job is forgotten also when the caller goes away between the commit and its answer.
        let removed = tokio::spawn(async move {
            let removed = store.remove(id).await;
            store.0.ended.forget(id);
            removed
        });
        removed.await.unwrap_or(Err(StoreError::Interrupted))
    }

    async fn remove(&self, id: JobId) -> Result<Removal, StoreError> {
        self.write(id, |_, id, tx| {
            Box::pin(async {
                let Some(row) = sqlx::query(super::lists::JOB_BY_ID).bind(id.bytes()).fetch_optional(&mut *tx).await?
                else {
                    return Ok(Written::undo(Removal::Absent));
                };
                let found = job(&row)?;
                if !found.state.has_ended() {
                    return Ok(Written::undo(Removal::InUse));
                }
                let rows =
                    sqlx::query("SELECT blob FROM results WHERE job = ?1").bind(found.seq).fetch_all(&mut *tx).await?;
                let mut digests = Vec::with_capacity(rows.len());
                for row in &rows {
                    digests.push(Digest::from_bytes(row.try_get("blob")?)?);
                }
                // Results, labels and idempotency keys go with the row (ON DELETE CASCADE).
                sqlx::query("DELETE FROM jobs WHERE seq = ?1").bind(found.seq).execute(&mut *tx).await?;
                remove_orphans(tx, &digests).await?;
                Ok(Written::keep(Removal::Removed))
            })
        })
        .await
    }
}

/// Ends a running job within a transaction; `None` when the holder (id, attempt, token) holds it no more.
pub(super) async fn end(
    context: &Context,
    tx: &mut SqliteConnection,
    (id, attempt, token): (&[u8], u32, &[u8]),
    ending: &Ending,
    timings: Option<&Value>,
) -> Result<Option<Job>, StoreError> {
    let (state, problem, verdict, resolved) = match ending {
        Ending::Succeeded { verdict, resolved, .. } => (State::Succeeded, None, verdict.as_deref(), resolved.as_ref()),
        Ending::Failed { problem, resolved, .. } => (State::Failed, Some(problem), None, resolved.as_ref()),
        Ending::Cancelled => (State::Cancelled, None, None, None),
    };
    let end_seq = next_end(tx).await?;
    let row = sqlx::query(END)
        .bind(id)
        .bind(attempt)
        .bind(token)
        .bind(state.name())
        .bind(problem.map(Value::to_string))
        .bind(verdict)
        .bind(resolved.map(Value::to_string))
        .bind(timings.map(Value::to_string))
        .bind(context.clock.wall_us())
        .bind(end_seq)
        .fetch_optional(&mut *tx)
        .await?;
    row.as_ref().map(job).transpose()
}

async fn next_end(tx: &mut SqliteConnection) -> Result<i64, StoreError> {
    Ok(sqlx::query(NEXT_END).fetch_one(&mut *tx).await?.try_get("value")?)
}
