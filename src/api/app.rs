//! What every handler has at hand, and the way to work that would hold up the async threads.

use std::sync::Arc;
use std::time::Duration;

use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio_util::sync::CancellationToken;

use super::problem::{Kind, Problem};
use super::request::{BodyLimits, Wait};
use super::results::{Heads, Renderings};
use crate::config::Settings;
use crate::queue::Queue;
use crate::store::{Job, JobId, Store};

/// How long a request waits for a thread to parse or to write on before it is told to come again.
const THREAD_PATIENCE: Duration = Duration::from_secs(20);
/// What it is told to wait.
const RETRY_S: u32 = 5;
/// How often a stream of events that has nothing to say shows that it is there: well under the minute after which
/// proxies cut a silent connection.
const HEARTBEAT: Duration = Duration::from_secs(15);

/// The state of the service; clones share it.
#[derive(Debug, Clone)]
pub struct App(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    store: Store,
    queue: Queue,
    bodies: BodyLimits,
    threads: Semaphore,
    streams: Arc<Semaphore>,
    most_streams: usize,
    heartbeat: Duration,
    heads: Heads,
    renderings: Renderings,
    draining: CancellationToken,
}

impl App {
    /// Serves this store and queue. When `draining` is cancelled nothing new is taken, and those who wait are answered.
    #[must_use]
    pub fn new(store: Store, queue: Queue, settings: &Settings, draining: CancellationToken) -> Self {
        let bodies =
            BodyLimits::new(settings.max_body(), settings.max_uploads(), Duration::from_secs(settings.body_timeout_s));
        // Parsing shares the cores with the geometry: as many at a time as there are workers.
        let threads = Semaphore::new(settings.worker_count());
        let streams = Arc::new(Semaphore::new(settings.max_streams));
        // A connection on which nothing moves is closed: two signs of life come before that.
        let heartbeat = HEARTBEAT.min(Duration::from_secs(settings.idle_timeout_s) / 2);
        let renderings = Renderings::new(settings.cache());
        Self(Arc::new(Inner {
            store,
            queue,
            bodies,
            threads,
            streams,
            most_streams: settings.max_streams,
            heartbeat,
            heads: Heads::new(),
            renderings,
            draining,
        }))
    }

    /// The store.
    #[must_use]
    pub fn store(&self) -> &Store {
        &self.0.store
    }

    /// The queue.
    #[must_use]
    pub fn queue(&self) -> &Queue {
        &self.0.queue
    }

    /// Bounds on bodies.
    #[must_use]
    pub(crate) fn bodies(&self) -> &BodyLimits {
        &self.0.bodies
    }

    /// How many forms of results were written or compressed so far: what was answered from memory does not count.
    #[must_use]
    pub fn forms_written(&self) -> u64 {
        self.renderings().written()
    }

    /// Heads of answers with results that are kept in memory.
    #[must_use]
    pub(crate) fn heads(&self) -> &Heads {
        &self.0.heads
    }

    /// Forms of results that are kept in memory.
    #[must_use]
    pub(crate) fn renderings(&self) -> &Renderings {
        &self.0.renderings
    }

    /// Cancelled when the service shuts down.
    #[must_use]
    pub fn draining(&self) -> &CancellationToken {
        &self.0.draining
    }

    /// Refuses new work while the service shuts down.
    ///
    /// # Errors
    /// 503.
    pub(crate) fn admit(&self) -> Result<(), Problem> {
        if self.0.draining.is_cancelled() {
            return Err(Problem::new(Kind::Draining, "The service is shutting down and takes nothing new.")
                .retry_after(RETRY_S));
        }
        Ok(())
    }

    /// A place for a stream of events, which is held as long as the stream goes on.
    ///
    /// # Errors
    /// 503 when all are taken, or while the service shuts down.
    pub(crate) fn stream(&self) -> Result<OwnedSemaphorePermit, Problem> {
        self.admit()?;
        Arc::clone(&self.0.streams).try_acquire_owned().map_err(|_| {
            Problem::new(Kind::Overloaded, "As many streams of events as may be are open. Poll the job instead.")
                .retry_after(RETRY_S)
        })
    }

    /// How many streams of events are open.
    #[must_use]
    pub(crate) fn streams_open(&self) -> u64 {
        (self.0.most_streams - self.0.streams.available_permits()) as u64
    }

    /// How often a stream of events shows that it is there.
    #[must_use]
    pub(crate) fn heartbeat(&self) -> Duration {
        self.0.heartbeat
    }

    /// A job when it has ended, or as it stands when the wait is over or the service shuts down. `None`: no such job.
    ///
    /// # Errors
    /// What the store says.
    pub(crate) async fn ended(&self, id: JobId, wait: Wait) -> Result<Option<Job>, Problem> {
        let waiting = self.queue().wait_until_ended(id, wait.duration());
        match self.0.draining.run_until_cancelled(waiting).await {
            Some(job) => Ok(job?),
            None => Ok(self.store().job(id).await?),
        }
    }

    /// Does work that takes long (parsing, writing a result) on a thread of its own, a bounded number at a time.
    ///
    /// # Errors
    /// What the work says; 503 when no thread came free; 500 when it panicked.
    pub(crate) async fn on_a_thread<T: Send + 'static>(
        &self,
        work: impl FnOnce() -> Result<T, Problem> + Send + 'static,
    ) -> Result<T, Problem> {
        let app = self.clone();
        let slot = tokio::time::timeout(THREAD_PATIENCE, self.0.threads.acquire()).await;
        let Ok(Ok(slot)) = slot else {
            return Err(Problem::new(Kind::Overloaded, "The service is busy with other requests.").retry_after(RETRY_S));
        };
        slot.forget();
        let done = tokio::task::spawn_blocking(move || {
            // The place is given back when the work has ended, also when nobody waits for it any more.
            let _place = Place(app);
            work()
        })
        .await;
        done.unwrap_or_else(|fault| {
            tracing::error!(%fault, "work for a request panicked");
            Err(Problem::internal())
        })
    }
}

/// A place among the threads.
struct Place(App);

impl Drop for Place {
    fn drop(&mut self) {
        self.0.0.threads.add_permits(1);
    }
}
