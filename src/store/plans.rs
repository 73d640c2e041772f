//! Every statement that runs while someone waits uses its index: asked of the database itself.

use sqlx::{AssertSqlSafe, Row, SqlSafeStr};

use super::lists::{self, JobFilter};
use super::{State, Store, enqueue, leases, results, surfaces};
use crate::clock::Clock;

async fn plan(store: &Store, sql: &str) -> String {
    let explain = AssertSqlSafe(format!("EXPLAIN QUERY PLAN {sql}")).into_sql_str();
    let rows = sqlx::query(explain).fetch_all(&store.0.readers).await.unwrap();
    rows.iter().map(|row| row.get::<String, _>("detail")).collect::<Vec<_>>().join("\n")
}

/// No walk over a whole table, and no sorting after the fact.
fn assert_direct(plan: &str, sql: &str) {
    assert!(!plan.contains("TEMP B-TREE"), "sorts:\n{plan}\n{sql}");
    for line in plan.lines().filter(|line| line.contains("SCAN")) {
        // Walking through a counted subquery is walking through what it was limited to.
        let bounded = line.contains("(subquery") || line.contains("CONSTANT ROW");
        assert!(bounded, "walks the table:\n{plan}\n{sql}");
    }
}

#[tokio::test]
async fn claims_lists_and_look_ups_use_their_index() {
    let directory = tempfile::tempdir().unwrap();
    let store = Store::open(directory.path(), Clock::system()).await.unwrap();
    let cases = [
        (leases::CLAIM_LIGHT, "jobs_queued_by_lane"),
        (leases::CLAIM_ANY, "jobs_by_state"),
        (leases::UNWANTED, "jobs_by_state"),
        (leases::LOST_BY_BOOT, "jobs_by_state"),
        (leases::LOST_BY_TIME, "jobs_by_state"),
        (enqueue::COUNT_WAITING, "jobs_by_state"),
        (enqueue::SPAN_WAITING, "jobs_by_state"),
        (lists::JOB_BY_ID, "sqlite_autoindex_jobs"),
        (lists::JOB_BY_SEQ, "INTEGER PRIMARY KEY"),
        (lists::COUNT, "jobs_by_state"),
        (lists::EVENTS, "PRIMARY KEY"),
        (results::RESULT, "PRIMARY KEY"),
        (results::RESULTS, "PRIMARY KEY"),
        (surfaces::SURFACE, "sqlite_autoindex_surfaces"),
        (surfaces::CONTENT, "sqlite_autoindex_surfaces"),
        (surfaces::SURFACES, "INTEGER PRIMARY KEY"),
    ];
    for (sql, index) in cases {
        let plan = plan(&store, sql).await;
        assert!(plan.contains(index), "not by {index}:\n{plan}\n{sql}");
        assert_direct(&plan, sql);
    }
}

#[tokio::test]
async fn every_filter_of_a_list_has_its_index() {
    let directory = tempfile::tempdir().unwrap();
    let store = Store::open(directory.path(), Clock::system()).await.unwrap();
    let surface = Some(crate::store::SurfaceId::derive(crate::store::Digest::of(b""), ""));
    let text = |text: &str| Some(text.to_owned());
    let labels = [("order".to_owned(), "2231".to_owned()), ("part".to_owned(), "4711-A".to_owned())];
    let cases = [
        (JobFilter::default(), "INTEGER PRIMARY KEY"),
        (JobFilter { state: Some(State::Queued), ..JobFilter::default() }, "jobs_by_state"),
        (JobFilter { kind: text("flatten"), ..JobFilter::default() }, "jobs_by_kind"),
        (JobFilter { surface, ..JobFilter::default() }, "jobs_by_surface"),
        (JobFilter { verdict: text("pass"), ..JobFilter::default() }, "jobs_by_verdict"),
        (JobFilter { labels: labels.into(), ..JobFilter::default() }, "key=? AND value=?"),
    ];
    for (filter, index) in cases {
        let list = lists::list(&filter, Some(100), 10).sql().as_str().to_owned();
        let listed = plan(&store, &list).await;
        assert!(listed.contains(index), "not by {index}:\n{listed}\n{list}");
        assert_direct(&listed, &list);
        let feed = lists::feed(&filter, 7, 10).sql().as_str().to_owned();
        let fed = plan(&store, &feed).await;
        assert!(fed.contains("end_seq>?"), "the feed does not go by end_seq:\n{fed}\n{feed}");
        assert_direct(&fed, &feed);
    }
}
