//! Lists, the feed, idempotency keys.

use std::collections::BTreeSet;
use std::time::Duration;

use planish::clock::Clock;
use planish::queue::{Enqueued, IdempotencyKey, NewJob};
use planish::store::{Digest, Ending, EnqueueError, IDEMPOTENCY_KEPT, Job, JobFilter, Lane, State, Store, SurfaceId};
use proptest::prelude::*;
use serde_json::json;

use crate::support::queue::{LONG, new_job, open, surface};

fn job(surface: &SurfaceId, kind: &str, labels: &[(&str, &str)]) -> NewJob {
    let labels = labels.iter().map(|&(key, value)| (key.to_owned(), value.to_owned())).collect();
    NewJob { kind: kind.to_owned(), labels, ..new_job(surface, json!({})) }
}

async fn accept(store: &Store, new: NewJob) -> Job {
    store.enqueue(new, Lane::Light, 1000).await.unwrap().job().clone()
}

async fn seqs(store: &Store, filter: &JobFilter) -> Vec<i64> {
    store.jobs(filter, None, 100).await.unwrap().iter().map(|job| job.seq).collect()
}

#[tokio::test]
async fn each_filter_gives_what_it_says_and_all_together_their_meet() {
    let directory = tempfile::tempdir().unwrap();
    let store = open(directory.path()).await;
    let surface = surface(&store).await;
    let a = accept(&store, job(&surface, "flatten", &[("order", "1"), ("part", "x")])).await;
    let b = accept(&store, job(&surface, "flatten", &[("order", "1"), ("part", "y")])).await;
    let c = accept(&store, job(&surface, "triangulate", &[("order", "2")])).await;
    let claim = store.claim(true, LONG).await.unwrap().unwrap();
    let ending = Ending::Succeeded { results: Vec::new(), verdict: Some("pass".to_owned()), resolved: None };
    store.finish(&claim, ending, None).await.unwrap();
    store.cancel(b.id).await.unwrap();

    let text = |text: &str| Some(text.to_owned());
    let label = |pairs: &[(&str, &str)]| job(&surface, "", pairs).labels;
    let all = JobFilter::default();
    let cases = [
        (all.clone(), vec![c.seq, b.seq, a.seq], vec![a.seq, b.seq]),
        (JobFilter { state: Some(State::Queued), ..all.clone() }, vec![c.seq], vec![]),
        (JobFilter { state: Some(State::Cancelled), ..all.clone() }, vec![b.seq], vec![b.seq]),
        (JobFilter { kind: text("flatten"), ..all.clone() }, vec![b.seq, a.seq], vec![a.seq, b.seq]),
        (JobFilter { surface: Some(surface.clone()), ..all.clone() }, vec![c.seq, b.seq, a.seq], vec![a.seq, b.seq]),
        (JobFilter { verdict: text("pass"), ..all.clone() }, vec![a.seq], vec![a.seq]),
        (JobFilter { labels: label(&[("order", "1")]), ..all.clone() }, vec![b.seq, a.seq], vec![a.seq, b.seq]),
        (JobFilter { labels: label(&[("order", "1"), ("part", "y")]), ..all.clone() }, vec![b.seq], vec![b.seq]),
        (
            JobFilter { labels: label(&[("order", "1")]), verdict: text("pass"), ..all.clone() },
            vec![a.seq],
            vec![a.seq],
        ),
        (JobFilter { labels: label(&[("order", "3")]), ..all.clone() }, vec![], vec![]),
        // Nothing that a client writes is taken for SQL.
        (JobFilter { kind: text("' OR 1 = 1 --"), ..all }, vec![], vec![]),
    ];
    for (filter, listed, fed) in cases {
        assert_eq!(seqs(&store, &filter).await, listed, "{filter:?}");
        let feed: Vec<i64> = store.feed(&filter, 0, 100).await.unwrap().iter().map(|job| job.seq).collect();
        assert_eq!(feed, fed, "the feed of {filter:?}");
    }
    assert_eq!(store.feed(&JobFilter::default(), 1, 100).await.unwrap()[0].id, b.id);
}

#[tokio::test]
async fn the_same_key_and_body_give_the_same_job_and_another_body_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let (clock, hand) = Clock::fake(1_000_000_000_000_000);
    let store = Store::open(directory.path(), clock).await.unwrap();
    let surface = surface(&store).await;
    let keyed = |key: &str, body: &str| NewJob {
        idempotency: Some(IdempotencyKey {
            scope: "POST /v1/jobs".to_owned(),
            key: key.to_owned(),
            body: Digest::of(body.as_bytes()),
        }),
        ..new_job(&surface, json!({}))
    };
    let first = store.enqueue(keyed("k", "body"), Lane::Light, 2).await.unwrap();
    assert!(matches!(&first, Enqueued::New(_)));
    store.enqueue(keyed("l", "body"), Lane::Light, 2).await.unwrap();
    // The queue is full now, and still the same request has its answer.
    let again = store.enqueue(keyed("k", "body"), Lane::Light, 2).await.unwrap();
    assert_eq!(again, Enqueued::Again(first.job().clone()));
    let refused = store.enqueue(keyed("k", "another"), Lane::Light, 2).await.unwrap_err();
    assert!(matches!(refused, EnqueueError::KeyReused { .. }), "{refused}");
    hand.advance(IDEMPOTENCY_KEPT + Duration::from_secs(1));
    let later = store.enqueue(keyed("k", "another"), Lane::Light, 10).await.unwrap();
    assert!(matches!(&later, Enqueued::New(job) if job.id != first.job().id));
    store.enqueue(keyed("m", "body"), Lane::Light, 10).await.unwrap();
    let mut raw = crate::support::raw(directory.path()).await;
    let keys = crate::support::number(&mut raw, "SELECT count(*) FROM idempotency").await;
    assert_eq!(keys, 2, "expired keys are forgotten");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn fifty_requests_at_once_with_one_key_give_one_job() {
    let directory = tempfile::tempdir().unwrap();
    let store = open(directory.path()).await;
    let surface = surface(&store).await;
    let key = IdempotencyKey { scope: "s".to_owned(), key: "k".to_owned(), body: Digest::of(b"body") };
    let requests: Vec<_> = (0..50)
        .map(|_| {
            let (store, new) =
                (store.clone(), NewJob { idempotency: Some(key.clone()), ..new_job(&surface, json!({})) });
            tokio::spawn(async move { store.enqueue(new, Lane::Light, 1000).await.unwrap() })
        })
        .collect();
    let (mut ids, mut new) = (BTreeSet::new(), 0);
    for request in requests {
        let enqueued = request.await.unwrap();
        new += u32::from(matches!(&enqueued, Enqueued::New(_)));
        ids.insert(enqueued.job().id);
    }
    assert_eq!((ids.len(), new), (1, 1));
    assert_eq!(store.count(State::Queued).await.unwrap(), 1);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, ..ProptestConfig::default() })]

    #[test]
    fn a_scan_sees_each_job_that_was_there_all_the_while_exactly_once(
        jobs in 1_usize..24,
        page in 1_u32..7,
        meanwhile in prop::collection::vec((any::<bool>(), any::<prop::sample::Index>()), 0..16),
    ) {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        runtime.block_on(async {
            let directory = tempfile::tempdir().unwrap();
            let store = open(directory.path()).await;
            let surface = surface(&store).await;
            let mut there = Vec::new();
            for _ in 0..jobs {
                let job = accept(&store, new_job(&surface, json!({}))).await;
                store.cancel(job.id).await.unwrap();
                there.push(job);
            }
            let mut stayed: BTreeSet<i64> = there.iter().map(|job| job.seq).collect();
            let mut meanwhile = meanwhile.into_iter();
            let (mut before, mut seen) = (None, Vec::new());
            loop {
                let rows = store.jobs(&JobFilter::default(), before, page).await.unwrap();
                let Some(last) = rows.last() else { break };
                before = Some(last.seq);
                seen.extend(rows.iter().map(|job| job.seq));
                if let Some((add, which)) = meanwhile.next() {
                    if add {
                        accept(&store, new_job(&surface, json!({}))).await;
                    } else {
                        let gone = which.get(&there);
                        store.remove_job(gone.id).await.unwrap();
                        stayed.remove(&gone.seq);
                    }
                }
            }
            let once: BTreeSet<i64> = seen.iter().copied().collect();
            prop_assert_eq!(once.len(), seen.len(), "a job twice in {:?}", &seen);
            prop_assert!(stayed.is_subset(&once), "{:?} not all in {:?}", &stayed, &seen);
            Ok(())
        })?;
    }
}
