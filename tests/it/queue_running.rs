//! The machine at work: jobs run, fail, panic, are cancelled, time out, and are tried again only where that can help.

use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use planish::queue::{Cancelled, EnqueueError, Queue, Settings, State};
use planish::store::{Digest, NewSurface};
use serde_json::json;

use crate::support::queue::{LONG, Puppet, ended, enqueue, new_job, open, running, settings, surface};
use crate::support::{assert_whole, raw};

/// Limits of time are asserted at ten times what is promised: the tests may run on a laden machine.
const SLACK: u32 = 10;

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_job_runs_and_its_results_can_be_read() {
    let directory = tempfile::tempdir().unwrap();
    let store = open(directory.path()).await;
    let surface = surface(&store).await;
    let queue = Queue::start(store.clone(), Puppet::new(), settings()).await.unwrap();
    let id = enqueue(&queue, &surface, json!({ "do": "finish" })).await;
    let job = ended(&queue, id).await;
    assert_eq!(job.state, State::Succeeded);
    assert_eq!((job.attempt, job.progress, job.end_seq), (1, 1.0, Some(1)));
    assert_eq!(job.verdict.as_deref(), Some("unchecked"));
    assert_eq!(job.resolved, Some(json!({ "resolved": { "do": "finish" } })));
    let timings = job.timings.unwrap();
    assert!(timings["queued"].as_f64().unwrap() >= 0.0);
    assert!(timings["total"].as_f64().unwrap() >= timings["preparation"].as_f64().unwrap());
    let names: Vec<String> = store.results(id).await.unwrap().into_iter().map(|result| result.name).collect();
    assert_eq!(names, ["mesh", "report"]);
    let (meta, bytes) = store.result(id, "mesh").await.unwrap().unwrap();
    assert_eq!(bytes, r#"mesh of {"do":"finish"}"#);
    assert_eq!(meta.digest, Digest::of(&bytes));
    assert!(store.result(id, "pattern").await.unwrap().is_none());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn r5_only_what_can_end_otherwise_is_tried_again() {
    let directory = tempfile::tempdir().unwrap();
    let store = open(directory.path()).await;
    let surface = surface(&store).await;
    let queue = Queue::start(store.clone(), Puppet::new(), settings()).await.unwrap();
    let cases = [
        ("fail", State::Failed, 1, Some("triangle-flipped")),
        ("panic", State::Failed, 1, Some("panicked")),
        ("falter", State::Failed, 3, Some("storage-failed")),
        ("falter once", State::Succeeded, 2, None),
        ("finish", State::Succeeded, 1, None),
    ];
    for (what, state, attempts, code) in cases {
        let id = enqueue(&queue, &surface, json!({ "do": what })).await;
        let job = ended(&queue, id).await;
        assert_eq!((job.state, job.attempt), (state, attempts), "{what}");
        assert_eq!(job.problem.as_ref().and_then(|problem| problem["code"].as_str()), code, "{what}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_a_failed_job_had_of_a_result_can_be_read() {
    let directory = tempfile::tempdir().unwrap();
    let store = open(directory.path()).await;
    let surface = surface(&store).await;
    let queue = Queue::start(store.clone(), Puppet::new(), settings()).await.unwrap();
    let id = enqueue(&queue, &surface, json!({ "do": "fail" })).await;
    assert_eq!(ended(&queue, id).await.state, State::Failed);
    assert_eq!(store.result(id, "mesh").await.unwrap().unwrap().1, "what there is");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn r7_a_waiting_job_is_cancelled_at_once_and_a_running_one_within_a_second() {
    let directory = tempfile::tempdir().unwrap();
    let store = open(directory.path()).await;
    let surface = surface(&store).await;
    let puppet = Puppet::new();
    let queue =
        Queue::start(store, puppet.clone(), Settings { workers: 1, light_workers: 0, ..settings() }).await.unwrap();
    let runs = enqueue(&queue, &surface, json!({ "do": "wait for cancellation" })).await;
    running(&queue, runs).await;
    let waits = enqueue(&queue, &surface, json!({ "do": "finish" })).await;

    let cancelled = queue.cancel(waits).await.unwrap().unwrap();
    assert!(matches!(&cancelled, Cancelled::Ended(job) if job.state == State::Cancelled && job.attempt == 0));
    assert!(matches!(queue.cancel(waits).await.unwrap().unwrap(), Cancelled::Ended(_)), "again is harmless");

    let since = Instant::now();
    assert!(matches!(queue.cancel(runs).await.unwrap().unwrap(), Cancelled::Requested(_)));
    let job = ended(&queue, runs).await;
    assert!(since.elapsed() < Duration::from_secs(1) * SLACK, "{:?}", since.elapsed());
    assert_eq!(job.state, State::Cancelled);
    assert!(job.problem.is_none());
    assert!(job.timings.unwrap()["seed_search"].as_f64().unwrap() > 0.0);
    assert!(queue.store().results(runs).await.unwrap().is_empty(), "a cancelled job has no results");
    assert_eq!(puppet.started.load(Ordering::SeqCst), 1, "the waiting job was never started");

    let done = enqueue(&queue, &surface, json!({ "do": "finish" })).await;
    ended(&queue, done).await;
    assert!(matches!(queue.cancel(done).await.unwrap().unwrap(), Cancelled::TooLate(_)));
    assert!(queue.cancel(planish::queue::JobId::fresh()).await.unwrap().is_none());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_cancellation_that_was_accepted_stands_even_if_the_work_ends_first() {
    let directory = tempfile::tempdir().unwrap();
    let store = open(directory.path()).await;
    let surface = surface(&store).await;
    let puppet = Puppet::new();
    let queue = Queue::start(store, puppet.clone(), settings()).await.unwrap();
    let id = enqueue(&queue, &surface, json!({ "do": "wait at the gate" })).await;
    running(&queue, id).await;
    assert!(matches!(queue.cancel(id).await.unwrap().unwrap(), Cancelled::Requested(_)));
    puppet.gate.open();
    let job = ended(&queue, id).await;
    assert_eq!((job.state, job.verdict, job.problem), (State::Cancelled, None, None));
    assert!(queue.store().results(id).await.unwrap().is_empty());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn r8_an_attempt_that_takes_too_long_is_stopped_and_given_up_after_the_last() {
    let directory = tempfile::tempdir().unwrap();
    let store = open(directory.path()).await;
    let surface = surface(&store).await;
    let settings = Settings { timeout: Duration::from_millis(30), ..settings() };
    let queue = Queue::start(store, Puppet::new(), settings).await.unwrap();
    let id = enqueue(&queue, &surface, json!({ "do": "wait for cancellation" })).await;
    let job = ended(&queue, id).await;
    assert_eq!((job.state, job.attempt), (State::Failed, 3));
    assert_eq!(job.problem.unwrap()["code"], "timed-out");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn r8_an_attempt_that_does_not_stop_is_counted_as_stuck() {
    let directory = tempfile::tempdir().unwrap();
    let store = open(directory.path()).await;
    let surface = surface(&store).await;
    let puppet = Puppet::new();
    let settings = Settings { stuck_after: Duration::from_millis(50), ..settings() };
    let queue = Queue::start(store, puppet.clone(), settings).await.unwrap();
    let id = enqueue(&queue, &surface, json!({ "do": "wait at the gate" })).await;
    running(&queue, id).await;
    assert_eq!(queue.counts().await.unwrap().stuck, 0);
    queue.cancel(id).await.unwrap();
    tokio::time::timeout(LONG, async {
        while queue.counts().await.unwrap().stuck != 1 {
            tokio::task::yield_now().await;
        }
    })
    .await
    .expect("it is counted");
    puppet.gate.open();
    assert_eq!(ended(&queue, id).await.state, State::Cancelled);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn r19_a_panic_in_a_job_fails_that_job_only() {
    let directory = tempfile::tempdir().unwrap();
    let store = open(directory.path()).await;
    let surface = surface(&store).await;
    let queue = Queue::start(store, Puppet::new(), settings()).await.unwrap();
    let mut jobs = Vec::new();
    for what in ["panic", "finish", "panic in a scope", "finish", "panic in a detached task", "finish"] {
        jobs.push((what, enqueue(&queue, &surface, json!({ "do": what })).await));
    }
    for (what, id) in jobs {
        let job = ended(&queue, id).await;
        // A detached task is not waited for; its panic is logged and the work itself is done.
        let panicked = matches!(what, "panic" | "panic in a scope");
        assert_eq!(job.state, if panicked { State::Failed } else { State::Succeeded }, "{what}");
        if panicked {
            let problem = job.problem.unwrap();
            assert_eq!(problem["code"], "panicked");
            assert!(!problem.to_string().contains("as asked"), "the message is for the log, not for the client");
        }
    }
    assert_eq!(queue.counts().await.unwrap().failed, 2);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn progress_and_stage_can_be_read_while_a_job_runs() {
    let directory = tempfile::tempdir().unwrap();
    let store = open(directory.path()).await;
    let surface = surface(&store).await;
    let queue = Queue::start(store, Puppet::new(), settings()).await.unwrap();
    let mut changes = queue.subscribe();
    let id = enqueue(&queue, &surface, json!({ "do": "wait for cancellation" })).await;
    let (mut revision, mut job) = (0, queue.get(id).await.unwrap().unwrap());
    tokio::time::timeout(LONG, async {
        while job.progress != 0.5 {
            let change = changes.recv().await.unwrap();
            assert!(change.revision > revision, "revisions grow");
            revision = change.revision;
            job = queue.get(id).await.unwrap().unwrap();
        }
    })
    .await
    .expect("progress is written");
    assert_eq!(job.stage.as_deref(), Some("seed_search"));
    queue.cancel(id).await.unwrap();
    ended(&queue, id).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn waiting_ends_with_the_job_or_with_the_time_and_knows_what_is_not_there() {
    let directory = tempfile::tempdir().unwrap();
    let store = open(directory.path()).await;
    let surface = surface(&store).await;
    let puppet = Puppet::new();
    let queue = Queue::start(store, puppet.clone(), settings()).await.unwrap();
    let id = enqueue(&queue, &surface, json!({ "do": "wait at the gate" })).await;
    let job = queue.wait_until_ended(id, Duration::from_millis(20)).await.unwrap().unwrap();
    assert!(!job.state.has_ended());
    let waiters: Vec<_> = (0..100)
        .map(|_| {
            let queue = queue.clone();
            tokio::spawn(async move { queue.wait_until_ended(id, Duration::MAX).await.unwrap().unwrap() })
        })
        .collect();
    puppet.gate.open();
    for waiter in waiters {
        assert_eq!(tokio::time::timeout(LONG, waiter).await.unwrap().unwrap().state, State::Succeeded);
    }
    let nothing = planish::queue::JobId::fresh();
    assert!(queue.wait_until_ended(nothing, LONG).await.unwrap().is_none());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_job_for_a_surface_that_is_not_there_is_not_accepted() {
    let directory = tempfile::tempdir().unwrap();
    let store = open(directory.path()).await;
    let queue = Queue::start(store, Puppet::new(), settings()).await.unwrap();
    let nowhere = NewSurface::new("nowhere".into(), "application/json", "nurbs", "mm", json!({})).id().clone();
    let refused = queue.enqueue(new_job(&nowhere, json!({}))).await.unwrap_err();
    assert!(matches!(refused, EnqueueError::NoSurface(id) if id == nowhere));
    assert_eq!(queue.counts().await.unwrap().queued, 0);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_result_that_cannot_be_stored_fails_its_job_and_no_other() {
    let directory = tempfile::tempdir().unwrap();
    let store = open(directory.path()).await;
    let surface = surface(&store).await;
    let queue = Queue::start(store.clone(), Puppet::new(), settings()).await.unwrap();
    let mut raw = raw(directory.path()).await;
    let refuse = "CREATE TRIGGER fault AFTER INSERT ON results WHEN NEW.name = 'report' \
         BEGIN SELECT RAISE(ABORT, 'this write fails'); END";
    sqlx::query(refuse).execute(&mut raw).await.unwrap();
    let id = enqueue(&queue, &surface, json!({ "do": "finish" })).await;
    let job = ended(&queue, id).await;
    assert_eq!((job.state, job.attempt), (State::Failed, 1));
    assert_eq!(job.problem.unwrap()["code"], "storage-failed");
    assert!(store.results(id).await.unwrap().is_empty(), "half a result is none");
    sqlx::query("DROP TRIGGER fault").execute(&mut raw).await.unwrap();
    let next = enqueue(&queue, &surface, json!({ "do": "finish" })).await;
    assert_eq!(ended(&queue, next).await.state, State::Succeeded);
    queue.drain(LONG).await;
    store.close().await.unwrap();
    assert_whole(&mut raw).await;
}
