//! One worker: claims a job, runs it on its threads, and writes how it ended.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use rayon::ThreadPool;
use tokio::sync::oneshot;
use tokio::time::sleep;

use super::monitor::{Monitor, Stop};
use super::pool::{self, Outcome};
use super::runner::{Failed, FailureClass, Task, problem};
use super::{Phase, Shared};
use crate::store::{Claim, Committed, Ending, Lane, State, StoreError};

/// Times that a result is offered to a locked database before the attempt is left to its lease.
const COMMIT_TRIES: u32 = 5;
/// Pause between them; the store has waited five seconds each time.
const COMMIT_PAUSE: Duration = Duration::from_millis(200);

/// Works until the machine drains.
pub(super) async fn work(shared: Arc<Shared>, lane: Lane, pool: ThreadPool) {
    let mut phase = shared.phase.subscribe();
    while *phase.borrow_and_update() == Phase::Open {
        let mut wish = shared.store.wish(lane == Lane::Light, shared.settings.lease);
        let claimed = tokio::select! {
            claimed = wish.granted() => claimed,
            // Jobs become claimable in ways that make no new work too, such as the end of one that crashed before.
            () = sleep(shared.settings.poll_every) => wish.withdrawn().await,
            _ = phase.changed() => wish.withdrawn().await,
        };
        match claimed {
            Ok(Some(claim)) => run(&shared, claim, &pool).await,
            Ok(None) => {}
            Err(error) => {
                tracing::warn!(%error, "no job could be claimed; trying again");
                tokio::select! {
                    () = sleep(shared.settings.poll_every) => {}
                    _ = phase.changed() => {}
                }
            }
        }
    }
}

async fn run(shared: &Arc<Shared>, claim: Claim, pool: &ThreadPool) {
    if *shared.phase.borrow() != Phase::Open {
        give_back(shared, claim, false).await;
        return;
    }
    let content = match shared.store.surface_content(&claim.job.surface).await {
        Ok(Some(content)) => content,
        Ok(None) => {
            let gone = problem("surface-gone", "The surface is gone", "The surface of this job is no longer stored.");
            commit(shared, &claim, Ending::Failed { problem: gone, results: Vec::new(), resolved: None }, None).await;
            return;
        }
        Err(error) => {
            tracing::warn!(job = %claim.job.id, %error, "the surface could not be read");
            let unread = problem("storage-failed", "The surface could not be read", "Reading from storage failed.");
            retry(shared, claim, unread, None).await;
            return;
        }
    };
    let (surface, content) = content;
    let task = Task {
        job: claim.job.id,
        attempt: claim.job.attempt,
        kind: claim.job.kind.clone(),
        surface,
        content,
        parameters: claim.job.parameters.clone(),
        labels: claim.job.labels.clone(),
    };
    let monitor = Arc::new(Monitor::new(shared.store.clock().clone()));
    let since = shared.store.clock().steady_us();
    let running = shared.register(claim.clone(), monitor.clone());
    shared.stop_if_late(&monitor);
    let outcome = pool::spawn(pool, shared.runner.clone(), task, monitor.clone());
    let outcome = watch(shared, &monitor, outcome).await;
    drop(running);
    let Some(outcome) = outcome else {
        // It does not stop. Its lease is given back; what it may still bring will find its claim gone.
        tracing::warn!(job = %claim.job.id, "released without waiting for its worker");
        give_back(shared, claim, false).await;
        return;
    };
    let waited = claim.job.started_us.unwrap_or(claim.job.created_us) - claim.job.created_us;
    let timings = monitor.timings(waited, shared.store.clock().steady_us() - since);
    conclude(shared, claim, outcome, &monitor, timings).await;
}

/// Waits for the attempt's outcome; tells it to stop when its time is up; `None` when the machine waits no longer.
async fn watch(shared: &Shared, monitor: &Monitor, mut outcome: oneshot::Receiver<Outcome>) -> Option<Outcome> {
    let mut phase = shared.phase.subscribe();
    let deadline = sleep(shared.settings.timeout);
    tokio::pin!(deadline);
    loop {
        tokio::select! {
            outcome = &mut outcome => {
                // The sender is dropped unused only when the closure itself unwound.
                return Some(outcome.unwrap_or_else(|_| Outcome::Panicked("the worker's thread unwound".to_owned())));
            }
            () = &mut deadline, if monitor.stopped().is_none() => monitor.stop(Stop::TimedOut),
            abandoned = phase.wait_for(|phase| *phase == Phase::Abandoning) => {
                let _ = abandoned;
                return None;
            }
        }
    }
}

async fn conclude(shared: &Shared, claim: Claim, outcome: Outcome, monitor: &Monitor, timings: serde_json::Value) {
    let failed = match outcome {
        Outcome::Returned(Ok(done)) => {
            let ending = Ending::Succeeded { results: done.results, verdict: done.verdict, resolved: done.parameters };
            commit(shared, &claim, ending, Some(timings)).await;
            return;
        }
        Outcome::Returned(Err(failed)) => failed,
        Outcome::Panicked(message) => {
            tracing::error!(job = %claim.job.id, message, "the job panicked");
            let detail = "The program met a fault of its own while it worked on this job. Other jobs are not affected.";
            Failed {
                problem: problem("panicked", "A fault in the program", detail),
                results: Vec::new(),
                parameters: None,
                class: FailureClass::Deterministic,
            }
        }
    };
    match (failed.class, monitor.stopped()) {
        (FailureClass::Interrupted, Some(Stop::Cancelled)) => {
            commit(shared, &claim, Ending::Cancelled, Some(timings)).await;
        }
        (FailureClass::Interrupted, Some(Stop::Draining)) => give_back(shared, claim, false).await,
        (FailureClass::Interrupted, Some(Stop::Lost)) => {}
        (FailureClass::Interrupted, Some(Stop::TimedOut)) => {
            let limit = shared.settings.timeout.as_secs_f64();
            let detail =
                format!("The job did not end within {limit} s. A coarser triangulation or a given seed takes less.");
            retry(shared, claim, problem("timed-out", "The job took too long", &detail), Some(timings)).await;
        }
        (FailureClass::Transient, _) => retry(shared, claim, failed.problem, Some(timings)).await,
        (FailureClass::Deterministic, _) | (FailureClass::Interrupted, None) => {
            let ending =
                Ending::Failed { problem: failed.problem, results: failed.results, resolved: failed.parameters };
            commit(shared, &claim, ending, Some(timings)).await;
        }
    }
}

/// Puts the job back for another attempt, or ends it with `problem` when none is left.
async fn retry(shared: &Shared, claim: Claim, problem: serde_json::Value, timings: Option<serde_json::Value>) {
    if claim.job.attempt >= shared.settings.most_attempts {
        commit(shared, &claim, Ending::Failed { problem, results: Vec::new(), resolved: None }, timings).await;
        return;
    }
    let mut phase = shared.phase.subscribe();
    tokio::select! {
        () = sleep(shared.settings.retry_pause) => {}
        _ = phase.wait_for(|phase| *phase != Phase::Open) => {}
    }
    give_back(shared, claim, true).await;
}

/// Puts a claimed job back, or ends it cancelled where that was asked for meanwhile.
async fn give_back(shared: &Shared, claim: Claim, attempt_counts: bool) {
    match shared.store.give_back(claim.clone(), attempt_counts).await {
        Ok(true) => {}
        Ok(false) => commit(shared, &claim, Ending::Cancelled, None).await,
        Err(error) => tracing::error!(job = %claim.job.id, %error, "not given back; its lease will run out"),
    }
}

/// Writes the ending. Where the disk is full or refuses the result, the job fails with that as its reason; where the
/// database stays locked, the attempt is left to its lease and will be made again.
async fn commit(shared: &Shared, claim: &Claim, ending: Ending, timings: Option<serde_json::Value>) {
    let mut ending = ending;
    for _ in 0..COMMIT_TRIES {
        match shared.store.finish(claim, ending.clone(), timings.clone()).await {
            Ok(Committed::Ended(job)) => {
                tracing::info!(job = %job.id, state = %job.state, attempt = job.attempt, "the job ended");
                if job.state == State::Failed {
                    shared.failed.fetch_add(1, Ordering::Relaxed);
                }
                return;
            }
            Ok(Committed::Lost) => {
                tracing::warn!(job = %claim.job.id, attempt = claim.job.attempt, "a late result was not written");
                return;
            }
            Err(StoreError::Busy) => sleep(COMMIT_PAUSE).await,
            Err(StoreError::Interrupted) => return,
            Err(error) => {
                tracing::error!(job = %claim.job.id, %error, "the result could not be written");
                let (code, title) = match error {
                    StoreError::Full => ("storage-full", "There is no room for the result"),
                    _ => ("storage-failed", "The result could not be stored"),
                };
                let problem = problem(code, title, "The work was done, but storing its result failed.");
                ending = Ending::Failed { problem, results: Vec::new(), resolved: None };
            }
        }
    }
    tracing::error!(job = %claim.job.id, "the ending could not be written; the job will run again");
}
