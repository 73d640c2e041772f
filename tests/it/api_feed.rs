//! The feed: every ended job once, in the order of ending, whoever reads while jobs end.

use std::sync::Arc;
use std::time::Duration;

use planish::queue::Settings as Machine;
use reqwest::Method;
use serde_json::{Value, json};

use crate::support::api::{Held, Live, Sketch, plate, settings};
use crate::support::queue::settings as machine;

/// Jobs of the test with many readers.
const JOBS: usize = 200;

async fn sketching() -> (Live, Arc<Held<Sketch>>) {
    let runner = Arc::new(Held::<Sketch>::default());
    (Live::start(runner.clone(), &settings(|_| {})).await, runner)
}

fn seqs(page: &Value) -> Vec<i64> {
    page["items"].as_array().unwrap().iter().map(|item| item["seq"].as_i64().unwrap()).collect()
}

/// Reads until `count` jobs were seen: (number, job) in the order in which they came.
async fn read(live: &Live, filter: &str, limit: usize, count: usize) -> Vec<(i64, String)> {
    let (mut seen, mut after) = (Vec::new(), 0);
    while seen.len() < count {
        let page = live.get(&format!("/v1/feed?after={after}&limit={limit}&wait=30{filter}")).await.expect(200).json();
        for item in page["items"].as_array().unwrap() {
            seen.push((item["seq"].as_i64().unwrap(), item["job"]["id"].as_str().unwrap().to_owned()));
        }
        after = page["next"].as_i64().unwrap();
        assert!(after <= page["last"].as_i64().unwrap(), "{page}");
    }
    seen
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn readers_that_page_while_jobs_end_on_several_workers_see_each_ending_once_and_in_order() {
    let directory = tempfile::tempdir().unwrap();
    let many = Machine { workers: 3, light_workers: 3, ..machine() };
    let live = Live::start_in(directory.path(), Arc::new(Held::<Sketch>::default()), &settings(|_| {}), many).await;
    let live = Arc::new(live);
    let surface = live.surface(&plate()).await;
    let reader = |filter: &'static str, limit, count| {
        let live = live.clone();
        tokio::spawn(async move { read(&live, filter, limit, count).await })
    };
    let readers = [reader("", 1, JOBS), reader("", 7, JOBS), reader("", 100, JOBS)];
    let odd = reader("&label.half=odd", 5, JOBS / 2);
    let mut jobs = Vec::new();
    for i in 0..JOBS {
        let half = if i % 2 == 0 { "even" } else { "odd" };
        let kind = if i % 3 == 0 { "flatten" } else { "triangulate" };
        let labels = if i % 10 == 9 { json!({ "half": half, "test": "fail" }) } else { json!({ "half": half }) };
        jobs.push(live.job(&json!({ "kind": kind, "surface": surface, "labels": labels })).await);
    }
    let mut expected: Option<Vec<(i64, String)>> = None;
    for reader in readers {
        let seen = reader.await.unwrap();
        assert!(seen.is_sorted_by(|(a, _), (b, _)| a < b), "not in order, or one twice");
        let mut ids: Vec<&String> = seen.iter().map(|(_, id)| id).collect();
        ids.sort();
        let mut all: Vec<&String> = jobs.iter().collect();
        all.sort();
        assert_eq!(ids, all);
        assert_eq!(expected.get_or_insert_with(|| seen.clone()), &seen, "two readers saw different orders");
    }
    let odd: Vec<String> = odd.await.unwrap().into_iter().map(|(_, id)| id).collect();
    let among: Vec<String> = expected
        .unwrap()
        .into_iter()
        .map(|(_, id)| id)
        .filter(|id| jobs.iter().position(|j| j == id).unwrap() % 2 == 1)
        .collect();
    assert_eq!(odd, among);
    // Each filter gives its part.
    for (filter, count) in [("state=failed", JOBS / 10), ("kind=flatten&verdict=unchecked", 60), ("verdict=pass", 0)] {
        let page = live.get(&format!("/v1/feed?limit=100&{filter}")).await.expect(200).json();
        assert_eq!(page["items"].as_array().unwrap().len(), count, "{filter}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn an_entry_leads_to_the_results_and_the_links_to_the_next_page() {
    let (live, _) = sketching().await;
    let surface = live.surface(&plate()).await;
    for order in ["a", "b", "a b"] {
        let job = live.job(&json!({ "kind": "flatten", "surface": surface, "labels": { "order": order } })).await;
        live.ended(&job).await;
    }
    let page = live.get("/v1/feed?limit=1&label.order=a%20b").await.expect(200).json();
    assert_eq!(page["items"][0]["job"]["labels"]["order"], "a b");
    for link in page["items"][0]["job"]["results"].as_array().unwrap() {
        live.get(link["href"].as_str().unwrap()).await.expect(200);
    }
    let rest = live.get(page["links"]["next"].as_str().unwrap()).await.expect(200).json();
    assert_eq!(rest["items"], json!([]));
    assert_eq!((&rest["next"], &rest["last"]), (&json!(3), &json!(3)));
    let first = live.get("/v1/feed?limit=2").await.expect(200).json();
    assert_eq!((seqs(&first), &first["next"]), (vec![1, 2], &json!(2)));
    assert_eq!(seqs(&live.get("/v1/feed?after=2").await.expect(200).json()), [3]);
    // A deleted job leaves the feed; its number is not given again.
    let id = page["items"][0]["job"]["id"].as_str().unwrap();
    live.delete(&format!("/v1/jobs/{id}")).await.expect(204);
    let rest = live.get("/v1/feed?after=2").await.expect(200).json();
    assert_eq!((&rest["items"], &rest["next"], &rest["last"]), (&json!([]), &json!(3), &json!(3)));
    // A number from other data is answered at once, with the one to go on from.
    let strange = live.get("/v1/feed?after=900&wait=60").await.expect(200).json();
    assert_eq!((&strange["next"], &strange["last"]), (&json!(3), &json!(3)));
    for bad in ["after=-1", "after=x", "limit=0", "limit=101", "state=lost", "cursor=1", "after=99999999999999999999"] {
        live.get(&format!("/v1/feed?{bad}")).await.expect(400).problem("bad-request");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn who_waits_is_woken_by_an_ending_that_fits_and_by_no_other() {
    let (live, runner) = sketching().await;
    let surface = live.surface(&plate()).await;
    let waits = live.send(Method::GET, "/v1/feed?state=failed", |r| r.header("Prefer", "wait=60"));
    let ends = async {
        let good = live.job(&json!({ "kind": "flatten", "surface": surface })).await;
        live.ended(&good).await;
        live.job(&json!({ "kind": "flatten", "surface": surface, "labels": { "test": "fail" } })).await
    };
    let (page, failed) = tokio::join!(waits, ends);
    assert_eq!(page.header("preference-applied"), Some("wait=60"));
    let page = page.expect(200).json();
    assert_eq!(page["items"][0]["job"]["id"], json!(failed));
    assert_eq!(page["next"], json!(2));
    // Nothing comes: an empty page when the time is up.
    let begun = std::time::Instant::now();
    let empty = live.get("/v1/feed?after=2&wait=1").await.expect(200).json();
    assert_eq!(empty["items"], json!([]));
    assert!(begun.elapsed() >= Duration::from_secs(1));
    // And at once when the service stops.
    let (page, ()) = tokio::join!(live.get("/v1/feed?after=2&wait=60"), async { live.draining.cancel() });
    assert_eq!(page.expect(200).json()["items"], json!([]));
    runner.gate.open();
}
