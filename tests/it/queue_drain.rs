//! R9, the queue's half: stopping with grace.

use std::sync::atomic::Ordering;
use std::time::Duration;

use planish::queue::{Drained, EnqueueError, Queue, Settings, State};
use serde_json::json;

use crate::support::queue::{LONG, Puppet, ended, enqueue, new_job, open, running, settings, surface};
use crate::support::{assert_whole, raw};

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn r9_what_ends_within_the_grace_ends_and_what_waits_goes_on_waiting() {
    let directory = tempfile::tempdir().unwrap();
    let store = open(directory.path()).await;
    let surface = surface(&store).await;
    let puppet = Puppet::new();
    let one = Settings { workers: 1, light_workers: 0, ..settings() };
    let queue = Queue::start(store.clone(), puppet.clone(), one.clone()).await.unwrap();
    let runs = enqueue(&queue, &surface, json!({ "do": "wait at the gate" })).await;
    running(&queue, runs).await;
    let waits = enqueue(&queue, &surface, json!({ "do": "finish" })).await;
    let draining = tokio::spawn({
        let queue = queue.clone();
        async move { queue.drain(LONG).await }
    });
    while queue.is_open() {
        tokio::task::yield_now().await;
    }
    let refused = queue.enqueue(new_job(&surface, json!({}))).await.unwrap_err();
    assert!(matches!(refused, EnqueueError::Draining), "{refused}");
    puppet.gate.open();
    assert_eq!(draining.await.unwrap(), Drained::default());
    assert_eq!(queue.drain(LONG).await, Drained::default(), "a second call is harmless");
    assert_eq!(queue.get(runs).await.unwrap().unwrap().state, State::Succeeded);
    let left = queue.get(waits).await.unwrap().unwrap();
    assert_eq!((left.state, left.attempt), (State::Queued, 0), "no claim after the drain began");
    assert_eq!(puppet.started.load(Ordering::SeqCst), 1);

    store.close().await.unwrap();
    let log = directory.path().join("planish.db-wal");
    assert!(std::fs::metadata(&log).map_or(0, |meta| meta.len()) == 0, "the log was not written back");
    let store = open(directory.path()).await;
    let queue = Queue::start(store, puppet, one).await.unwrap();
    assert_eq!(ended(&queue, waits).await.state, State::Succeeded);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn r9_what_outlasts_the_grace_is_released_without_losing_an_attempt() {
    let directory = tempfile::tempdir().unwrap();
    let store = open(directory.path()).await;
    let surface = surface(&store).await;
    let puppet = Puppet::new();
    let queue = Queue::start(store.clone(), puppet.clone(), settings()).await.unwrap();
    let stops = enqueue(&queue, &surface, json!({ "do": "wait for cancellation" })).await;
    let deaf = enqueue(&queue, &surface, json!({ "do": "wait at the gate" })).await;
    running(&queue, stops).await;
    running(&queue, deaf).await;
    // Claimed is not begun: a claim that has not got as far is given back without being told to stop.
    while puppet.started.load(Ordering::SeqCst) < 2 {
        tokio::task::yield_now().await;
    }
    let drained = queue.drain(Duration::ZERO).await;
    assert_eq!(drained, Drained { interrupted: 2, abandoned: 1 });
    for id in [stops, deaf] {
        let job = queue.get(id).await.unwrap().unwrap();
        assert_eq!((job.state, job.attempt, job.end_seq), (State::Queued, 0, None));
    }
    // Where the abandoned thread ends after all, its result finds no claim to go with.
    puppet.gate.open();
    let again = Queue::start(store.clone(), puppet, settings()).await.unwrap();
    let job = ended(&again, deaf).await;
    assert_eq!((job.state, job.attempt), (State::Succeeded, 1));
    again.cancel(stops).await.unwrap();
    ended(&again, stops).await;
    again.drain(LONG).await;
    store.close().await.unwrap();
    assert_whole(&mut raw(directory.path()).await).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn r9_a_job_that_is_cancelled_while_the_service_stops_ends_cancelled() {
    let directory = tempfile::tempdir().unwrap();
    let store = open(directory.path()).await;
    let surface = surface(&store).await;
    let queue = Queue::start(store, Puppet::new(), settings()).await.unwrap();
    let id = enqueue(&queue, &surface, json!({ "do": "wait at the gate" })).await;
    running(&queue, id).await;
    queue.cancel(id).await.unwrap();
    assert_eq!(queue.drain(Duration::ZERO).await.abandoned, 1);
    assert_eq!(queue.get(id).await.unwrap().unwrap().state, State::Cancelled);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn r9_a_job_that_is_claimed_while_the_grace_ends_is_told_to_stop_as_well() {
    // The moment between a claim and the first step of its work is short: many rounds meet it.
    for _ in 0..20 {
        let directory = tempfile::tempdir().unwrap();
        let store = open(directory.path()).await;
        let surface = surface(&store).await;
        let queue = Queue::start(store.clone(), Puppet::new(), settings()).await.unwrap();
        let stops = enqueue(&queue, &surface, json!({ "do": "wait for cancellation" })).await;
        running(&queue, stops).await;
        assert_eq!(queue.drain(Duration::ZERO).await.abandoned, 0, "a job that listens was not told");
        let job = queue.get(stops).await.unwrap().unwrap();
        assert_eq!((job.state, job.attempt), (State::Queued, 0));
        store.close().await.unwrap();
    }
}
