//! What the integration tests share.

pub(crate) mod api;
pub(crate) mod child;
pub(crate) mod contract;
pub(crate) mod events;
pub(crate) mod queue;
pub(crate) mod service;

use std::path::Path;

use sqlx::sqlite::SqliteConnectOptions;
use sqlx::{AssertSqlSafe, ConnectOptions, Row, SqliteConnection};

/// A connection of its own to the database in a data directory, past the store.
pub(crate) async fn raw(directory: &Path) -> SqliteConnection {
    SqliteConnectOptions::new().filename(directory.join("planish.db")).foreign_keys(true).connect().await.unwrap()
}

/// The only number that a statement gives.
pub(crate) async fn number(raw: &mut SqliteConnection, sql: &str) -> i64 {
    sqlx::query(AssertSqlSafe(sql.to_owned())).fetch_one(raw).await.unwrap().get(0)
}

/// Asserts that the database is whole: its pages, its references, and every rule that spans rows.
pub(crate) async fn assert_whole(raw: &mut SqliteConnection) {
    let check: String = sqlx::query("PRAGMA integrity_check").fetch_one(&mut *raw).await.unwrap().get(0);
    assert_eq!(check, "ok");
    assert!(sqlx::query("PRAGMA foreign_key_check").fetch_optional(&mut *raw).await.unwrap().is_none());
    let orphans = "SELECT count(*) FROM blobs WHERE digest NOT IN (SELECT blob FROM results) \
         AND digest NOT IN (SELECT content FROM surfaces)";
    assert_eq!(number(raw, orphans).await, 0, "bytes to which nothing points");
    let bare = "SELECT count(*) FROM jobs WHERE state = 'succeeded' AND seq NOT IN (SELECT job FROM results)";
    assert_eq!(number(raw, bare).await, 0, "a job that succeeded without a result");
    let early = "SELECT count(*) FROM results WHERE job IN \
         (SELECT seq FROM jobs WHERE state NOT IN ('succeeded', 'failed'))";
    assert_eq!(number(raw, early).await, 0, "a result of a job that has none");
    let labels = "SELECT count(*) FROM jobs AS j, json_each(j.labels) AS l WHERE NOT EXISTS \
         (SELECT 1 FROM job_labels WHERE job = j.seq AND key = l.key AND value = l.value)";
    assert_eq!(number(raw, labels).await, 0, "a label that no list finds");
}
