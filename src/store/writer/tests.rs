//! The writer against a real file: batches, faults in their middle, and clients that are gone.

use std::sync::atomic::AtomicBool;

use serde_json::json;
use sqlx::AssertSqlSafe;

use super::*;
use crate::store::{Digest, EnqueueError, Enqueued, Lane, NewJob, NewSurface, State, Store, Surface, SurfaceId};

const LEASE: Duration = Duration::from_mins(1);

async fn store() -> (Store, tempfile::TempDir) {
    let directory = tempfile::tempdir().unwrap();
    (Store::open(directory.path(), Clock::system()).await.unwrap(), directory)
}

fn commits(store: &Store) -> u64 {
    store.0.context.commits.load(Ordering::Relaxed)
}

async fn put(store: &Store, bytes: &'static str, units: &str) -> Result<Surface, StoreError> {
    let new = NewSurface::new(bytes.into(), "application/json", "nurbs", units, json!({}));
    store.put_surface(new).await.map(|(surface, _)| surface)
}

async fn enqueue(store: &Store, surface: &SurfaceId, lane: Lane) -> Result<Enqueued, EnqueueError> {
    let new = NewJob {
        kind: "flatten".to_owned(),
        surface: surface.clone(),
        parameters: json!({}),
        labels: std::collections::BTreeMap::new(),
        cost: 1,
        idempotency: None,
    };
    store.enqueue(new, lane, 1000).await
}

/// A write of any SQL.
#[expect(clippy::ptr_arg, reason = "a write is given its data as it was handed in")]
fn statements<'a>(_: &'a Context, sql: &'a String, tx: &'a mut SqliteConnection) -> Writing<'a, (), StoreError> {
    Box::pin(async move {
        sqlx::raw_sql(AssertSqlSafe(sql.clone())).execute(tx).await?;
        Ok(Written::keep(()))
    })
}

/// A surface in this unit cannot be stored: the database refuses it in this manner.
async fn refuse(store: &Store, units: &str, manner: &str) {
    let sql = format!(
        "CREATE TRIGGER refuse_{units} AFTER INSERT ON surfaces WHEN NEW.units = '{units}' \
         BEGIN SELECT RAISE({manner}, 'refused'); END"
    );
    store.write(sql, statements).await.unwrap();
}

#[tokio::test]
async fn writes_that_wait_at_the_same_time_share_a_commit() {
    let (store, _directory) = store().await;
    let before = commits(&store);
    let done = tokio::join!(put(&store, "a", "mm"), put(&store, "b", "mm"), put(&store, "c", "mm"));
    assert!(done.0.is_ok() && done.1.is_ok() && done.2.is_ok());
    assert_eq!(commits(&store) - before, 1);
    assert_eq!(store.surfaces(None, 10).await.unwrap().len(), 3);
}

#[tokio::test]
async fn a_write_that_fails_in_a_group_is_undone_and_its_neighbours_are_not() {
    let (store, _directory) = store().await;
    // The first undoes its statement; the second ends the whole transaction, as a full disk does.
    for (manner, shared) in [("ABORT", true), ("ROLLBACK", false)] {
        refuse(&store, manner, manner).await;
        let nowhere = SurfaceId::derive(Digest::of(b"nowhere"), "");
        let names = if shared { ["a", "b", "c"] } else { ["d", "e", "f"] };
        let before = commits(&store);
        let (first, refused, absent, last) = tokio::join!(
            put(&store, names[0], "mm"),
            put(&store, names[1], manner),
            enqueue(&store, &nowhere, Lane::Light),
            put(&store, names[2], "mm"),
        );
        assert!(refused.unwrap_err().to_string().contains("refused"), "{manner}");
        assert!(matches!(absent.unwrap_err(), EnqueueError::NoSurface(_)), "{manner}");
        assert!(store.surface(&first.unwrap().id).await.unwrap().is_some(), "{manner}");
        assert!(store.surface(&last.unwrap().id).await.unwrap().is_some(), "{manner}");
        assert_eq!(commits(&store) - before, if shared { 1 } else { 2 }, "{manner}");
    }
    assert_eq!(store.surfaces(None, 10).await.unwrap().len(), 4);
    let bytes: i64 =
        sqlx::Row::get(&sqlx::query("SELECT count(*) FROM blobs").fetch_one(&store.0.readers).await.unwrap(), 0);
    assert_eq!(bytes, 4, "what was undone left its bytes behind");
}

#[tokio::test]
async fn a_commit_that_fails_is_told_to_each_that_it_was_for() {
    let (store, _directory) = store().await;
    // A reference that is checked at the end: the statement succeeds and the commit does not.
    let late = "CREATE TABLE late (job INTEGER REFERENCES jobs (seq) DEFERRABLE INITIALLY DEFERRED)";
    store.write(late.to_owned(), statements).await.unwrap();
    let dangling = store.write("INSERT INTO late VALUES (99)".to_owned(), statements);
    let (dangling, sound) = tokio::join!(dangling, put(&store, "a", "mm"));
    assert!(dangling.is_err());
    assert!(store.surface(&sound.unwrap().id).await.unwrap().is_some());
    assert!(put(&store, "b", "mm").await.is_ok(), "the connection is free again");
}

#[tokio::test]
async fn a_caller_that_goes_away_does_not_stop_its_write() {
    let (store, _directory) = store().await;
    let gone = AtomicBool::new(false);
    {
        let write = put(&store, "a", "mm");
        tokio::pin!(write);
        tokio::select! {
            biased;
            _ = &mut write => panic!("it cannot be done before it was begun"),
            () = std::future::ready(()) => gone.store(true, Ordering::Relaxed),
        }
    }
    assert!(gone.into_inner());
    put(&store, "b", "mm").await.unwrap();
    assert_eq!(store.surfaces(None, 10).await.unwrap().len(), 2);
}

#[tokio::test]
async fn a_wish_is_granted_by_the_commit_that_accepts_the_job() {
    let (store, _directory) = store().await;
    let surface = put(&store, "a", "mm").await.unwrap().id;
    let (mut any, mut light) = (store.wish(false, LEASE), store.wish(true, LEASE));
    tokio::task::yield_now().await;
    store.ping().await.unwrap();
    let before = commits(&store);
    let accepted = enqueue(&store, &surface, Lane::Light).await.unwrap();
    assert_eq!(accepted.job().state, State::Queued, "as it was accepted");
    // The worker of the light lane has it, and the other goes on waiting: for this one.
    let claim = light.granted().await.unwrap().unwrap();
    assert_eq!(claim.job.id, accepted.job().id);
    assert_eq!(store.job(claim.job.id).await.unwrap().unwrap().state, State::Running);
    assert_eq!(commits(&store) - before, 1);
    let heavy = enqueue(&store, &surface, Lane::Heavy).await.unwrap();
    assert_eq!(any.granted().await.unwrap().unwrap().job.id, heavy.job().id);
    assert_eq!(commits(&store) - before, 2);
}

#[tokio::test]
async fn a_wish_is_granted_by_a_job_that_waits_and_by_one_that_is_given_back() {
    let (store, _directory) = store().await;
    let surface = put(&store, "a", "mm").await.unwrap().id;
    let id = enqueue(&store, &surface, Lane::Heavy).await.unwrap().job().id;
    let claim = store.wish(false, LEASE).granted().await.unwrap().unwrap();
    assert_eq!(claim.job.id, id);
    let mut wish = store.wish(false, LEASE);
    store.ping().await.unwrap();
    assert!(store.give_back(claim, true).await.unwrap());
    let again = wish.granted().await.unwrap().unwrap();
    assert_eq!((again.job.id, again.job.attempt), (id, 2));
}

#[tokio::test]
async fn a_wish_that_is_withdrawn_is_answered_and_no_job_is_lost() {
    let (store, _directory) = store().await;
    let surface = put(&store, "a", "mm").await.unwrap().id;
    assert!(store.wish(false, LEASE).withdrawn().await.unwrap().is_none());
    let wish = store.wish(false, LEASE);
    let id = enqueue(&store, &surface, Lane::Heavy).await.unwrap().job().id;
    assert_eq!(wish.withdrawn().await.unwrap().unwrap().job.id, id, "it had been granted");
    let next = enqueue(&store, &surface, Lane::Heavy).await.unwrap().job().id;
    assert_eq!(store.job(next).await.unwrap().unwrap().state, State::Queued, "no one is left who wishes");
}

#[tokio::test]
async fn what_waits_when_the_store_closes_is_written_and_what_comes_later_is_refused() {
    let (store, directory) = store().await;
    let (written, closed) = tokio::join!(put(&store, "a", "mm"), store.close());
    closed.unwrap();
    let surface = written.unwrap();
    assert!(matches!(put(&store, "b", "mm").await, Err(StoreError::Interrupted)));
    drop(store);
    let store = Store::open(directory.path(), Clock::system()).await.unwrap();
    assert!(store.surface(&surface.id).await.unwrap().is_some());
}
