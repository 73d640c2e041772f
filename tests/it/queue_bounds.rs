//! The machine under load: what is accepted is bounded and all of it ends; small jobs get through; results do not depend
//! on the number of threads.

use std::path::Path;
use std::sync::Arc;

use planish::engine::budget::Observer;
use planish::queue::{EnqueueError, Failed, Finished, NewJob, NewResult, Queue, Runner, Settings, State, Task};
use planish::store::{JobFilter, Lane, Store};
use rayon::prelude::*;
use serde_json::json;

use crate::support::queue::{LONG, Puppet, ended, enqueue, new_job, open, running, settings, surface};

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn r11_a_full_queue_refuses_and_everything_it_accepted_ends() {
    const ROOM: u64 = 20;
    let directory = tempfile::tempdir().unwrap();
    let store = open(directory.path()).await;
    let surface = surface(&store).await;
    let puppet = Puppet::new();
    let settings = Settings { workers: 1, light_workers: 0, most_waiting: ROOM, ..settings() };
    let queue = Queue::start(store.clone(), puppet.clone(), settings).await.unwrap();
    let first = enqueue(&queue, &surface, json!({ "do": "wait at the gate" })).await;
    running(&queue, first).await;
    let requests: Vec<_> = (0..3 * ROOM)
        .map(|_| {
            let (queue, new) = (queue.clone(), new_job(&surface, json!({ "do": "finish" })));
            tokio::spawn(async move { queue.enqueue(new).await })
        })
        .collect();
    let (mut accepted, mut refused) = (vec![first], 0);
    for request in requests {
        match request.await.unwrap() {
            Ok(enqueued) => accepted.push(enqueued.job().id),
            Err(EnqueueError::QueueFull { waiting }) => {
                assert_eq!(waiting, ROOM);
                refused += 1;
            }
            Err(other) => panic!("{other}"),
        }
    }
    assert_eq!((accepted.len() as u64, refused), (ROOM + 1, 2 * ROOM));
    assert_eq!(queue.counts().await.unwrap().queued, ROOM);
    puppet.gate.open();
    for id in &accepted {
        assert_eq!(ended(&queue, *id).await.state, State::Succeeded);
    }
    assert_eq!(store.feed(&JobFilter::default(), 0, 1000).await.unwrap().len(), accepted.len());
    // Room again.
    enqueue(&queue, &surface, json!({ "do": "finish" })).await;
}

/// Resident memory of this process in bytes, where the system tells.
fn resident() -> Option<u64> {
    let statm = std::fs::read_to_string("/proc/self/statm").ok()?;
    Some(statm.split_whitespace().nth(1)?.parse::<u64>().ok()? * 4096)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn r10_ten_thousand_waiting_jobs_take_no_memory_to_speak_of() {
    let directory = tempfile::tempdir().unwrap();
    let store = open(directory.path()).await;
    let surface = surface(&store).await;
    let puppet = Puppet::new();
    let queue = Queue::start(store.clone(), puppet.clone(), Settings { workers: 1, light_workers: 0, ..settings() })
        .await
        .unwrap();
    let first = enqueue(&queue, &surface, json!({ "do": "wait at the gate" })).await;
    running(&queue, first).await;
    let before = resident();
    for n in 0..10_000 {
        // The store's own way in: ten thousand commits of one row each would measure the disk.
        let new = new_job(&surface, json!({ "do": "finish", "n": n }));
        store.enqueue(new, Lane::Heavy, 20_000).await.unwrap();
    }
    assert_eq!(queue.counts().await.unwrap().queued, 10_000);
    if let (Some(before), Some(after)) = (before, resident()) {
        let grown = after.saturating_sub(before);
        assert!(grown < 64 << 20, "{grown} bytes for ten thousand waiting jobs");
    }
    let refused = queue.enqueue(new_job(&surface, json!({}))).await.unwrap_err();
    assert!(matches!(refused, EnqueueError::QueueFull { waiting: 10_000 }), "{refused}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn small_jobs_get_through_while_large_ones_fill_the_workers() {
    let directory = tempfile::tempdir().unwrap();
    let store = open(directory.path()).await;
    let surface = surface(&store).await;
    let puppet = Puppet::new();
    let queue = Queue::start(store, puppet.clone(), settings()).await.unwrap();
    let large = || NewJob { cost: u64::MAX, ..new_job(&surface, json!({ "do": "wait at the gate" })) };
    let mut larges = Vec::new();
    for _ in 0..5 {
        larges.push(queue.enqueue(large()).await.unwrap().job().id);
    }
    running(&queue, larges[0]).await;
    running(&queue, larges[1]).await;
    for _ in 0..3 {
        let small = enqueue(&queue, &surface, json!({ "do": "finish" })).await;
        assert_eq!(ended(&queue, small).await.state, State::Succeeded);
    }
    let states = async |state| queue.store().count(state).await.unwrap();
    assert_eq!((states(State::Running).await, states(State::Queued).await), (2, 3));
    puppet.gate.open();
    for id in larges {
        assert_eq!(ended(&queue, id).await.state, State::Succeeded);
    }
}

/// A sum in a fixed order over work done on whatever threads there are.
struct Summer;

impl Runner for Summer {
    fn run(&self, task: &Task, _: &dyn Observer) -> Result<Finished, Failed> {
        let n = task.parameters["n"].as_u64().unwrap_or_default();
        let terms: Vec<f64> = (1..=n).into_par_iter().map(|k| (k as f64).sqrt().sin() / k as f64).collect();
        let sum: f64 = terms.iter().sum();
        let bytes = [sum.to_le_bytes().as_slice(), task.content.as_ref()].concat();
        Ok(Finished {
            results: vec![NewResult::new("report", "application/octet-stream", bytes)],
            ..Finished::default()
        })
    }
}

async fn digest(directory: &Path, threads: usize) -> planish::store::Digest {
    let store: Store = open(directory).await;
    let surface = surface(&store).await;
    let settings = Settings { threads, light_cost: 0, ..settings() };
    let queue = Queue::start(store.clone(), Arc::new(Summer), settings).await.unwrap();
    let id = enqueue(&queue, &surface, json!({ "n": 100_000 })).await;
    assert_eq!(ended(&queue, id).await.state, State::Succeeded);
    let digest = store.results(id).await.unwrap()[0].digest;
    queue.drain(LONG).await;
    digest
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn r13_a_result_comes_back_in_the_same_bytes_with_any_number_of_threads() {
    let mut digests = Vec::new();
    for threads in [1, 2, 8] {
        let directory = tempfile::tempdir().unwrap();
        digests.push(digest(directory.path(), threads).await);
    }
    assert_eq!(digests[0], digests[1]);
    assert_eq!(digests[0], digests[2]);
}
