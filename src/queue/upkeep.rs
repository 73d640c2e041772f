//! What goes on beside the workers: leases are renewed, progress written, cancellations carried to the workers, lost
//! jobs taken back, freed room given back.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use tokio::time::{Instant, MissedTickBehavior, interval};

use super::monitor::Stop;
use super::{Phase, Shared};
use crate::store::{Claim, Progress, Reclaim, StoreError};

/// Ticks until the machine has drained.
pub(super) async fn keep_up(shared: Arc<Shared>) {
    let mut phase = shared.phase.subscribe();
    let mut tick = interval(shared.settings.tick_every);
    tick.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let (mut renewed, mut swept, mut tidied) = (Instant::now(), Instant::now(), Instant::now());
    loop {
        tokio::select! {
            _ = tick.tick() => {}
            ended = phase.wait_for(|phase| matches!(phase, Phase::Abandoning | Phase::Drained)) => {
                let _ = ended;
                return;
            }
        }
        let renewal_due = renewed.elapsed() >= shared.settings.renew_every;
        if renewal_due {
            renewed = Instant::now();
        }
        if let Err(error) = look_after(&shared, renewal_due).await {
            tracing::warn!(%error, "leases and progress could not be written; trying again");
        }
        if swept.elapsed() >= shared.settings.sweep_every {
            swept = Instant::now();
            if let Err(error) = sweep(&shared).await {
                tracing::warn!(%error, "lost jobs could not be taken back; trying again");
            }
        }
        if tidied.elapsed() >= shared.settings.tidy_every {
            tidied = Instant::now();
            if let Err(error) = shared.store.tidy().await {
                tracing::warn!(%error, "room could not be given back; trying again");
            }
        }
    }
}

/// Carries cancellations to the workers, counts the stuck, and writes progress and leases that are due.
async fn look_after(shared: &Shared, renewal_due: bool) -> Result<(), StoreError> {
    let now = Instant::now();
    let mut writes: Vec<(u64, Claim, Option<Progress>)> = Vec::new();
    let mut stuck = 0;
    {
        let mut running = shared.running();
        if running.is_empty() {
            shared.stuck.store(0, Ordering::Relaxed);
            return Ok(());
        }
        for (&number, run) in running.iter_mut() {
            if run.monitor.stopped().is_some() {
                let since = *run.stopped_at.get_or_insert(now);
                stuck += u64::from(now.duration_since(since) >= shared.settings.stuck_after);
            }
            let progress = run.monitor.progress();
            let moved = progress != run.written && now.duration_since(run.written_at) >= shared.settings.progress_every;
            if moved {
                run.written = progress.clone();
                run.written_at = now;
            }
            if moved || renewal_due {
                writes.push((number, run.claim.clone(), moved.then_some(progress)));
            }
        }
    }
    shared.stuck.store(stuck, Ordering::Relaxed);
    for (id, attempt) in shared.store.unwanted().await? {
        shared.stop_job(id, Some(attempt), Stop::Cancelled);
    }
    if writes.is_empty() {
        return Ok(());
    }
    let numbers: Vec<u64> = writes.iter().map(|(number, ..)| *number).collect();
    let claims = writes.into_iter().map(|(_, claim, progress)| (claim, progress)).collect();
    let held = shared.store.renew(claims, shared.settings.lease).await?;
    let running = shared.running();
    for (number, held) in numbers.into_iter().zip(held) {
        if let Some(run) = running.get(&number)
            && !held
        {
            run.monitor.stop(Stop::Lost);
        }
    }
    Ok(())
}

/// Takes back jobs whose lease has run out.
async fn sweep(shared: &Shared) -> Result<(), StoreError> {
    let most = shared.settings.most_attempts;
    let taken = shared.store.reclaim(Reclaim::Expired, most, super::crashed(most)).await?;
    if taken.requeued > 0 {
        tracing::warn!(requeued = taken.requeued, failed = taken.failed, "leases ran out; the jobs run again");
    }
    Ok(())
}
