//! The durable job machine: accepted jobs are on disk, run by workers under leases, and end exactly once.
//!
//! ```text
//! queued ----> running ----> succeeded | failed | cancelled
//!   |    <----    |
//!   +--------> cancelled
//! ```
//! A running job goes back to `queued` when its process dies, its lease runs out, a transient fault is met, or the service
//! stops; the attempt, counted when it is claimed, stays counted save in the last case. After the last attempt it fails
//! with the code `crashed`, so an input that kills the process cannot do so for ever. A deterministic failure is never
//! tried again. A cancellation that was accepted always ends in `cancelled`.
//!
//! Each [`worker`] has threads of its own; small jobs have workers that take nothing else. [Upkeep](upkeep) renews
//! leases, writes progress and carries cancellations. Limits: one process per data directory (the store sees to it);
//! stopping is cooperative, an attempt that never asks its observer runs on and counts as stuck.
//! Nothing here knows HTTP; the work itself is a [`Runner`].

mod drain;
mod engine_runner;
mod monitor;
mod pool;
mod runner;
mod settings;
mod upkeep;
mod worker;

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use serde_json::Value;
use tokio::sync::{broadcast, watch};
use tokio::time::{Instant, timeout_at};
use tokio_util::task::TaskTracker;

pub use drain::Drained;
pub use engine_runner::{EngineRunner, problem};
pub use runner::{Failed, FailureClass, Finished, Runner, Task};
pub use settings::Settings;

pub use crate::store::{
    Cancelled, Change, EnqueueError, Enqueued, IdempotencyKey, Job, JobId, NewJob, NewResult, State,
};

use crate::store::{Claim, Lane, NewSurface, Progress, Reclaim, Store, StoreError};
use monitor::{Monitor, Stop};

/// Longest that a caller waits for a job, however long it asks for: a time that can be added to any other.
const LONGEST_WAIT: Duration = Duration::from_hours(24);

/// The running machine; clones are handles to the same one.
#[derive(Debug, Clone)]
pub struct Queue(Arc<Shared>);

/// Why the machine did not start.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StartError {
    /// The store failed.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The workers' threads could not be made.
    #[error("the workers' threads could not be started: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

/// How the machine stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Jobs that wait.
    pub queued: u64,
    /// Jobs that run.
    pub running: u64,
    /// Attempts that were told to stop and have not done so for long.
    pub stuck: u64,
    /// Jobs that ended failed since the start.
    pub failed: u64,
    /// Workers, of both lanes.
    pub workers: u64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// Jobs are accepted and claimed.
    Open,
    /// Nothing is accepted or claimed any more; what runs goes on.
    Draining,
    /// The grace is over: what runs is told to stop, also what was claimed before and begins only now.
    Stopping,
    /// What still runs is released without waiting for it.
    Abandoning,
    /// No worker is left.
    Drained,
}

struct Shared {
    store: Store,
    runner: Arc<dyn Runner>,
    settings: Settings,
    phase: watch::Sender<Phase>,
    running: Mutex<BTreeMap<u64, Running>>,
    numbers: AtomicU64,
    stuck: AtomicU64,
    interrupted: AtomicU64,
    failed: AtomicU64,
    tasks: TaskTracker,
}

impl std::fmt::Debug for Shared {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Queue").field("settings", &self.settings).finish_non_exhaustive()
    }
}

/// An attempt that runs in this process.
struct Running {
    claim: Claim,
    monitor: Arc<Monitor>,
    written: Progress,
    written_at: Instant,
    stopped_at: Option<Instant>,
}

impl Queue {
    /// Takes back what ran when the last process died, then starts the workers.
    ///
    /// # Errors
    /// [`StartError`].
    pub async fn start(store: Store, runner: Arc<dyn Runner>, settings: Settings) -> Result<Self, StartError> {
        let settings = settings.sound();
        let most = settings.most_attempts;
        let taken = store.reclaim(Reclaim::OtherBoots, most, crashed(most)).await?;
        if taken != crate::store::Reclaimed::default() {
            tracing::warn!(
                requeued = taken.requeued,
                failed = taken.failed,
                cancelled = taken.cancelled,
                "the last process died while jobs ran"
            );
        }
        let mut pools = Vec::new();
        for worker in 0..settings.workers {
            pools.push((Lane::Heavy, pool::pool(worker, settings.threads)?));
        }
        for worker in 0..settings.light_workers {
            pools.push((Lane::Light, pool::pool(settings.workers + worker, 1)?));
        }
        let shared = Arc::new(Shared {
            store,
            runner,
            settings,
            phase: watch::channel(Phase::Open).0,
            running: Mutex::default(),
            numbers: AtomicU64::new(0),
            stuck: AtomicU64::new(0),
            interrupted: AtomicU64::new(0),
            failed: AtomicU64::new(0),
            tasks: TaskTracker::new(),
        });
        for (lane, pool) in pools {
            shared.tasks.spawn(worker::work(shared.clone(), lane, pool));
        }
        tokio::spawn(upkeep::keep_up(shared.clone()));
        Ok(Self(shared))
    }

    /// Accepts a job. When this returns it is on disk, and will be run whatever happens to this process.
    ///
    /// # Errors
    /// [`EnqueueError`]; nothing is stored then.
    pub async fn enqueue(&self, new: NewJob) -> Result<Enqueued, EnqueueError> {
        let lane = self.lane(&new)?;
        self.0.store.enqueue(new, lane, self.0.settings.most_waiting).await
    }

    /// Accepts a job that comes with its surface: both are stored at once, or neither.
    ///
    /// # Errors
    /// [`EnqueueError`]; nothing is stored then.
    pub async fn enqueue_with_surface(&self, surface: NewSurface, new: NewJob) -> Result<Enqueued, EnqueueError> {
        let lane = self.lane(&new)?;
        self.0.store.enqueue_with_surface(surface, new, lane, self.0.settings.most_waiting).await
    }

    /// The lane of a job, while jobs are accepted.
    fn lane(&self, new: &NewJob) -> Result<Lane, EnqueueError> {
        if !self.is_open() {
            return Err(EnqueueError::Draining);
        }
        Ok(if new.cost <= self.0.settings.light_cost { Lane::Light } else { Lane::Heavy })
    }

    /// Cancels a job: at once when it waits; one that runs is told to stop and ends cancelled. `None`: no such job.
    ///
    /// # Errors
    /// What the store says.
    pub async fn cancel(&self, id: JobId) -> Result<Option<Cancelled>, StoreError> {
        let cancelled = self.0.store.cancel(id).await?;
        if let Some(Cancelled::Requested(job)) = &cancelled {
            self.0.stop_job(id, Some(job.attempt), Stop::Cancelled);
        }
        Ok(cancelled)
    }

    /// A job as it stands.
    ///
    /// # Errors
    /// What the store says.
    pub async fn get(&self, id: JobId) -> Result<Option<Job>, StoreError> {
        self.0.store.job(id).await
    }

    /// Waits until the job has ended, at most so long; gives it as it then stands. `None`: no such job.
    ///
    /// # Errors
    /// What the store says.
    pub async fn wait_until_ended(&self, id: JobId, at_most: Duration) -> Result<Option<Job>, StoreError> {
        let at_most = at_most.min(LONGEST_WAIT);
        let deadline = Instant::now() + at_most;
        // Subscribed before the row is read, so no change between the two is missed.
        let mut changes = self.subscribe();
        loop {
            let job = self.get(id).await?;
            if job.as_ref().is_none_or(|job| job.state.has_ended()) || Instant::now() >= deadline {
                return Ok(job);
            }
            loop {
                match timeout_at(deadline, changes.recv()).await {
                    Ok(Ok(change)) if change.id != id || !change.state.has_ended() => {}
                    // It ended, the time is up, or changes were missed: look at the row again.
                    _ => break,
                }
            }
        }
    }

    /// Every committed change of a job from now on.
    #[must_use]
    pub fn subscribe(&self) -> broadcast::Receiver<Change> {
        self.0.store.changes()
    }

    /// How the machine stands.
    ///
    /// # Errors
    /// What the store says.
    pub async fn counts(&self) -> Result<Counts, StoreError> {
        Ok(Counts {
            queued: self.0.store.count(State::Queued).await?,
            running: self.0.store.count(State::Running).await?,
            stuck: self.0.stuck.load(Ordering::Relaxed),
            failed: self.0.failed.load(Ordering::Relaxed),
            workers: (self.0.settings.workers + self.0.settings.light_workers) as u64,
        })
    }

    /// How many workers there are, and how many attempts were told to stop and have not done so for long.
    #[must_use]
    pub fn workers(&self) -> (u64, u64) {
        let workers = (self.0.settings.workers + self.0.settings.light_workers) as u64;
        (workers, self.0.stuck.load(Ordering::Relaxed))
    }

    /// True while jobs are accepted.
    #[must_use]
    pub fn is_open(&self) -> bool {
        *self.0.phase.borrow() == Phase::Open
    }

    /// The store under the machine.
    #[must_use]
    pub fn store(&self) -> &Store {
        &self.0.store
    }
}

impl Shared {
    fn running(&self) -> MutexGuard<'_, BTreeMap<u64, Running>> {
        self.running.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Enters an attempt into the list of those that run; dropping the entry takes it out.
    fn register(self: &Arc<Self>, claim: Claim, monitor: Arc<Monitor>) -> Entry {
        let number = self.numbers.fetch_add(1, Ordering::Relaxed);
        let written = Progress { fraction: 0.0, stage: None, remaining_ms: None };
        let now = Instant::now();
        // The first progress is written at once: a job that takes long says so early.
        let written_at = now.checked_sub(self.settings.progress_every).unwrap_or(now);
        self.running().insert(number, Running { claim, monitor, written, written_at, stopped_at: None });
        Entry { shared: self.clone(), number }
    }

    /// Tells an attempt that has just been registered to stop, when the others were told before it was on the list. Both
    /// go by the lock of the list, so each is told once.
    fn stop_if_late(&self, monitor: &Monitor) {
        let _list = self.running();
        if *self.phase.borrow() == Phase::Stopping && monitor.stopped().is_none() {
            monitor.stop(Stop::Draining);
            self.interrupted.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Tells the attempts at this job, or the one numbered `attempt`, to stop.
    fn stop_job(&self, id: JobId, attempt: Option<u32>, why: Stop) {
        for run in self.running().values() {
            if run.claim.job.id == id && attempt.is_none_or(|attempt| attempt == run.claim.job.attempt) {
                run.monitor.stop(why);
            }
        }
    }
}

/// An attempt's place in the list of those that run.
struct Entry {
    shared: Arc<Shared>,
    number: u64,
}

impl Drop for Entry {
    fn drop(&mut self) {
        self.shared.running().remove(&self.number);
    }
}

/// The problem of a job whose attempts all ended with the process.
fn crashed(attempts: u32) -> Value {
    let detail = format!(
        "The program stopped {attempts} times while it worked on this job, so it is not tried again. \
         The cause is most likely this input."
    );
    runner::problem("crashed", "The job ended the program", &detail)
}
