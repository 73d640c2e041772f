//! The process dies, and nothing that was promised is lost.

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use planish::engine::budget::Observer;
use planish::queue::{Failed, Finished, JobId, Queue, Runner, Settings, State, Task};
use planish::store::JobFilter;
use serde_json::json;
use tokio::runtime::Runtime;

use crate::support::child::{self, Process};
use crate::support::queue::{Gate, LONG, Puppet, ended, enqueue, finished, open, settings, surface};
use crate::support::{assert_whole, raw};

/// Points at which the process is killed.
const KILLS: u64 = 200;

fn runtime() -> Runtime {
    tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build().unwrap()
}

/// A sequence of numbers that look random and are the same in every run (the generator `SplitMix64`).
fn scatter(n: u64) -> u64 {
    let mut z = n.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Accepts jobs without end and tells of each once it is accepted.
async fn accept_without_end(directory: &Path) {
    let store = open(directory).await;
    let surface = surface(&store).await;
    let queue = Queue::start(store, Puppet::new(), settings()).await.unwrap();
    for n in 0.. {
        let id = enqueue(&queue, &surface, json!({ "n": n })).await;
        child::tell(&id.to_string());
    }
}

#[test]
fn r1_a_job_that_was_accepted_is_on_disk_whenever_the_process_is_killed() {
    if let Some(directory) = child::directory() {
        runtime().block_on(accept_without_end(&directory));
        return;
    }
    let directory = tempfile::tempdir().unwrap();
    let test = "queue_crashes::r1_a_job_that_was_accepted_is_on_disk_whenever_the_process_is_killed";
    let mut accepted: Vec<JobId> = Vec::new();
    for kill in 0..KILLS {
        let mut process = Process::start(test, directory.path());
        for _ in 0..=scatter(kill) % 4 {
            accepted.push(process.hear().expect("it accepts until it is killed").parse().unwrap());
        }
        // Anywhere between two acceptances: up to about the time that one takes.
        let until = Instant::now() + Duration::from_micros(scatter(kill + KILLS) % 2_000);
        while Instant::now() < until {
            std::hint::spin_loop();
        }
        process.kill();
    }
    assert!(accepted.len() as u64 >= KILLS);
    runtime().block_on(async {
        let store = open(directory.path()).await;
        for id in &accepted {
            assert!(store.job(*id).await.unwrap().is_some(), "{id} was accepted and is gone");
        }
        // What is left runs to its end, and every job has exactly one.
        let queue = Queue::start(store.clone(), Puppet::new(), settings()).await.unwrap();
        for id in &accepted {
            let job = ended(&queue, *id).await;
            match job.state {
                State::Succeeded => {
                    let (_, mesh) = store.result(*id, "mesh").await.unwrap().unwrap();
                    assert_eq!(mesh, format!("mesh of {}", job.parameters));
                }
                // Three kills can meet the same job.
                State::Failed => assert_eq!((job.attempt, &job.problem.unwrap()["code"]), (3, &json!("crashed"))),
                state => panic!("{id} is {state}"),
            }
        }
        queue.drain(LONG).await;
        let (mut after, mut fed) = (0, 0);
        loop {
            let page = store.feed(&JobFilter::default(), after, 100).await.unwrap();
            let Some(last) = page.last() else { break };
            fed += page.len();
            after = last.end_seq.unwrap();
        }
        assert!(fed >= accepted.len(), "the feed has every ended job");
        store.close().await.unwrap();
        assert_whole(&mut raw(directory.path()).await).await;
    });
}

/// Its first attempt tells that it runs and never ends.
struct HangsOnce;

impl Runner for HangsOnce {
    fn run(&self, task: &Task, _: &dyn Observer) -> Result<Finished, Failed> {
        if task.attempt == 1 {
            child::tell(&task.job.to_string());
            Gate::default().wait();
        }
        Ok(finished(task))
    }
}

#[test]
fn r3_a_kill_in_the_middle_of_a_job_costs_one_attempt_and_the_job_runs_again_at_the_next_start() {
    if let Some(directory) = child::directory() {
        runtime().block_on(async {
            let store = open(&directory).await;
            let surface = surface(&store).await;
            let queue = Queue::start(store, Arc::new(HangsOnce), settings()).await.unwrap();
            enqueue(&queue, &surface, json!({})).await;
            std::future::pending::<()>().await;
        });
        return;
    }
    let directory = tempfile::tempdir().unwrap();
    let test =
        "queue_crashes::r3_a_kill_in_the_middle_of_a_job_costs_one_attempt_and_the_job_runs_again_at_the_next_start";
    let mut process = Process::start(test, directory.path());
    let id: JobId = process.hear().unwrap().parse().unwrap();
    process.kill();
    runtime().block_on(async {
        let store = open(directory.path()).await;
        let left = store.job(id).await.unwrap().unwrap();
        assert_eq!((left.state, left.attempt), (State::Running, 1), "as the dead process left it");
        let since = Instant::now();
        let queue = Queue::start(store.clone(), Arc::new(HangsOnce), settings()).await.unwrap();
        assert_ne!(store.job(id).await.unwrap().unwrap().attempt, 0, "the crash is counted");
        let job = ended(&queue, id).await;
        // Promised are two seconds from the start, asserted ten times that.
        assert!(since.elapsed() < Duration::from_secs(20), "{:?}", since.elapsed());
        assert_eq!((job.state, job.attempt), (State::Succeeded, 2));
        assert_eq!(store.results(id).await.unwrap().len(), 2);
        queue.drain(LONG).await;
        store.close().await.unwrap();
        assert_whole(&mut raw(directory.path()).await).await;
    });
}

#[test]
fn r3_a_cancellation_that_was_accepted_outlives_the_process() {
    if let Some(directory) = child::directory() {
        runtime().block_on(async {
            let store = open(&directory).await;
            let surface = surface(&store).await;
            let queue = Queue::start(store, Puppet::new(), settings()).await.unwrap();
            let id = enqueue(&queue, &surface, json!({ "do": "wait at the gate" })).await;
            crate::support::queue::running(&queue, id).await;
            queue.cancel(id).await.unwrap();
            child::tell(&id.to_string());
            std::future::pending::<()>().await;
        });
        return;
    }
    let directory = tempfile::tempdir().unwrap();
    let test = "queue_crashes::r3_a_cancellation_that_was_accepted_outlives_the_process";
    let mut process = Process::start(test, directory.path());
    let id: JobId = process.hear().unwrap().parse().unwrap();
    process.kill();
    runtime().block_on(async {
        let store = open(directory.path()).await;
        let queue = Queue::start(store, Puppet::new(), settings()).await.unwrap();
        let job = queue.get(id).await.unwrap().unwrap();
        assert_eq!((job.state, job.attempt), (State::Cancelled, 1));
    });
}

/// How many innocent jobs run beside the one that kills.
const INNOCENT: usize = 6;

/// One input ends the process at once; the others take long enough to be running when it does.
struct Poisoned;

impl Runner for Poisoned {
    fn run(&self, task: &Task, _: &dyn Observer) -> Result<Finished, Failed> {
        if task.parameters["do"] == "abort" {
            std::process::abort();
        }
        std::thread::sleep(Duration::from_millis(100));
        Ok(finished(task))
    }
}

#[test]
fn r4_an_input_that_kills_the_process_does_so_three_times_and_takes_no_other_job_with_it() {
    if let Some(directory) = child::directory() {
        runtime().block_on(async {
            let store = open(&directory).await;
            let surface = surface(&store).await;
            // Accepted before any of them runs, by the first process alone.
            if store.jobs(&JobFilter::default(), None, 1).await.unwrap().is_empty() {
                for n in 0..=INNOCENT {
                    let what = if n == INNOCENT / 2 { "abort" } else { "finish" };
                    let new = crate::support::queue::new_job(&surface, json!({ "do": what }));
                    store.enqueue(new, planish::store::Lane::Light, 100).await.unwrap();
                }
            }
            let queue =
                Queue::start(store.clone(), Arc::new(Poisoned), Settings { workers: 3, ..settings() }).await.unwrap();
            for job in store.jobs(&JobFilter::default(), None, 100).await.unwrap() {
                ended(&queue, job.id).await;
            }
            queue.drain(LONG).await;
            store.close().await.unwrap();
        });
        return;
    }
    let directory = tempfile::tempdir().unwrap();
    let test = "queue_crashes::r4_an_input_that_kills_the_process_does_so_three_times_and_takes_no_other_job_with_it";
    let mut deaths = 0;
    while !Process::start(test, directory.path()).ended_well() {
        deaths += 1;
        assert!(deaths <= 3, "it goes on dying");
    }
    assert_eq!(deaths, 3);
    runtime().block_on(async {
        let store = open(directory.path()).await;
        let jobs = store.jobs(&JobFilter::default(), None, 100).await.unwrap();
        assert_eq!(jobs.len(), INNOCENT + 1);
        for job in jobs {
            if job.parameters["do"] == "abort" {
                assert_eq!((job.state, job.attempt), (State::Failed, 3));
                assert_eq!(job.problem.unwrap()["code"], "crashed");
            } else {
                assert_eq!(job.state, State::Succeeded, "{} beside the culprit", job.id);
                assert!(job.attempt <= 2, "{} attempts of a job that does no harm", job.attempt);
            }
        }
    });
}
