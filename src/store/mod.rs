//! All SQL: surfaces, jobs, results, and their bytes, in SQLite under one data directory.
//!
//! # How it is kept
//! - One connection that writes (WAL, `synchronous = FULL`: a commit is on the disk) and a pool of four that read.
//!   Writes are made by one [task](writer) in `BEGIN IMMEDIATE` transactions with nothing but SQL inside; those that wait
//!   at the same time share a commit. A caller that goes away half-way leaves no transaction open.
//! - A lock file keeps a second process out of the directory. A *boot* number names this process in the leases that it
//!   takes: rows that still run under another boot are those of a process that died.
//! - Bytes lie in a table of their own under their blake3 digest; rows that are listed stay small. A blob goes with the
//!   last row that points to it.
//! - The rules of the job machine are constraints and triggers of the schema (`migrations/`), so a fault in the code
//!   cannot put a job into a state that does not exist.
//!
//! Every committed change of a job is told to those who [subscribed](Store::changes).
//! Nothing here knows HTTP or geometry; JSON goes in and out as it came.

mod ended;
mod endings;
mod enqueue;
mod error;
mod ids;
mod leases;
mod lists;
mod migrations;
#[cfg(test)]
mod plans;
mod results;
mod rows;
mod surfaces;
mod writer;

use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use sqlx::sqlite::{
    SqliteAutoVacuum, SqliteConnectOptions, SqliteJournalMode, SqlitePool, SqlitePoolOptions, SqliteSynchronous,
};
use sqlx::{AssertSqlSafe, ConnectOptions as _};
use tokio::sync::broadcast;
use uuid::Uuid;

pub use ended::{EndedJob, Standing};
pub use endings::{Cancelled, Committed, Ending, Removal};
pub use enqueue::{EnqueueError, Enqueued, IDEMPOTENCY_KEPT, IdempotencyKey, NewJob};
pub use error::StoreError;
pub use ids::{Digest, JobId, NotAnId, SurfaceId};
pub use leases::{Claim, Lane, Progress, Reclaim, Reclaimed};
pub use lists::{JobFilter, MAX_PAGE, Open, StateEvent};
pub use results::{NewResult, StoredResult};
pub use rows::{Change, Job, Lasted, State};
pub use surfaces::{NewSurface, Surface};
pub use writer::Wish;

use crate::clock::Clock;
use crate::telemetry::Metrics;
use writer::{Context, Write, Writer, Written};

/// Connections that read. More than the cores of a small server, few enough that each can keep its page cache.
const READERS: u32 = 4;
/// How long a statement waits for another process's lock before it fails with [`StoreError::Busy`].
const BUSY_TIMEOUT: Duration = Duration::from_secs(5);
/// How long a caller waits for a connection that reads before it fails with [`StoreError::Busy`].
const ACQUIRE_TIMEOUT: Duration = Duration::from_secs(10);
/// Changes that a slow subscriber may lag behind before it is told to look for itself.
const CHANGES_KEPT: usize = 1024;
/// Pages given back to the file system at a time, 4 MiB: long enough to matter, short enough not to hold up a claim.
const VACUUM_PAGES: &str = "PRAGMA incremental_vacuum(1024)";

const DATABASE_FILE: &str = "planish.db";
const LOG_FILE: &str = "planish.db-wal";
const LOCK_FILE: &str = "planish.lock";

/// The open data directory; clones share it.
#[derive(Debug, Clone)]
pub struct Store(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    writer: Writer,
    readers: SqlitePool,
    context: Arc<Context>,
    ended: ended::EndedJobs,
    directory: PathBuf,
    /// Held as long as the store is open; the system lets go of it when the process dies, however it dies.
    lock: File,
}

impl Store {
    /// Opens the data directory, makes it if it is not there, and brings its database to the newest schema.
    ///
    /// # Errors
    /// [`StoreError::InUse`] when another process has it open, [`StoreError::NewerSchema`] when a newer program wrote it.
    pub async fn open(directory: &Path, clock: Clock) -> Result<Self, StoreError> {
        let lock = lock(directory)?;
        let options = SqliteConnectOptions::new()
            .filename(directory.join(DATABASE_FILE))
            .busy_timeout(BUSY_TIMEOUT)
            .foreign_keys(true);
        let mut connection = options
            .clone()
            .create_if_missing(true)
            .auto_vacuum(SqliteAutoVacuum::Incremental)
            .journal_mode(SqliteJournalMode::Wal)
            .synchronous(SqliteSynchronous::Full)
            .connect()
            .await?;
        migrations::migrate(&mut connection).await?;
        let readers = SqlitePoolOptions::new()
            .max_connections(READERS)
            .acquire_timeout(ACQUIRE_TIMEOUT)
            .idle_timeout(None)
            .max_lifetime(None)
            // A connection to a file does not go away between two statements.
            .test_before_acquire(false)
            .connect_with(options.read_only(true).pragma("query_only", "ON"))
            .await?;
        let (changes, _) = broadcast::channel(CHANGES_KEPT);
        let context = Arc::new(Context {
            boot: Uuid::now_v7(),
            clock,
            changes,
            metrics: Metrics::new(),
            commits: AtomicU64::new(0),
        });
        let writer = Writer::start(connection, context.clone());
        let ended = ended::EndedJobs::new();
        Ok(Self(Arc::new(Inner { writer, readers, context, ended, directory: directory.to_owned(), lock })))
    }

    /// Writes the log back into the database and closes it. Whoever still holds a clone gets errors from now on.
    ///
    /// # Errors
    /// [`StoreError::Sql`] when the log could not be written back; nothing is lost by that, the next start does it.
    pub async fn close(&self) -> Result<(), StoreError> {
        // First the readers: a reader's snapshot would keep the log from being emptied.
        self.0.readers.close().await;
        self.0.writer.close().await?;
        let unlock = |source| StoreError::Directory { path: self.0.directory.join(LOCK_FILE), source };
        self.0.lock.unlock().map_err(unlock)
    }

    /// Whether the database can be read and written: what readiness asks.
    ///
    /// # Errors
    /// What stands in the way.
    pub async fn ping(&self) -> Result<(), StoreError> {
        sqlx::query("SELECT value FROM counters WHERE name = 'end_seq'").fetch_one(&self.0.readers).await?;
        // A transaction that is begun and undone.
        self.write((), |_, (), _| Box::pin(async { Ok::<_, StoreError>(Written::undo(())) })).await
    }

    /// Gives room of deleted rows back to the file system, a little at a time.
    ///
    /// # Errors
    /// What the database says.
    pub async fn tidy(&self) -> Result<(), StoreError> {
        self.write((), |_, (), tx| {
            Box::pin(async {
                sqlx::query(VACUUM_PAGES).execute(tx).await?;
                Ok::<_, StoreError>(Written::keep(()))
            })
        })
        .await
    }

    /// Every committed change of a job from now on. A receiver that lags is told so and reads the rows themselves.
    #[must_use]
    pub fn changes(&self) -> broadcast::Receiver<Change> {
        self.0.context.changes.subscribe()
    }

    /// Transactions that were committed since the start: fewer than writes, which share them.
    #[must_use]
    pub fn commits(&self) -> u64 {
        self.0.context.commits.load(Ordering::Relaxed)
    }

    /// Bounds the database's size, in pages of 4 KiB: what would make it larger fails with [`StoreError::Full`] as on a
    /// full disk. Below the present size: no growth at all.
    ///
    /// # Errors
    /// What the database says.
    pub async fn bound_pages(&self, most: u32) -> Result<(), StoreError> {
        self.write(most, |_, &most, tx| {
            Box::pin(async move {
                sqlx::query(AssertSqlSafe(format!("PRAGMA max_page_count = {most}"))).execute(tx).await?;
                Ok::<_, StoreError>(Written::keep(()))
            })
        })
        .await
    }

    /// How the service has done since it started.
    #[must_use]
    pub fn metrics(&self) -> &Metrics {
        &self.0.context.metrics
    }

    /// How long the database's file and its log are, bytes.
    ///
    /// # Errors
    /// What the system says.
    pub async fn size(&self) -> Result<(u64, u64), StoreError> {
        let path = self.0.directory.join(DATABASE_FILE);
        let fault = |source| StoreError::Directory { path: path.clone(), source };
        let file = tokio::fs::metadata(&path).await.map_err(fault)?.len();
        // The log is made with the first write and may be gone after it was written back.
        let log = tokio::fs::metadata(self.0.directory.join(LOG_FILE)).await.map_or(0, |meta| meta.len());
        Ok((file, log))
    }

    /// The clock by which rows are stamped.
    #[must_use]
    pub fn clock(&self) -> &Clock {
        &self.0.context.clock
    }

    /// The data directory.
    #[must_use]
    pub fn directory(&self) -> &Path {
        &self.0.directory
    }

    /// Makes a write; see [`writer`].
    async fn write<D, T, E>(&self, data: D, write: Write<D, T, E>) -> Result<T, E>
    where
        D: Send + Sync + 'static,
        T: Send + 'static,
        E: From<StoreError> + Send + 'static,
    {
        let begun = Instant::now();
        let answer = self.0.writer.write(data, write).await;
        self.0.context.metrics.written(begun.elapsed());
        answer
    }
}

fn lock(directory: &Path) -> Result<File, StoreError> {
    let fault = |path: &Path| {
        let path = path.to_owned();
        move |source| StoreError::Directory { path, source }
    };
    std::fs::create_dir_all(directory).map_err(fault(directory))?;
    let path = directory.join(LOCK_FILE);
    let file = File::options().create(true).truncate(false).read(true).write(true).open(&path).map_err(fault(&path))?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => Err(StoreError::InUse(directory.to_owned())),
        Err(TryLockError::Error(error)) => Err(fault(&path)(error)),
    }
}
