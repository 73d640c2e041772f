//! Server-sent events: every state in order and once, also for who is cut off, and an end.

use std::sync::Arc;

use planish::queue::{JobId, Settings as Machine};
use reqwest::Method;
use serde_json::json;

use crate::support::api::{Held, Live, Sketch, plate, settings};
use crate::support::events::{Event, Stream};
use crate::support::queue::settings as machine;

async fn live(max_streams: usize) -> (Live, Arc<Held<Sketch>>) {
    let runner = Arc::new(Held::<Sketch>::default());
    (Live::start(runner.clone(), &settings(|s| s.max_streams = max_streams)).await, runner)
}

fn states(events: &[Event]) -> Vec<&str> {
    events.iter().filter(|e| e.name == "state").map(|e| e.data["state"].as_str().unwrap()).collect()
}

fn ids(events: &[Event]) -> Vec<i64> {
    events.iter().map(|e| e.id.unwrap()).collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn many_watchers_see_every_state_in_order_and_then_the_end() {
    let (live, runner) = live(64).await;
    let surface = live.surface(&plate()).await;
    let job = live.job(&json!({ "kind": "flatten", "surface": surface, "labels": { "test": "gate" } })).await;
    let mut watchers = Vec::new();
    for _ in 0..20 {
        watchers.push(Stream::open(&live, &job, None).await);
    }
    let hint = watchers[0].next().await.unwrap();
    assert!(hint.retry.is_some_and(|ms| (100..60_000).contains(&ms)), "{hint:?}");
    runner.gate.open();
    for watcher in watchers {
        let events = watcher.rest().await;
        assert_eq!(states(&events), ["queued", "running", "succeeded"]);
        let ids = ids(&events);
        assert!(ids.is_sorted_by(|a, b| a < b), "{ids:?}");
        let end = &events.last().unwrap().data;
        assert_eq!(end["job"], live.get(&format!("/v1/jobs/{job}")).await.json());
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn who_is_cut_off_at_any_event_and_comes_back_misses_no_state_and_hears_none_twice() {
    let (live, _) = live(64).await;
    let surface = live.surface(&plate()).await;
    // Cut off after each of the first events in turn, while the job goes on.
    for cut in 0..4 {
        let job = live.job(&json!({ "kind": "flatten", "surface": surface, "labels": { "test": "endless" } })).await;
        let mut heard: Vec<Event> = Vec::new();
        let mut cancelled = false;
        loop {
            let mut stream = Stream::open(&live, &job, heard.last().and_then(|e| e.id)).await;
            let mut here = 0;
            let ended = loop {
                if here > cut {
                    break false;
                }
                let Some(event) = stream.named().await else { break true };
                if event.data["state"] == "running" && !cancelled {
                    cancelled = true;
                    drop(live.send(Method::POST, &format!("/v1/jobs/{job}/cancel"), |r| r).await.expect(202));
                }
                let over = event.data["state"] == "cancelled";
                heard.push(event);
                here += 1;
                if over && here > cut {
                    break true;
                }
            };
            if ended {
                break;
            }
        }
        assert_eq!(states(&heard), ["queued", "running", "cancelled"], "cut after {cut}");
        let ids = ids(&heard);
        assert!(ids.is_sorted_by(|a, b| a < b), "{ids:?}");
        // Who has heard of the end is told to stay away; who comes anew hears every state again.
        let last = ids.last().unwrap().to_string();
        live.send(Method::GET, &format!("/v1/jobs/{job}/events"), |r| r.header("Last-Event-ID", last))
            .await
            .expect(204);
        let again = Stream::open(&live, &job, None).await.rest().await;
        assert_eq!(states(&again), ["queued", "running", "cancelled"]);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_that_is_tried_again_shows_each_start() {
    let directory = tempfile::tempdir().unwrap();
    let runner = Arc::new(Held::<Sketch>::default());
    let once = Machine { workers: 1, light_workers: 0, ..machine() };
    let live = Live::start_in(directory.path(), runner.clone(), &settings(|_| {}), once.clone()).await;
    let surface = live.surface(&plate()).await;
    let job = live.job(&json!({ "kind": "flatten", "surface": surface, "labels": { "test": "endless" } })).await;
    let mut stream = Stream::open(&live, &job, None).await;
    let mut seen = 0;
    while let Some(event) = stream.named().await {
        seen = event.id.unwrap();
        if event.data["state"] == "running" {
            break;
        }
    }
    // The service stops and starts again on the same data; the client comes back to the new one.
    live.queue.drain(std::time::Duration::ZERO).await;
    drop(stream);
    live.store.close().await.unwrap();
    let live = Live::start_in(directory.path(), runner, &settings(|_| {}), once).await;
    let mut stream = Stream::open(&live, &job, Some(seen)).await;
    let mut heard = Vec::new();
    loop {
        let event = stream.named().await.unwrap();
        let running = event.data["state"] == "running";
        heard.push(event);
        if running {
            break;
        }
    }
    assert_eq!(states(&heard), ["queued", "running"]);
    live.queue.cancel(job.parse::<JobId>().unwrap()).await.unwrap();
    assert_eq!(states(&stream.rest().await), ["cancelled"]);
}

#[tokio::test(flavor = "multi_thread")]
async fn streams_are_counted_live_on_in_silence_and_end_with_a_word_when_the_service_stops() {
    let runner = Arc::new(Held::<Sketch>::default());
    let live = Live::start(
        runner.clone(),
        &settings(|s| {
            s.max_streams = 2;
            s.idle_timeout_s = 1;
        }),
    )
    .await;
    let surface = live.surface(&plate()).await;
    let job = live.job(&json!({ "kind": "flatten", "surface": surface, "labels": { "test": "gate" } })).await;
    let mut first = Stream::open(&live, &job, None).await;
    let second = Stream::open(&live, &job, None).await;
    let path = format!("/v1/jobs/{job}/events");
    let refused = live.get(&path).await.expect(503);
    refused.problem("overloaded");
    assert!(refused.header("retry-after").is_some());
    drop(second);
    // The place comes free when the server sees that the client is gone.
    let mut third = Stream::open_when_free(&live, &job).await;
    // Nothing happens for several idle limits, and the stream is still there.
    let mut comments = 0;
    while comments < 4 {
        let event = first.next().await.expect("the stream goes on");
        comments += u32::from(event.comment.is_some());
    }
    live.draining.cancel();
    for stream in [&mut first, &mut third] {
        let mut last = None;
        while let Some(event) = stream.next().await {
            last = Some(event);
        }
        assert!(last.unwrap().comment.unwrap().contains("shutting down"));
    }
    live.get(&path).await.expect(503).problem("draining");
    runner.gate.open();
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_no_id_of_an_event_and_what_is_no_job_are_told_so() {
    let (live, _) = live(4).await;
    let surface = live.surface(&plate()).await;
    let job = live.job(&json!({ "kind": "flatten", "surface": surface })).await;
    live.ended(&job).await;
    let path = format!("/v1/jobs/{job}/events");
    for bad in ["x", "-1", "1.5", "9999999999999999999999"] {
        live.send(Method::GET, &path, |r| r.header("Last-Event-ID", bad)).await.expect(400).problem("bad-request");
    }
    live.get("/v1/jobs/00000000-0000-0000-0000-000000000000/events").await.expect(404).problem("job-not-found");
    live.get(&format!("{path}?wait=1")).await.expect(400);
    let whole = live.get(&path).await.expect(200).text();
    assert!(whole.trim_end().lines().last().unwrap().contains("\"state\":\"succeeded\""), "{whole}");
}
