//! Leases: who holds a job may write to it, and no one else, whatever the clocks do.

use std::sync::Arc;
use std::time::Duration;

use planish::clock::{Clock, FakeClock};
use planish::engine::budget::Observer;
use planish::queue::{Failed, Finished, NewResult, Queue, Runner, Settings, State, Task};
use planish::store::{Committed, Ending, Lane, Progress, Reclaim, Reclaimed, Store};
use serde_json::json;

use crate::support::queue::{Gate, LONG, ended, enqueue, new_job, running, settings, surface};

const LEASE: Duration = Duration::from_secs(30);
const HOUR_US: i64 = 3_600_000_000;

async fn store_at_a_fake_hour(directory: &std::path::Path) -> (Store, FakeClock) {
    let (clock, hand) = Clock::fake(1_700_000_000_000_000);
    (Store::open(directory, clock).await.unwrap(), hand)
}

/// Each attempt waits at a gate of its own; its result tells which it was.
#[derive(Default)]
struct Sleeper([Gate; 2]);

impl Runner for Sleeper {
    fn run(&self, task: &Task, _: &dyn Observer) -> Result<Finished, Failed> {
        self.0[task.attempt as usize - 1].wait();
        let result = NewResult::new("report", "text/plain", format!("attempt {}", task.attempt));
        Ok(Finished { results: vec![result], ..Finished::default() })
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn r2_a_worker_that_sleeps_past_its_lease_writes_nothing_when_it_wakes() {
    let directory = tempfile::tempdir().unwrap();
    let (store, hand) = store_at_a_fake_hour(directory.path()).await;
    let surface = surface(&store).await;
    let runner = Arc::new(Sleeper::default());
    let never = Duration::from_hours(1);
    let one = Settings { workers: 1, light_workers: 0, lease: LEASE, ..settings() };
    let asleep = Settings { renew_every: never, sweep_every: never, progress_every: never, ..one.clone() };
    let first = Queue::start(store.clone(), runner.clone(), asleep).await.unwrap();
    let id = enqueue(&first, &surface, json!({})).await;
    running(&first, id).await;

    let awake = Settings { sweep_every: Duration::ZERO, ..one };
    let second = Queue::start(store.clone(), runner.clone(), awake).await.unwrap();
    let mut changes = store.changes();
    assert_eq!(store.job(id).await.unwrap().unwrap().attempt, 1, "the lease still holds");
    hand.advance(LEASE + Duration::from_millis(1));
    // Back in the queue, then claimed by the second machine.
    for state in [State::Queued, State::Running] {
        assert_eq!(tokio::time::timeout(LONG, changes.recv()).await.unwrap().unwrap().state, state);
    }

    // The first wakes while the second is at work, and has then written, or tried to, all that it ever will.
    runner.0[0].open();
    first.drain(LONG).await;
    let job = store.job(id).await.unwrap().unwrap();
    assert_eq!((job.state, job.attempt), (State::Running, 2), "the late worker changed nothing");
    assert!(store.results(id).await.unwrap().is_empty());

    runner.0[1].open();
    let job = ended(&second, id).await;
    assert_eq!((job.state, job.attempt, job.end_seq), (State::Succeeded, 2, Some(1)));
    assert_eq!(store.result(id, "report").await.unwrap().unwrap().1, "attempt 2");
    second.drain(LONG).await;
}

#[tokio::test]
async fn r2_every_write_of_a_lost_claim_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let (store, hand) = store_at_a_fake_hour(directory.path()).await;
    let surface = surface(&store).await;
    store.enqueue(new_job(&surface, json!({})), Lane::Light, 10).await.unwrap();
    let lost = store.claim(true, LEASE).await.unwrap().unwrap();
    hand.advance(LEASE);
    let taken = store.reclaim(Reclaim::Expired, 3, json!({})).await.unwrap();
    assert_eq!(taken, Reclaimed { requeued: 1, ..Reclaimed::default() });
    for held in [false, true] {
        // Also while another worker holds the job, not only while it waits.
        let holder = if held { store.claim(true, LEASE).await.unwrap() } else { None };
        let before = store.job(lost.job.id).await.unwrap().unwrap();
        let progress = Progress { fraction: 0.9, stage: Some("tracing"), remaining_ms: Some(7) };
        assert_eq!(store.renew(vec![(lost.clone(), Some(progress))], LEASE).await.unwrap(), [false]);
        assert!(!store.give_back(lost.clone(), true).await.unwrap());
        let results = vec![NewResult::new("mesh", "text/plain", "late")];
        let ending = Ending::Succeeded { results, verdict: None, resolved: None };
        assert_eq!(store.finish(&lost, ending, None).await.unwrap(), Committed::Lost);
        assert_eq!(store.job(lost.job.id).await.unwrap().unwrap(), before);
        assert!(store.results(lost.job.id).await.unwrap().is_empty());
        assert_eq!(holder.is_some(), held);
    }
}

#[tokio::test]
async fn r4_a_lease_lost_for_the_third_time_fails_the_job_as_crashed() {
    let directory = tempfile::tempdir().unwrap();
    let (store, hand) = store_at_a_fake_hour(directory.path()).await;
    let surface = surface(&store).await;
    let id = store.enqueue(new_job(&surface, json!({})), Lane::Light, 10).await.unwrap().job().id;
    for attempt in 1..=3 {
        assert_eq!(store.claim(false, LEASE).await.unwrap().unwrap().job.attempt, attempt);
        hand.advance(LEASE);
        let taken = store.reclaim(Reclaim::Expired, 3, json!({ "code": "crashed" })).await.unwrap();
        assert_eq!((taken.requeued, taken.failed), (u64::from(attempt < 3), u64::from(attempt == 3)));
    }
    let job = store.job(id).await.unwrap().unwrap();
    assert_eq!((job.state, job.problem.unwrap()), (State::Failed, json!({ "code": "crashed" })));
}

#[tokio::test]
async fn r20_a_step_of_the_wall_clock_neither_ends_nor_prolongs_a_lease() {
    let directory = tempfile::tempdir().unwrap();
    let (store, hand) = store_at_a_fake_hour(directory.path()).await;
    let surface = surface(&store).await;
    store.enqueue(new_job(&surface, json!({})), Lane::Light, 10).await.unwrap();
    store.claim(true, LEASE).await.unwrap().unwrap();
    let sweep = async || store.reclaim(Reclaim::Expired, 3, json!({})).await.unwrap().requeued;
    hand.step_wall(HOUR_US);
    assert_eq!(sweep().await, 0, "an hour ahead");
    hand.step_wall(-2 * HOUR_US);
    assert_eq!(sweep().await, 0, "an hour back");
    hand.advance(LEASE);
    assert_eq!(sweep().await, 1, "the lease is over although the wall says it has not begun");
}

#[tokio::test]
async fn of_jobs_whose_worker_died_one_runs_at_a_time_and_others_go_on_beside_it() {
    let directory = tempfile::tempdir().unwrap();
    let (store, hand) = store_at_a_fake_hour(directory.path()).await;
    let surface = surface(&store).await;
    let mut ids = Vec::new();
    for _ in 0..3 {
        ids.push(store.enqueue(new_job(&surface, json!({})), Lane::Light, 10).await.unwrap().job().id);
    }
    for _ in 0..2 {
        store.claim(false, LEASE).await.unwrap().unwrap();
    }
    hand.advance(LEASE);
    assert_eq!(store.reclaim(Reclaim::Expired, 3, json!({})).await.unwrap().requeued, 2);
    let suspect = store.claim(false, LEASE).await.unwrap().unwrap();
    assert_eq!(suspect.job.id, ids[0]);
    assert_eq!(store.claim(true, LEASE).await.unwrap().unwrap().job.id, ids[2], "the one that was never at a death");
    assert_eq!(store.claim(false, LEASE).await.unwrap(), None, "the other suspect waits");
    store.finish(&suspect, Ending::Cancelled, None).await.unwrap();
    assert_eq!(store.claim(false, LEASE).await.unwrap().unwrap().job.id, ids[1]);
}
