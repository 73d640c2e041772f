//! Results and the bytes they point to.

use std::collections::BTreeMap;

use bytes::Bytes;
use sqlx::{QueryBuilder, Row, Sqlite, SqliteConnection};

use super::{Digest, JobId, MAX_PAGE, Store, StoreError};

/// A result to be stored. Making one digests its bytes, so it is made where the work is done, not on an async thread.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NewResult {
    /// Its name: `mesh`, `pattern`, `report`, ...
    pub name: String,
    /// The media type of the stored form.
    pub media: String,
    /// The bytes.
    pub bytes: Bytes,
    digest: Digest,
}

impl NewResult {
    /// Digests the bytes.
    #[must_use]
    pub fn new(name: impl Into<String>, media: impl Into<String>, bytes: impl Into<Bytes>) -> Self {
        let bytes = bytes.into();
        Self { name: name.into(), media: media.into(), digest: Digest::of(&bytes), bytes }
    }

    /// The digest of the bytes.
    #[must_use]
    pub const fn digest(&self) -> Digest {
        self.digest
    }
}

/// A stored result without its bytes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StoredResult {
    /// Its name.
    pub name: String,
    /// The media type of the stored form.
    pub media: String,
    /// How many bytes.
    pub length: u64,
    /// Their digest.
    pub digest: Digest,
}

pub(super) const RESULTS: &str = "SELECT r.name, r.media, b.length, b.digest FROM jobs AS j \
     JOIN results AS r ON r.job = j.seq JOIN blobs AS b ON b.digest = r.blob WHERE j.id = ?1 ORDER BY r.name";
pub(super) const RESULT: &str = "SELECT r.name, r.media, b.length, b.digest, b.bytes FROM jobs AS j \
     JOIN results AS r ON r.job = j.seq JOIN blobs AS b ON b.digest = r.blob WHERE j.id = ?1 AND r.name = ?2";

impl Store {
    /// What a job has stored, by name.
    ///
    /// # Errors
    /// What the database says.
    pub async fn results(&self, id: JobId) -> Result<Vec<StoredResult>, StoreError> {
        let rows = sqlx::query(RESULTS).bind(id.bytes()).fetch_all(&self.0.readers).await?;
        rows.iter().map(stored).collect()
    }

    /// What these jobs (by their `seq`, at most [`MAX_PAGE`] of them) have stored, by name.
    ///
    /// # Errors
    /// What the database says.
    pub async fn results_of(&self, jobs: &[i64]) -> Result<BTreeMap<i64, Vec<StoredResult>>, StoreError> {
        let mut found = BTreeMap::<i64, Vec<StoredResult>>::new();
        if jobs.is_empty() {
            return Ok(found);
        }
        for row in &results_of(jobs).build().fetch_all(&self.0.readers).await? {
            found.entry(row.try_get("job")?).or_default().push(stored(row)?);
        }
        Ok(found)
    }

    /// One result with its bytes. The statement has ended when this returns: a slow client holds nothing up.
    ///
    /// # Errors
    /// What the database says.
    pub async fn result(&self, id: JobId, name: &str) -> Result<Option<(StoredResult, Bytes)>, StoreError> {
        let row = sqlx::query(RESULT).bind(id.bytes()).bind(name).fetch_optional(&self.0.readers).await?;
        row.map(|row| Ok((stored(&row)?, Bytes::from(row.try_get::<Vec<u8>, _>("bytes")?)))).transpose()
    }
}

fn results_of(jobs: &[i64]) -> QueryBuilder<Sqlite> {
    let mut sql = QueryBuilder::new(
        "SELECT r.job, r.name, r.media, b.length, b.digest FROM results AS r JOIN blobs AS b ON b.digest = r.blob \
         WHERE r.job IN (",
    );
    let mut list = sql.separated(", ");
    for job in jobs.iter().take(MAX_PAGE as usize) {
        list.push_bind(*job);
    }
    sql.push(") ORDER BY r.job, r.name");
    sql
}

fn stored(row: &sqlx::sqlite::SqliteRow) -> Result<StoredResult, StoreError> {
    Ok(StoredResult {
        name: row.try_get("name")?,
        media: row.try_get("media")?,
        length: row.try_get::<i64, _>("length")?.unsigned_abs(),
        digest: Digest::from_bytes(row.try_get("digest")?)?,
    })
}

pub(super) async fn insert_blob(tx: &mut SqliteConnection, digest: Digest, bytes: &Bytes) -> Result<(), StoreError> {
    sqlx::query("INSERT INTO blobs (digest, length, bytes) VALUES (?1, ?2, ?3) ON CONFLICT (digest) DO NOTHING")
        .bind(digest.bytes())
        .bind(i64::try_from(bytes.len()).unwrap_or(i64::MAX))
        .bind(bytes.as_ref())
        .execute(&mut *tx)
        .await?;
    Ok(())
}

pub(super) async fn insert_result(tx: &mut SqliteConnection, job: i64, result: &NewResult) -> Result<(), StoreError> {
    insert_blob(tx, result.digest, &result.bytes).await?;
    sqlx::query("INSERT INTO results (job, name, media, blob) VALUES (?1, ?2, ?3, ?4)")
        .bind(job)
        .bind(&result.name)
        .bind(&result.media)
        .bind(result.digest.bytes())
        .execute(&mut *tx)
        .await?;
    Ok(())
}

/// Removes those of these blobs to which nothing points any more.
pub(super) async fn remove_orphans(tx: &mut SqliteConnection, digests: &[Digest]) -> Result<(), StoreError> {
    for digest in digests {
        sqlx::query(
            "DELETE FROM blobs WHERE digest = ?1 \
             AND NOT EXISTS (SELECT 1 FROM results WHERE blob = ?1) \
             AND NOT EXISTS (SELECT 1 FROM surfaces WHERE content = ?1)",
        )
        .bind(digest.bytes())
        .execute(&mut *tx)
        .await?;
    }
    Ok(())
}
