//! Surfaces and results: each content once, kept as long as something points to it, and no longer.

use bytes::Bytes;
use planish::queue::NewResult;
use planish::store::{Committed, Ending, Lane, NewSurface, Removal, State, Store};
use serde_json::{Value, json};

use crate::support::queue::{LONG, new_job, open};
use crate::support::{assert_whole, number, raw};

fn surface(content: &'static str, reading: Value) -> NewSurface {
    let bytes = Bytes::from_static(content.as_bytes());
    let mut new = NewSurface::new(bytes, "application/json", "nurbs", "mm", reading);
    new.name = Some("backlight".to_owned());
    new.summary = json!({ "area_mm2": 0.1 });
    new
}

async fn succeed(store: &Store, results: Vec<NewResult>) -> planish::store::Job {
    let claim = store.claim(false, LONG).await.unwrap().unwrap();
    let ending = Ending::Succeeded { results, verdict: None, resolved: None };
    match store.finish(&claim, ending, None).await.unwrap() {
        Committed::Ended(job) => *job,
        Committed::Lost => panic!("the claim is fresh"),
    }
}

#[tokio::test]
async fn the_same_surface_again_is_the_same_and_another_reading_is_another() {
    let directory = tempfile::tempdir().unwrap();
    let store = open(directory.path()).await;
    let (first, new) = store.put_surface(surface("a", json!({ "units": "mm", "side": "normal" }))).await.unwrap();
    assert!(new);
    let (again, new) = store.put_surface(surface("a", json!({ "side": "normal", "units": "mm" }))).await.unwrap();
    assert!(!new);
    assert_eq!(first, again);
    let (other, new) = store.put_surface(surface("a", json!({ "units": "m", "side": "normal" }))).await.unwrap();
    assert!(new);
    assert_ne!(first.id, other.id);
    assert_eq!(first.digest, other.digest);
    assert_eq!(number(&mut raw(directory.path()).await, "SELECT count(*) FROM blobs").await, 1);
    let (read, content) = store.surface_content(&first.id).await.unwrap().unwrap();
    assert_eq!((read, content), (first.clone(), Bytes::from_static(b"a")));
    assert_eq!(store.surfaces(None, 10).await.unwrap(), [other.clone(), first.clone()]);
    assert_eq!(store.surfaces(Some(other.seq), 10).await.unwrap(), [first]);
}

#[tokio::test]
async fn a_surface_stays_while_a_job_needs_it_and_goes_when_none_does() {
    let directory = tempfile::tempdir().unwrap();
    let store = open(directory.path()).await;
    let id = store.put_surface(surface("a", json!({}))).await.unwrap().0.id;
    let job = store.enqueue(new_job(&id, json!({})), Lane::Light, 10).await.unwrap().job().clone();
    assert_eq!(store.remove_surface(&id).await.unwrap(), Removal::InUse);
    assert_eq!(store.remove_job(job.id).await.unwrap(), Removal::InUse);
    let claim = store.claim(true, LONG).await.unwrap().unwrap();
    assert_eq!(store.remove_surface(&id).await.unwrap(), Removal::InUse);
    assert_eq!(store.remove_job(job.id).await.unwrap(), Removal::InUse);
    store.finish(&claim, Ending::Cancelled, None).await.unwrap();
    assert_eq!(store.remove_surface(&id).await.unwrap(), Removal::Removed);
    assert_eq!(store.remove_surface(&id).await.unwrap(), Removal::Absent);
    assert_eq!(store.surface(&id).await.unwrap(), None);
    let left = store.job(job.id).await.unwrap().unwrap();
    assert_eq!((left.state, left.surface), (State::Cancelled, id));
    let mut raw = raw(directory.path()).await;
    assert_eq!(number(&mut raw, "SELECT count(*) FROM blobs").await, 0);
    assert_whole(&mut raw).await;
}

#[tokio::test]
async fn removing_a_job_takes_its_results_but_not_bytes_that_others_share() {
    let directory = tempfile::tempdir().unwrap();
    let store = open(directory.path()).await;
    let id = store.put_surface(surface("shared", json!({}))).await.unwrap().0.id;
    for _ in 0..2 {
        store.enqueue(new_job(&id, json!({})), Lane::Light, 10).await.unwrap();
    }
    let result = |name: &str, bytes: &'static str| NewResult::new(name, "text/plain", bytes);
    // The second result has the very bytes of the surface, the first those of the other job's.
    let first = succeed(&store, vec![result("mesh", "m"), result("report", "r1"), result("pattern", "shared")]).await;
    let second = succeed(&store, vec![result("mesh", "m"), result("report", "r2")]).await;
    let mut raw = raw(directory.path()).await;
    assert_eq!(number(&mut raw, "SELECT count(*) FROM blobs").await, 4);
    assert_eq!(store.remove_job(first.id).await.unwrap(), Removal::Removed);
    assert_eq!(store.remove_job(first.id).await.unwrap(), Removal::Absent);
    assert_eq!(store.job(first.id).await.unwrap(), None);
    assert!(store.results(first.id).await.unwrap().is_empty());
    assert_eq!(store.result(second.id, "mesh").await.unwrap().unwrap().1, "m");
    assert_eq!(store.surface_content(&id).await.unwrap().unwrap().1, "shared");
    assert_eq!(number(&mut raw, "SELECT count(*) FROM blobs").await, 3);
    assert_whole(&mut raw).await;
}

#[tokio::test]
async fn the_order_of_ending_is_never_given_out_twice() {
    let directory = tempfile::tempdir().unwrap();
    let store = open(directory.path()).await;
    let id = store.put_surface(surface("a", json!({}))).await.unwrap().0.id;
    let mut last = 0;
    for _ in 0..3 {
        store.enqueue(new_job(&id, json!({})), Lane::Heavy, 10).await.unwrap();
        let job = succeed(&store, Vec::new()).await;
        assert!(job.end_seq.unwrap() > last, "{:?} after {last}", job.end_seq);
        last = job.end_seq.unwrap();
        store.remove_job(job.id).await.unwrap();
    }
}

#[tokio::test]
async fn exact_numbers_survive_storage() {
    let directory = tempfile::tempdir().unwrap();
    let store = open(directory.path()).await;
    let id = store.put_surface(surface("a", json!({}))).await.unwrap().0.id;
    let numbers =
        json!({ "chord": 0.1 + 0.2, "tiny": 5e-324, "large": 1.797_693_134_862_315_7e308, "third": 1.0 / 3.0 });
    let job = store.enqueue(new_job(&id, numbers.clone()), Lane::Light, 10).await.unwrap().job().clone();
    assert_eq!(store.job(job.id).await.unwrap().unwrap().parameters, numbers);
}
