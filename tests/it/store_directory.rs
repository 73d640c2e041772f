//! The data directory: one process at a time, schemas that are known, nothing left in the log after a clean end.

use planish::clock::Clock;
use planish::queue::State;
use planish::store::{Lane, Store, StoreError};
use serde_json::json;
use sqlx::{Connection, SqliteConnection};

use crate::support::queue::{new_job, open, surface};
use crate::support::raw;

#[tokio::test]
async fn a_second_opener_of_the_directory_is_refused_until_the_first_has_closed() {
    let directory = tempfile::tempdir().unwrap();
    let store = open(directory.path()).await;
    let refused = Store::open(directory.path(), Clock::system()).await.unwrap_err();
    assert!(matches!(refused, StoreError::InUse(_)), "{refused}");
    assert!(refused.to_string().contains("in use by another process"), "{refused}");
    store.close().await.unwrap();
    open(directory.path()).await.close().await.unwrap();
}

#[tokio::test]
async fn a_database_of_a_newer_schema_is_refused_and_left_as_it_was() {
    let directory = tempfile::tempdir().unwrap();
    open(directory.path()).await.close().await.unwrap();
    let mut raw = raw(directory.path()).await;
    sqlx::query(
        "INSERT INTO _sqlx_migrations (version, description, success, checksum, execution_time) \
         VALUES (9000, 'of the future', 1, x'00', 0)",
    )
    .execute(&mut raw)
    .await
    .unwrap();
    raw.close().await.unwrap();
    let refused = Store::open(directory.path(), Clock::system()).await.unwrap_err();
    assert!(matches!(refused, StoreError::NewerSchema { found: 9000, .. }), "{refused}");
    assert!(refused.to_string().contains("newer version"), "{refused}");
}

#[tokio::test]
async fn a_directory_that_cannot_be_made_is_named() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("file");
    std::fs::write(&file, "in the way").unwrap();
    let refused = Store::open(&file.join("data"), Clock::system()).await.unwrap_err();
    assert!(matches!(&refused, StoreError::Directory { .. }), "{refused}");
    assert!(refused.to_string().contains("file/data"), "{refused}");
}

#[tokio::test]
async fn what_was_stored_is_there_after_closing_and_the_log_is_empty() {
    let directory = tempfile::tempdir().unwrap();
    let store = open(directory.path()).await;
    store.ping().await.unwrap();
    let surface = surface(&store).await;
    let job = store.enqueue(new_job(&surface, json!({ "x": 0.1 })), Lane::Light, 10).await.unwrap().job().clone();
    store.close().await.unwrap();
    assert!(store.ping().await.is_err(), "a closed store does nothing");
    let log = directory.path().join("planish.db-wal");
    assert!(std::fs::metadata(&log).map_or(0, |meta| meta.len()) == 0, "the log was not written back");
    let store = open(directory.path()).await;
    assert_eq!(store.job(job.id).await.unwrap(), Some(job));
    assert_eq!(store.count(State::Queued).await.unwrap(), 1);
}

#[tokio::test]
async fn a_database_locked_by_an_outsider_is_busy_and_not_a_fault() {
    let directory = tempfile::tempdir().unwrap();
    let store = open(directory.path()).await;
    let mut outsider: SqliteConnection = raw(directory.path()).await;
    sqlx::query("BEGIN EXCLUSIVE").execute(&mut outsider).await.unwrap();
    let refused = store.ping().await.unwrap_err();
    assert!(matches!(refused, StoreError::Busy), "{refused}");
    sqlx::query("COMMIT").execute(&mut outsider).await.unwrap();
    store.ping().await.unwrap();
}
