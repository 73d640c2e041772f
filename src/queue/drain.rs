//! Stopping with grace: no new claims, time for what runs, then a release that loses no attempt.

use std::sync::atomic::Ordering;
use std::time::Duration;

use tokio::time::timeout;

use super::monitor::Stop;
use super::{Phase, Queue};

/// How a drain went.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Drained {
    /// Jobs that were told to stop because the grace was over.
    pub interrupted: u64,
    /// Of these, jobs that did not stop: released all the same, their threads left to the end of the process.
    pub abandoned: u64,
}

impl Queue {
    /// Stops claiming and accepting, waits up to `grace` for what runs, tells the rest to stop, and puts it back into
    /// the queue with its attempt not counted. Afterwards no job of this machine runs; waiting jobs wait for the next
    /// start. A second call waits for the first.
    pub async fn drain(&self, grace: Duration) -> Drained {
        let shared = &self.0;
        let first = shared.phase.send_if_modified(|phase| {
            let open = *phase == Phase::Open;
            if open {
                *phase = Phase::Draining;
            }
            open
        });
        shared.tasks.close();
        if !first {
            shared.tasks.wait().await;
            return Drained::default();
        }
        let mut drained = Drained::default();
        if timeout(grace, shared.tasks.wait()).await.is_err() {
            // Before the list is gone through: an attempt that is not on it yet sees the phase when it gets there.
            shared.phase.send_replace(Phase::Stopping);
            for run in shared.running().values().filter(|run| run.monitor.stopped().is_none()) {
                run.monitor.stop(Stop::Draining);
                shared.interrupted.fetch_add(1, Ordering::Relaxed);
            }
            if timeout(shared.settings.release_after, shared.tasks.wait()).await.is_err() {
                drained.abandoned = shared.running().len() as u64;
                shared.phase.send_replace(Phase::Abandoning);
                shared.tasks.wait().await;
            }
        }
        drained.interrupted = shared.interrupted.load(Ordering::Relaxed);
        shared.phase.send_replace(Phase::Drained);
        tracing::info!(interrupted = drained.interrupted, abandoned = drained.abandoned, "the queue is drained");
        drained
    }
}
