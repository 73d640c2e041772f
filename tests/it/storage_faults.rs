//! The disk is full, or the database is locked by another program: told as such over HTTP, nothing is torn, and the
//! service goes on when the fault is gone.

use std::sync::Arc;
use std::time::{Duration, Instant};

use planish::queue::State;
use serde_json::{Value, json};

use crate::support::api::{Held, Live, Sketch, plate, settings};
use crate::support::child::{self, Process};
use crate::support::queue::{LONG, open};
use crate::support::{assert_whole, number, raw};

/// Room enough for any test here: what the database is bounded by when it is not.
const NO_BOUND: u32 = 1 << 30;

/// A plate whose file is so long that it needs room of its own; no two are alike.
fn long_plate(n: usize) -> Value {
    let mut plate = plate();
    plate["extra"] = json!({ "number": n, "long": "x".repeat(64 * 1024) });
    plate
}

#[tokio::test(flavor = "multi_thread")]
async fn r14_on_a_full_disk_requests_are_refused_the_running_job_fails_and_reading_goes_on_until_there_is_room() {
    let runner = Arc::new(Held::<Sketch>::default());
    let live = Live::start(runner.clone(), &settings(|_| {})).await;
    let surface = live.surface(&plate()).await;
    let done = live.job(&json!({ "kind": "flatten", "surface": surface })).await;
    assert_eq!(live.ended(&done).await["state"], "succeeded");
    let labels = json!({ "test": "gate" });
    let held = live.job(&json!({ "kind": "flatten", "surface": surface, "labels": labels })).await;
    crate::support::queue::running(&live.queue, held.parse().unwrap()).await;

    live.store.bound_pages(1).await.unwrap();
    // Free places in the last pages may take a few small rows yet; a long file finds none.
    for path in ["/v1/surfaces", "/v1/flatten"] {
        let answer = live.post(path, &long_plate(1)).await.expect(507);
        answer.problem("storage-full");
    }
    let before = live.store.surfaces(None, 100).await.unwrap();
    assert_eq!(before.len(), 1, "a surface that was refused is there");
    // Several at once: each is told for itself.
    let all = futures_util::future::join_all((2..10).map(|n| {
        let (live, plate) = (&live, long_plate(n));
        async move { live.post("/v1/flatten", &plate).await.status.as_u16() }
    }));
    assert_eq!(all.await, [507; 8]);
    // Jobs are taken for as long as a row of theirs fits, and then no more: never half.
    let mut taken = Vec::new();
    loop {
        let body = json!({ "kind": "flatten", "surface": surface, "labels": { "long": "y".repeat(200), "n": taken.len().to_string() } });
        let answer = live.post("/v1/jobs", &body).await;
        if answer.status == 507 {
            answer.problem("storage-full");
            break;
        }
        taken.push(answer.expect(202).json()["id"].as_str().unwrap().to_owned());
        assert!(taken.len() < 1000, "it is never full");
    }

    // Reading goes on, also of what was there before.
    live.get(&format!("/v1/jobs/{done}/pattern.dxf")).await.expect(200);
    live.get("/v1/jobs").await.expect(200);
    live.get("/healthz").await.expect(200);

    // Results of the same bytes need no room, so those of the held job are there already; a mesh of its own is not.
    runner.gate.open();
    for job in taken.iter().chain([&held]) {
        let document = live.ended(job).await;
        if document["state"] == "failed" {
            assert_eq!(document["problem"]["code"], "storage-full", "{document:#}");
        }
    }

    live.store.bound_pages(NO_BOUND).await.unwrap();
    live.post("/v1/flatten", &long_plate(1)).await.expect(200);
    live.queue.drain(LONG).await;
    live.store.close().await.unwrap();
    assert_whole(&mut raw(live.directory()).await).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn r14_a_job_whose_result_has_no_room_fails_for_that_reason() {
    let runner = Arc::new(Held::<Sketch>::default());
    let live = Live::start(runner.clone(), &settings(|_| {})).await;
    let surface = live.surface(&plate()).await;
    let labels = json!({ "test": "gate" });
    let held = live.job(&json!({ "kind": "flatten", "surface": surface, "labels": labels })).await;
    crate::support::queue::running(&live.queue, held.parse().unwrap()).await;
    // The first result of its kind: its bytes need room, and the free places are filled first.
    live.store.bound_pages(1).await.unwrap();
    let mut raw_connection = raw(live.directory()).await;
    let filled = "CREATE TRIGGER full BEFORE INSERT ON results BEGIN INSERT INTO blobs (digest, length, bytes) \
         VALUES (randomblob(32), 1000000, zeroblob(1000000)); END";
    sqlx::query(filled).execute(&mut raw_connection).await.unwrap();
    runner.gate.open();
    let document = live.ended(&held).await;
    assert_eq!((&document["state"], &document["problem"]["code"]), (&json!("failed"), &json!("storage-full")));
    sqlx::query("DROP TRIGGER full").execute(&mut raw_connection).await.unwrap();
    // Nothing of the result is left, and the next job has room again.
    assert_eq!(number(&mut raw_connection, "SELECT count(*) FROM results").await, 0);
    live.store.bound_pages(NO_BOUND).await.unwrap();
    let next = live.job(&json!({ "kind": "flatten", "surface": surface })).await;
    assert_eq!(live.ended(&next).await["state"], "succeeded");
    assert_whole(&mut raw_connection).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn r15_a_database_that_another_program_holds_is_told_to_come_back_for() {
    let live = Live::start(Arc::new(Held::<Sketch>::default()), &settings(|_| {})).await;
    let surface = live.surface(&plate()).await;
    let mut outsider = raw(live.directory()).await;
    sqlx::query("BEGIN EXCLUSIVE").execute(&mut outsider).await.unwrap();
    let body = json!({ "kind": "flatten", "surface": surface });
    let begun = Instant::now();
    let plate = plate();
    let (job, flattened) = tokio::join!(live.post("/v1/jobs", &body), live.post("/v1/flatten", &plate));
    for answer in [job, flattened] {
        let answer = answer.expect(503);
        answer.problem("storage-unavailable");
        assert!(answer.header("retry-after").is_some());
    }
    // Promised are five seconds for those that wait together, asserted ten times that.
    assert!(begun.elapsed() < Duration::from_secs(50), "{:?}", begun.elapsed());
    live.get(&format!("/v1/surfaces/{surface}")).await.expect(200);
    sqlx::query("COMMIT").execute(&mut outsider).await.unwrap();
    let job = live.job(&body).await;
    assert_eq!(live.ended(&job).await["state"], "succeeded");
}

/// Surfaces and jobs that one round of the child accepts at once.
const TOGETHER: usize = 12;

/// Times that it is killed.
const KILLS: u64 = 40;

#[test]
fn r1_every_member_of_a_group_that_was_answered_is_on_disk_when_the_process_is_killed() {
    let runtime = || tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build().unwrap();
    if let Some(directory) = child::directory() {
        runtime().block_on(async {
            let store = open(&directory).await;
            let surface = crate::support::queue::surface(&store).await;
            let accept = |n: usize| {
                let (store, surface) = (store.clone(), surface.clone());
                async move {
                    let new = crate::support::queue::new_job(&surface, json!({ "n": n }));
                    let job = store.enqueue(new, planish::store::Lane::Light, 1 << 20).await.unwrap().job().id;
                    child::tell(&job.to_string());
                }
            };
            loop {
                futures_util::future::join_all((0..TOGETHER).map(accept)).await;
            }
        });
        return;
    }
    let directory = tempfile::tempdir().unwrap();
    let test = "storage_faults::r1_every_member_of_a_group_that_was_answered_is_on_disk_when_the_process_is_killed";
    let mut accepted = Vec::new();
    for kill in 0..KILLS {
        let mut process = Process::start(test, directory.path());
        // Somewhere within a group, or between two.
        for _ in 0..=(kill * 7) % (2 * TOGETHER as u64) {
            accepted.push(process.hear().expect("it accepts until it is killed"));
        }
        process.kill();
    }
    runtime().block_on(async {
        let store = open(directory.path()).await;
        for id in &accepted {
            let job = store.job(id.parse().unwrap()).await.unwrap();
            assert_eq!(job.map(|job| job.state), Some(State::Queued), "{id} was accepted and is gone");
        }
        store.close().await.unwrap();
        assert_whole(&mut raw(directory.path()).await).await;
    });
}
