//! The machine at work: jobs run, fail, panic, are cancelled, time out, and are tried again only where that can help.

use serde_json::json;

use planish::queue::{Queue, State};

use crate::support::queue::{Puppet, ended, enqueue, open, settings, surface};

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
    assert_eq!(meta.digest, planish::store::Digest::of(&bytes));
    assert!(store.result(id, "pattern").await.unwrap().is_none());
}
